//! Figure 9: the zero moment point of every robot in its support region.

use super::{Runs, list};
use crate::scene::{Axis, Figure, LegendEntry, Mark, Panel, Stroke, range_of};
use crate::style;
use crate::write::ReportedRun;

/// The least that a y axis spans.
const LEAST_M: f64 = 0.1;
const DIRECTIONS: [&str; 2] = ["ahead", "to the left"];

pub fn figure(runs: &Runs<'_>) -> Result<Figure, String> {
    let names = runs.names(|run| run.robots.iter().map(|robot| robot.name.as_str()).collect());
    if names.is_empty() {
        return Err("the run has no robots".to_owned());
    }
    let panels: Vec<_> =
        names.iter().flat_map(|name| [0, 1].map(|direction| panel(runs, name, direction))).collect();
    let mut legend = runs.legend_of_lines("zero moment point");
    legend.push(LegendEntry::patch("support region", style::SHADE));
    let caption = format!(
        "Zero moment point of {}: the true centre of pressure, averaged over each tick, ahead of and to the \
         left of where the robot started. The support region reaches as far as the soles that bear more \
         than 5 % of its weight. The note is the smallest distance to its edge in any direction.{}",
        list(&names),
        runs.caption_end()
    );
    Ok(Figure {
        title: "Zero moment point in the support region".to_owned(),
        subtitle: runs.subtitle(),
        caption,
        legend,
        columns: 2,
        panels,
        panel_height_px: 210,
        has_equal_scales: false,
    })
}

fn panel(runs: &Runs<'_>, name: &str, direction: usize) -> Panel {
    let (mut bands, mut lines) = (Vec::new(), Vec::new());
    for (index, run) in runs.each() {
        let Some(robot) = run.data.robots.iter().find(|robot| robot.name == name) else {
            continue;
        };
        let x = run.data.time_s.clone();
        let lower: Vec<_> = robot.support_m.iter().map(|reach| reach[direction].0).collect();
        let upper: Vec<_> = robot.support_m.iter().map(|reach| reach[direction].1).collect();
        if index == 0 {
            bands.push(Mark::Band { x: x.clone(), lower, upper, colour: style::SHADE });
        } else {
            for edge in [lower, upper] {
                let points = x.iter().copied().zip(edge).collect();
                bands.push(Mark::Series {
                    points,
                    stroke: Stroke { is_dashed: true, ..Stroke::thin(style::FAINT_INK) },
                });
            }
        }
        let points = x.into_iter().zip(robot.zmp_m.iter().map(|point| point[direction])).collect();
        lines.push(Mark::Series { points, stroke: runs.only_stroke(index) });
    }
    let margin_mm = |run: &ReportedRun| {
        let robot = run.summary.robots.iter().find(|robot| robot.name == name)?;
        Some(1e3 * robot.zmp_margin_min_m)
    };
    let marks: Vec<_> = bands.into_iter().chain(lines).collect();
    let mut panel = Panel {
        title: format!("{name}, {}", DIRECTIONS[direction]),
        note: if direction == 0 { runs.note("smallest margin", margin_mm, "mm") } else { String::new() },
        x: runs.time_axis(),
        y: Axis { label: "position [m]".to_owned(), range: 0.0..1.0 },
        marks,
    };
    panel.y.range = range_of(panel.values(), LEAST_M);
    panel
}
