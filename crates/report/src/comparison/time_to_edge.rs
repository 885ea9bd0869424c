//! How long a follower that stands still can be pulled: measured, against eq. 42.

use super::runs;
use crate::scene::{Axis, Figure, LegendEntry, Mark, Panel, Stroke};
use crate::style;
use mikoshi_observation::Figures;
use serde::Serialize;

const PANEL_HEIGHT_PX: u32 = 560;
/// Ratios that are always shown, about 1.
const LEAST_RATIO_SPAN: f64 = 0.3;

/// Followers that stand still, pulled at several velocities through several stiffnesses.
#[derive(Clone, Debug, Serialize)]
pub struct TimeToEdge {
    /// How far a measured time may be from the predicted one, as a share of it.
    pub within: f64,
    /// Every run.
    pub runs: Vec<EdgeTime>,
}

/// One of them.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct EdgeTime {
    /// Of the object.
    pub velocity_m_s: f64,
    /// Between both robots: k of eq. 42.
    pub stiffness_n_m: f64,
    /// By eq. 42, from the start of the motion, its ramp included.
    pub predicted_s: f64,
    /// None where the zero moment point never got there.
    pub measured_s: Option<f64>,
}

impl EdgeTime {
    /// Measured over predicted; NaN where nothing was measured.
    fn ratio(&self) -> f64 {
        self.measured_s.unwrap_or(f64::NAN) / self.predicted_s
    }

    fn name(&self) -> String {
        format!("{} m/s through {:.0} N/m", self.velocity_m_s, self.stiffness_n_m)
    }
}

impl TimeToEdge {
    pub(super) fn is_met(&self) -> bool {
        !self.runs.is_empty() && self.runs.iter().all(|run| self.agrees(run))
    }

    fn agrees(&self, run: &EdgeTime) -> bool {
        // NaN does not.
        (run.ratio() - 1.0).abs() <= self.within
    }

    pub(super) fn findings(&self) -> Vec<String> {
        let percent = 100.0 * self.within;
        let agreeing = self.runs.iter().filter(|run| self.agrees(run)).count();
        let mut findings = vec![format!(
            "{agreeing} of {} agree with eq. 42 within {percent:.0} %: a follower that stands still has its \
             zero moment point at the edge of its feet when the equation says.",
            runs(self.runs.len())
        )];
        let reached = || self.runs.iter().filter(|run| run.measured_s.is_some());
        let extreme = |sign: f64| reached().max_by(|a, b| (sign * a.ratio()).total_cmp(&(sign * b.ratio())));
        if let (Some(earliest), Some(latest)) = (extreme(-1.0), extreme(1.0)) {
            findings.push(format!(
                "Measured over predicted time lies between {:.2} ({}) and {:.2} ({}).",
                earliest.ratio(),
                earliest.name(),
                latest.ratio(),
                latest.name()
            ));
        }
        for run in self.runs.iter().filter(|run| !self.agrees(run)) {
            findings.push(match run.measured_s {
                Some(measured_s) => format!(
                    "Simulation and paper disagree at {}: {measured_s:.2} s, where eq. 42 says {:.2} s.",
                    run.name(),
                    run.predicted_s
                ),
                None => format!(
                    "Simulation and paper disagree at {}: the edge is never reached, where eq. 42 says {:.2} s.",
                    run.name(),
                    run.predicted_s
                ),
            });
        }
        findings
    }

    pub(super) fn figure(&self) -> Figure {
        let velocities = self.velocities();
        let band = format!("within {:.0} %", 100.0 * self.within);
        let mut legend: Vec<_> = velocities
            .iter()
            .enumerate()
            .map(|(index, velocity)| LegendEntry::patch(format!("{velocity} m/s"), style::colour(index)))
            .collect();
        legend.push(LegendEntry::line("eq. 42", equation_stroke()));
        legend.push(LegendEntry::patch(band, style::SHADE));
        let caption = format!(
            "Time from the start of the motion until the true zero moment point of a follower that stands \
             still is within {:.0} mm of the edge of its feet: measured, over what eq. 42 predicts with the \
             velocity's ramp, and their ratio over the stiffness between both robots. Below 1 the follower is \
             at its edge sooner than predicted.",
            1e3 * Figures::EDGE_M
        );
        Figure {
            title: "Eq. 42: how long a standing follower can be pulled".to_owned(),
            subtitle: runs(self.runs.len()),
            caption,
            legend,
            columns: 2,
            panels: vec![self.times(&velocities), self.ratios(&velocities)],
            panel_height_px: PANEL_HEIGHT_PX,
            has_equal_scales: false,
        }
    }

    /// Each once, ascending.
    fn velocities(&self) -> Vec<f64> {
        let mut velocities: Vec<_> = self.runs.iter().map(|run| run.velocity_m_s).collect();
        velocities.sort_by(f64::total_cmp);
        velocities.dedup();
        velocities
    }

    /// The runs at each velocity, by stiffness, with its colour.
    fn by_velocity(&self, velocities: &[f64]) -> Vec<(Vec<EdgeTime>, plotters::style::RGBColor)> {
        let of = |(index, velocity): (usize, &f64)| {
            let mut runs: Vec<_> =
                self.runs.iter().filter(|run| run.velocity_m_s == *velocity).copied().collect();
            runs.sort_by(|a, b| a.stiffness_n_m.total_cmp(&b.stiffness_n_m));
            (runs, style::colour(index))
        };
        velocities.iter().enumerate().map(of).collect()
    }

