//! Figures 14 and 18: the internal forces and moments.

use super::Runs;
use crate::run_data::{InternalCourse, RunData};
use crate::scene::{Axis, Figure, LegendEntry, Mark, Panel, Stroke, share_y_range};
use crate::style;
use crate::write::ReportedRun;
use mikoshi_observation::InternalSummary;
use mikoshi_spatial::{Object, Wrench};
use nalgebra::Vector3;

/// References below this are zero.
const ZERO: f64 = 1e-9;
/// The least that y axes span, N and Nm.
const LEAST: f64 = 0.5;

/// Figure 14, of a team that stands.
pub fn standing(runs: &Runs<'_>) -> Result<Figure, String> {
    if runs.walk() {
        return Err("robots walk: figure 18 shows the internal forces".to_owned());
    }
    figure(
        runs,
        "A vertical line is the start of hybrid control; the notes are the norms then and at the end.",
    )
}

/// Figure 18, of a team that walks.
pub fn walking(runs: &Runs<'_>) -> Result<Figure, String> {
    if !runs.walk() {
        return Err("no robot takes a step: figure 14 shows the internal forces".to_owned());
    }
    figure(
        runs,
        "Strokes on the lower edge: a foot lands; a vertical line is the start of hybrid control. The notes \
         are the largest norm from 3 s after that start on, and the norm at the end.",
    )
}

fn figure(runs: &Runs<'_>, notes: &str) -> Result<Figure, String> {
    let names = runs.names(|run| run.internal.iter().map(|course| course.name.as_str()).collect());
    if names.is_empty() {
        return Err("one hand alone holds the object: there are no internal forces".to_owned());
    }
    let panel = |name: &String, part: Part| panel(runs, name, part);
    let mut panels: Vec<_> =
        names.iter().flat_map(|name| [panel(name, Part::Force), panel(name, Part::Moment)]).collect();
    for column in 0..2 {
        share_y_range(panels.iter_mut().skip(column).step_by(2), LEAST);
    }
    let line = |(axis, text)| LegendEntry::line(text, Stroke::solid(style::colour(axis)));
    let mut legend: Vec<_> = (0..).zip(["x, roll", "y, pitch", "z, yaw"]).map(line).collect();
    if panels.iter().flat_map(|panel| &panel.marks).any(is_reference) {
        legend.push(LegendEntry::line("reference", Stroke::reference()));
    }
    legend.extend(runs.legend());
    Ok(Figure {
        title: "Internal forces and moments".to_owned(),
        subtitle: runs.subtitle(),
        caption: format!(
            "Generalized internal forces (left) and moments (right) in the object's axes, from the true, \
             unfiltered wrenches of the hands on the object. X|Y is what X and Y press against each other. \
             {notes}{}",
            runs.caption_end()
        ),
        legend,
        columns: 2,
        panels,
        panel_height_px: 150,
        has_equal_scales: false,
    })
}

fn is_reference(mark: &Mark) -> bool {
    matches!(mark, Mark::Series { stroke, .. } if stroke.width_px == style::REFERENCE_PX)
}

/// Half of a wrench.
#[derive(Clone, Copy)]
enum Part {
    Force,
    Moment,
}

impl Part {
    fn of(self, wrench: &Wrench<Object>) -> Vector3<f64> {
        match self {
            Self::Force => wrench.force,
            Self::Moment => wrench.moment,
        }
    }

    fn label(self) -> &'static str {
        match self {
            Self::Force => "force [N]",
            Self::Moment => "moment [Nm]",
        }
    }

    /// What the summaries say of one internal force: at the start, or its peak where robots walk; and at
    /// the end.
    fn note(self, runs: &Runs<'_>, name: &str) -> String {
        let figure = |of: fn(&InternalSummary) -> [f64; 2]| {
            move |run: &ReportedRun| {
                let row = run.summary.internal.iter().find(|row| row.name == name)?;
                let [force, moment] = of(row);
                Some(match self {
                    Self::Force => force,
                    Self::Moment => moment,
                })
            }
        };
        let unit = match self {
            Self::Force => "N",
            Self::Moment => "Nm",
        };
        let first = match runs.walk() {
            true => runs.note("peak", figure(|row| [row.peak_n, row.peak_nm]), ""),
            false => runs.note("start", figure(|row| [row.start_n, row.start_nm]), ""),
        };
        format!("{}, {}", first, runs.note("end", figure(|row| [row.end_n, row.end_nm]), unit))
    }
}

fn panel(runs: &Runs<'_>, name: &str, part: Part) -> Panel {
    let (mut below, mut lines) = (runs.starts(), Vec::new());
    for (index, run) in runs.data().enumerate() {
        let Some(course) = run.internal.iter().find(|course| course.name == name) else {
            continue;
        };
        if index == 0 && runs.walk() {
            below.push(Mark::Rug { xs: landings(run), stroke: Stroke::thin(style::FAINT_INK) });
        }
        for axis in 0..3 {
            let reference = reference(run, course, part, axis);
            let stroke = runs.stroke(index, Stroke::reference());
            below.extend(reference.map(|points| Mark::Series { points, stroke }));
            let points = run.time_s.iter().zip(&course.actual);
            let points = points.map(|(t, wrench)| (*t, part.of(wrench)[axis])).collect();
            let stroke = runs.stroke(index, Stroke::solid(style::colour(axis)));
            lines.push(Mark::Series { points, stroke });
        }
    }
    // The first run lies over the second.
    lines.reverse();
    Panel {
        title: name.to_owned(),
        note: part.note(runs, name),
        x: runs.time_axis(),
        y: Axis { label: part.label().to_owned(), range: 0.0..1.0 },
        marks: below.into_iter().chain(lines).collect(),
    }
}

/// The reference along an axis, if it is ever another than zero.
fn reference(run: &RunData, course: &InternalCourse, part: Part, axis: usize) -> Option<Vec<(f64, f64)>> {
    let value = |wrench: &Option<_>| wrench.as_ref().map_or(f64::NAN, |wrench| part.of(wrench)[axis]);
    let is_ever_set = course.reference.iter().map(value).any(|value| value.abs() > ZERO);
    is_ever_set.then(|| run.time_s.iter().copied().zip(course.reference.iter().map(value)).collect())
}

/// When steps end.
fn landings(run: &RunData) -> Vec<f64> {
    let stances = run.robots.iter().flat_map(|robot| &robot.stances);
    let landed = stances.filter(|stance| !stance.is_first);
    let mut ticks: Vec<_> = landed.map(|stance| stance.tick).collect();
    ticks.sort_unstable();
    ticks.dedup();
    ticks.into_iter().map(|tick| run.time_s[tick]).collect()
}
