//! Figures 12 and 15: where the object is, and where it should be.

use super::Runs;
use crate::run_data::RunData;
use crate::scene::{Axis, Figure, LegendEntry, Mark, Panel, Stroke, share_y_range};
use crate::style;
use crate::write::ReportedRun;
use core::f64::consts::{PI, TAU};
use mikoshi_observation::ObjectSummary;
use mikoshi_spatial::{Object, Pose, World, euler_zyx};

/// Panels beside each other: the axes of the position, or of the attitude.
const AXES: usize = 3;
/// Of everything that is shown in mm and mrad.
const MILLI: f64 = 1e3;

/// Figure 12, of a team that stands: displacements are small, and are errors.
pub fn standing(runs: &Runs<'_>) -> Result<Figure, String> {
    if runs.walk() {
        return Err("robots walk: figure 15 shows the object's motion".to_owned());
    }
    let mut panels = row(runs, Part::Position, Quantity::Motion, "position [mm]", MILLI);
    panels.extend(row(runs, Part::Attitude, Quantity::Motion, "angle [mrad]", MILLI));
    for ((row, part), least) in panels.chunks_mut(AXES).zip([Part::Position, Part::Attitude]).zip([1.0, 0.5])
    {
        share_y_range(row.iter_mut(), least);
        add_notes(runs, row, part);
    }
    for panel in &mut panels {
        panel.marks.extend(runs.starts());
    }
    let mut legend = legend(runs);
    if runs.are_controlled() {
        legend.push(LegendEntry::line("start of hybrid control", Stroke::thin(style::INK)));
    }
    Ok(Figure {
        title: "Position and attitude of the object".to_owned(),
        subtitle: runs.subtitle(),
        caption: format!(
            "True displacement of the object's frame Σa from where it is first asked to be, along and about \
             the world's axes (roll, pitch and yaw for display only), and its reference. The notes are RMS \
             and peak of the error.{}",
            runs.caption_end()
        ),
        legend,
        columns: AXES,
        panels,
        panel_height_px: 260,
        has_equal_scales: false,
    })
}

/// Figure 15, of a team that walks: the motion, and below it the error, which it dwarfs.
pub fn walking(runs: &Runs<'_>) -> Result<Figure, String> {
    if !runs.walk() {
        return Err("no robot takes a step: figure 12 shows the object".to_owned());
    }
    let mut panels = Vec::new();
    for (part, quantity, label, scale, least) in [
        (Part::Position, Quantity::Motion, "position [m]", 1.0, 0.1),
        (Part::Position, Quantity::Error, "error [mm]", MILLI, 1.0),
        (Part::Attitude, Quantity::Motion, "angle [rad]", 1.0, 0.05),
        (Part::Attitude, Quantity::Error, "error [mrad]", MILLI, 0.5),
    ] {
        let mut row = row(runs, part, quantity, label, scale);
        share_y_range(row.iter_mut(), least);
        if quantity == Quantity::Error {
            add_notes(runs, &mut row, part);
        }
        panels.extend(row);
    }
    Ok(Figure {
        title: "Position and attitude of the object".to_owned(),
        subtitle: runs.subtitle(),
        caption: format!(
            "True displacement of the object's frame Σa from where it is first asked to be, along and about \
             the world's axes (roll, pitch and yaw for display only), its reference, and what it is off its \
             reference (attitude as a rotation vector). The notes are RMS and peak of the error.{}",
            runs.caption_end()
        ),
        legend: legend(runs),
        columns: AXES,
        panels,
        panel_height_px: 220,
        has_equal_scales: false,
    })
}

/// Half of a displacement.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Position,
    Attitude,
}

/// What a panel shows.
#[derive(Clone, Copy, PartialEq)]
enum Quantity {
    Motion,
    Error,
}

impl Part {
    fn names(self) -> [&'static str; AXES] {
        match self {
            Self::Position => ["x", "y", "z"],
            Self::Attitude => ["roll", "pitch", "yaw"],
        }
    }

    fn of(self, displacement: &[f64; 6]) -> &[f64] {
        let (position, attitude) = displacement.split_at(AXES);
        match self {
            Self::Position => position,
            Self::Attitude => attitude,
        }
    }
}

fn legend(runs: &Runs<'_>) -> Vec<LegendEntry> {
    let mut legend = runs.legend_of_lines("actual");
    if runs.are_controlled() {
        legend.push(LegendEntry::line("reference", Stroke::reference()));
    }
    legend
}