    fn times(&self, velocities: &[f64]) -> Panel {
        let times = self.runs.iter().flat_map(|run| [Some(run.predicted_s), run.measured_s]).flatten();
        let end = 1.1 * times.fold(0.1, f64::max);
        // The band leaves the panel on its upper edge before it does on its right one.
        let mut marks = self.corridor(&[0.0, end / (1.0 + self.within), end], end, |x| x);
        for (runs, colour) in self.by_velocity(velocities) {
            for run in runs {
                if let Some(measured_s) = run.measured_s {
                    marks.push(Mark::Dot { at: (run.predicted_s, measured_s), colour });
                }
            }
        }
        Panel {
            title: "time to the edge".to_owned(),
            note: String::new(),
            x: Axis { label: "by eq. 42 [s]".to_owned(), range: 0.0..end },
            y: Axis { label: "measured [s]".to_owned(), range: 0.0..end },
            marks,
        }
    }

    fn ratios(&self, velocities: &[f64]) -> Panel {
        let stiffness = || self.runs.iter().map(|run| run.stiffness_n_m);
        let (least, largest) = (stiffness().fold(f64::INFINITY, f64::min), stiffness().fold(0.0, f64::max));
        let x = if least <= largest { 0.9 * least..1.1 * largest } else { 0.0..1.0 };
        let mut marks = self.corridor(&[x.start, x.end], f64::INFINITY, |_| 1.0);
        for (runs, colour) in self.by_velocity(velocities) {
            let points: Vec<_> = runs.iter().map(|run| (run.stiffness_n_m, run.ratio())).collect();
            let dots = points.iter().filter(|point| point.1.is_finite());
            marks.extend(dots.map(|at| Mark::Dot { at: *at, colour }));
            marks.push(Mark::Path { points, stroke: Stroke::thin(colour) });
        }
        let off = self.runs.iter().map(|run| (run.ratio() - 1.0).abs()).filter(|off| off.is_finite());
        let span = 1.1 * off.fold(self.within.max(LEAST_RATIO_SPAN), f64::max);
        Panel {
            title: "measured over predicted".to_owned(),
            note: String::new(),
            x: Axis { label: "stiffness between the robots [N/m]".to_owned(), range: x },
            y: Axis { label: "ratio".to_owned(), range: 1.0 - span..1.0 + span },
            marks,
        }
    }

    /// The prediction at `x`, and what counts as agreement about it, up to `most`.
    fn corridor(&self, x: &[f64], most: f64, predicted: impl Fn(f64) -> f64) -> Vec<Mark> {
        let at = |factor: f64| x.iter().map(|x| (factor * predicted(*x)).min(most)).collect::<Vec<_>>();
        let line = x.iter().copied().zip(at(1.0)).collect();
        let (lower, upper) = (at(1.0 - self.within), at(1.0 + self.within));
        vec![
            Mark::Band { x: x.to_vec(), lower, upper, colour: style::SHADE },
            Mark::Path { points: line, stroke: equation_stroke() },
        ]
    }
}

fn equation_stroke() -> Stroke {
    Stroke { is_dashed: true, ..Stroke::thin(style::INK) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(velocity_m_s: f64, predicted_s: f64, measured_s: Option<f64>) -> EdgeTime {
        EdgeTime { velocity_m_s, stiffness_n_m: 1000.0, predicted_s, measured_s }
    }

    #[test]
    fn runs_within_the_band_agree_and_others_are_named_with_both_times() {
        let mut comparison =
            TimeToEdge { within: 0.2, runs: vec![run(0.05, 2.0, Some(1.9)), run(0.1, 1.0, Some(1.1))] };
        assert!(comparison.is_met());
        let said = comparison.findings();
        assert!(said[0].starts_with("2 of 2 runs agree with eq. 42 within 20 %"), "{said:?}");
        assert!(said[1].contains("0.95 (0.05 m/s through 1000 N/m) and 1.10"), "{said:?}");
        assert_eq!(said.len(), 2);

        comparison.runs.push(run(0.2, 0.5, Some(0.7)));
        comparison.runs.push(run(0.3, 0.4, None));
        assert!(!comparison.is_met());
        let said = comparison.findings();
        assert!(said[0].starts_with("2 of 4 runs"), "{said:?}");
        assert!(said[2].ends_with("disagree at 0.2 m/s through 1000 N/m: 0.70 s, where eq. 42 says 0.50 s."));
        assert!(said[3].contains("the edge is never reached"), "{said:?}");
    }

    #[test]
    fn a_comparison_of_nothing_agrees_with_nothing() {
        assert!(!TimeToEdge { within: 0.2, runs: vec![] }.is_met());
    }

    #[test]
    fn every_run_that_reached_the_edge_is_a_dot_in_both_panels() {
        let runs = vec![run(0.05, 2.0, Some(1.9)), run(0.1, 1.0, Some(1.1)), run(0.2, 0.4, None)];
        let figure = TimeToEdge { within: 0.2, runs }.figure();
        assert_eq!(figure.panels.len(), 2);
        for panel in &figure.panels {
            let dots = panel.marks.iter().filter(|mark| matches!(mark, Mark::Dot { .. })).count();
            assert_eq!(dots, 2, "{}", panel.title);
        }
        assert!(figure.legend.iter().any(|entry| entry.text == "within 20 %"));
    }
}
