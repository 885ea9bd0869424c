//! Figure 16: feet and object from above.

use super::{Runs, list};
use crate::run_data::{ObjectCourse, RobotCourse, RunData, Stance};
use crate::scene::{Axis, Figure, LegendEntry, Mark, Panel, Stroke};
use crate::style;
use core::ops::Range;
use plotters::style::RGBColor;

/// At most this many outlines of the object.
const OUTLINES: f64 = 8.0;
/// Steps of time between outlines that read well.
const STEPS_S: [f64; 8] = [1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0];
/// Times along the object's path are at least this far apart.
const LABEL_M: f64 = 0.12;
/// Share of a robot's colour in its soles, where they stood first and later.
const FIRST: f64 = 0.5;
const LATER: f64 = 0.12;
const OUTLINE_PX: f64 = 1.2;
/// Air around what is shown.
const AIR_M: f64 = 0.1;

pub fn figure(runs: &Runs<'_>) -> Result<Figure, String> {
    let names = runs.names(|run| run.robots.iter().map(|robot| robot.name.as_str()).collect());
    let colour = |robot: &RobotCourse| {
        style::colour(names.iter().position(|name| *name == robot.name).unwrap_or_default())
    };
    let mut marks = Vec::new();
    for (index, run) in runs.data().enumerate() {
        // What came later lies over what was there before.
        let mut stances = Vec::new();
        for robot in &run.robots {
            stances.extend(robot.stances.iter().map(|stance| (stance, colour(robot))));
        }
        stances.sort_by_key(|(stance, _)| stance.tick);
        marks.extend(stances.into_iter().map(|(stance, colour)| sole(runs, index, stance, colour)));
        marks.extend(run.robots.iter().map(|robot| {
            let points = robot.com_m.iter().map(|[x, y]| (*x, *y)).collect();
            Mark::Path { points, stroke: runs.stroke(index, Stroke::thin(colour(robot))) }
        }));
        marks.extend(object(runs, index, run));
    }
    // Words lie over everything.
    for run in runs.data().take(1) {
        marks.extend(times(runs, run));
        marks.extend(run.robots.iter().map(|robot| Mark::Label {
            at: robot.start_m(),
            text: robot.name.clone(),
            colour: colour(robot),
        }));
    }
    let (x, y) = ranges(&marks);
    let panel = Panel {
        title: String::new(),
        note: String::new(),
        x: Axis { label: "x [m]".to_owned(), range: x },
        y: Axis { label: "y [m]".to_owned(), range: y },
        marks,
    };
    let robot = |(robot, name)| LegendEntry::patch(name, style::tint(style::colour(robot), FIRST));
    let mut legend: Vec<_> = names.iter().enumerate().map(robot).collect();
    legend.push(LegendEntry::line("object", Stroke::solid(style::INK)));
    legend.push(LegendEntry::line("its reference", Stroke::reference()));
    legend.extend(runs.legend());
    let steps = match runs.walk() {
        true => "Soles of every step as they were set down, darker where robots stood at first",
        false => "Soles; nobody takes a step",
    };
    Ok(Figure {
        title: "Feet and object from above".to_owned(),
        subtitle: runs.subtitle(),
        caption: format!(
            "{steps}. Path of the object's frame Σa and of its reference, with times, and the object's \
             outlines at those times. The thin lines are the paths of the centres of mass of {}.{}",
            list(&names),
            runs.caption_end()
        ),
        legend,
        columns: 1,
        panels: vec![panel],
        panel_height_px: 0,
        has_equal_scales: true,
    })
}

fn sole(runs: &Runs<'_>, index: usize, stance: &Stance, colour: RGBColor) -> Mark {
    let share = if stance.is_first { FIRST } else { LATER };
    let stroke = Stroke { width_px: OUTLINE_PX, ..Stroke::solid(colour) };
    Mark::Outline {
        corners: stance.corners_m.clone(),
        fill: (index == 0).then(|| style::tint(colour, share)),
        stroke: runs.stroke(index, stroke),
    }
}

fn object(runs: &Runs<'_>, index: usize, run: &RunData) -> Vec<Mark> {
    let object = &run.object;
    let nowhere = (f64::NAN, f64::NAN);
    let reference = object.X_WA_ref.iter();
    let reference =
        reference.map(|X_WA| X_WA.map_or(nowhere, |X_WA| (X_WA.translation.x, X_WA.translation.y)));
    let path = |points, stroke| Mark::Path { points, stroke: runs.stroke(index, stroke) };
    let mut marks = vec![
        path(reference.collect(), Stroke::reference()),
        path((0..object.X_WBody.len()).map(|tick| place(object, tick)).collect(), Stroke::solid(style::INK)),
    ];
    for (tick, _) in outline_ticks(runs, run) {
        let stroke = Stroke { width_px: OUTLINE_PX, ..Stroke::solid(style::FAINT_INK) };
        let stroke = runs.stroke(index, stroke);
        marks.push(Mark::Outline { corners: object.outline(tick), fill: None, stroke });
        marks.push(Mark::Dot { at: place(object, tick), colour: style::INK });
    }
    marks
}

/// When the object was where, along its path; not too near to each other.
fn times(runs: &Runs<'_>, run: &RunData) -> Vec<Mark> {
    let mut labelled: Option<(f64, f64)> = None;
    let mut marks = Vec::new();
    for (tick, t) in outline_ticks(runs, run).into_iter().filter(|_| runs.walk()) {
        let (x, y) = place(&run.object, tick);
        if labelled.is_none_or(|(last_x, last_y)| (x - last_x).hypot(y - last_y) > LABEL_M) {
            labelled = Some((x, y));
            let at = (x, y + 0.4 * LABEL_M);
            marks.push(Mark::Label { at, text: format!("{t} s"), colour: style::FAINT_INK });
        }
    }
    marks
}

/// Σa from above.
fn place(object: &ObjectCourse, tick: usize) -> (f64, f64) {
    let p_WA = object.X_WA(tick).translation;
    (p_WA.x, p_WA.y)
}

/// The ticks in which the object's outline is drawn, and their times.
fn outline_ticks(runs: &Runs<'_>, run: &RunData) -> Vec<(usize, f64)> {
    if !runs.walk() {
        return vec![(0, 0.0)];
    }
    let end = run.time_s.last().copied().unwrap_or_default();
    let step = STEPS_S.into_iter().find(|step| end / step <= OUTLINES).unwrap_or(end);
    let times = (0..).map(|i| f64::from(i) * step).take_while(|t| *t <= end);
    times.map(|t| (run.time_s.partition_point(|time| *time < t - 0.5 * run.period_s), t)).collect()
}

fn ranges(marks: &[Mark]) -> (Range<f64>, Range<f64>) {
    let points = || {
        marks.iter().flat_map(|mark| match mark {
            Mark::Outline { corners, .. } => corners.as_slice(),
            Mark::Path { points, .. } => points.as_slice(),
            _ => &[],
        })
    };
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low > high { -1.0..1.0 } else { low - AIR_M..high + AIR_M }
    };
    (range(&mut points().map(|point| point.0)), range(&mut points().map(|point| point.1)))
}