/// The three panels of one part of the displacement.
fn row(runs: &Runs<'_>, part: Part, quantity: Quantity, label: &str, scale: f64) -> Vec<Panel> {
    let courses: Vec<_> = runs.data().map(Course::of).collect();
    let panel = |axis: usize| {
        let (mut references, mut actuals) = (Vec::new(), Vec::new());
        for (index, (run, course)) in runs.data().zip(&courses).enumerate() {
            let series = |values: &[[f64; 6]], stroke: Stroke| {
                let points = run.time_s.iter().zip(values);
                let points = points.map(|(t, value)| (*t, scale * part.of(value)[axis])).collect();
                Mark::Series { points, stroke }
            };
            let line = runs.only_stroke(index);
            match quantity {
                Quantity::Motion => {
                    references.push(series(&course.reference, Stroke::reference()));
                    actuals.push(series(&course.actual, line));
                }
                Quantity::Error => actuals.push(series(&course.error, line)),
            }
        }
        Panel {
            title: part.names()[axis].to_owned(),
            note: String::new(),
            x: runs.time_axis(),
            y: Axis { label: label.to_owned(), range: 0.0..1.0 },
            marks: references.into_iter().chain(actuals).collect(),
        }
    };
    (0..AXES).map(panel).collect()
}

/// RMS and peak of the error, as the summaries have them; of no run that nothing controls.
fn add_notes(runs: &Runs<'_>, panels: &mut [Panel], part: Part) {
    if !runs.are_controlled() {
        return;
    }
    for (axis, panel) in panels.iter_mut().enumerate() {
        let figure = |of: fn(&ObjectSummary) -> [[f64; AXES]; 2]| {
            move |run: &ReportedRun| {
                let [position, attitude] = of(&run.summary.object);
                let figure = if part == Part::Position { position } else { attitude }[axis];
                run.data.is_controlled().then_some(MILLI * figure)
            }
        };
        let rms = runs.note("RMS", figure(|object| [object.position_rms_m, object.attitude_rms_rad]), "");
        let peak = figure(|object| [object.position_peak_m, object.attitude_peak_rad]);
        let unit = if part == Part::Position { "mm" } else { "mrad" };
        panel.note = format!("{rms}, {}", runs.note("peak", peak, unit));
    }
}

/// Displacements from where the object is first asked to be, tick by tick: x, y, z \[m\], roll, pitch, yaw
/// \[rad\]; not numbers where there is none.
struct Course {
    actual: Vec<[f64; 6]>,
    reference: Vec<[f64; 6]>,
    /// As the summary judges it: the attitude as a rotation vector.
    error: Vec<[f64; 6]>,
}

impl Course {
    fn of(run: &RunData) -> Self {
        let object = &run.object;
        let start = object.X_WA_ref.iter().flatten().next().copied().unwrap_or_else(|| object.X_WA(0));
        let ticks = 0..object.X_WBody.len();
        let reference = object.X_WA_ref.iter().map(|X_WA| X_WA.map(|X_WA| displacement(&start, &X_WA)));
        let error = ticks.clone().map(|tick| {
            object.X_WA_ref[tick].map(|X_WA_ref| X_WA_ref.displacement_to(&object.X_WA(tick)).to_array())
        });
        let or_none = |value: Option<[f64; 6]>| value.unwrap_or([f64::NAN; 6]);
        let mut course = Self {
            reference: reference.map(or_none).collect(),
            error: error.map(or_none).collect(),
            actual: ticks.map(|tick| displacement(&start, &object.X_WA(tick))).collect(),
        };
        unwrap(&mut course.actual);
        unwrap(&mut course.reference);
        course
    }
}

/// Translation and Euler angles of the rotation from one pose to another, in world axes.
fn displacement(from: &Pose<World, Object>, to: &Pose<World, Object>) -> [f64; 6] {
    let p = to.translation - from.translation;
    let [yaw, pitch, roll]: [f64; 3] = euler_zyx(&(to.rotation * from.rotation.inverse())).into();
    [p.x, p.y, p.z, roll, pitch, yaw]
}

/// Takes the jumps of a turn out of the angles.
fn unwrap(course: &mut [[f64; 6]]) {
    let mut last = [0.0; AXES];
    for displacement in course {
        let angles = displacement[AXES..].iter_mut().zip(&mut last);
        for (angle, last) in angles.filter(|(angle, _)| angle.is_finite()) {
            *angle -= TAU * ((*angle - *last + PI) / TAU).floor();
            *last = *angle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_go_on_beyond_half_a_turn() {
        let mut course: Vec<_> = (0..100)
            .map(|i| 0.1 * f64::from(i))
            .map(|yaw| [0.0, 0.0, 0.0, 0.0, 0.0, (yaw + PI).rem_euclid(TAU) - PI])
            .collect();
        unwrap(&mut course);
        assert!((course[99][5] - 9.9).abs() < 1e-12, "{}", course[99][5]);
    }
}
