//! How late a follower may start: both robots over its delay, beside where the paper's leader falls.

use crate::scene::{Axis, Figure, LegendEntry, Mark, Panel, Stroke, range_of};
use crate::style;
use mikoshi_observation::Figures;
use plotters::style::RGBColor;
use serde::Serialize;

const PANEL_HEIGHT_PX: u32 = 230;
const COLOURS: [RGBColor; 2] = [style::PALETTE[1], style::PALETTE[0]];
/// Outside of its feet by more, a robot has left the ground.
const LEFT_GROUND_M: f64 = -0.1;
/// Room for the names of those who fell with the longest delay, as a share of the axis.
const NAME_ROOM: f64 = 0.08;
/// The least that axes span.
const LEAST_MM: f64 = 20.0;
const LEAST_DEG: f64 = 5.0;

/// A leader and a follower that starts later from run to run.
#[derive(Clone, Debug, Serialize)]
pub struct FollowerDelay {
    /// Of the object.
    pub velocity_m_s: f64,
    /// When eq. 42 has the zero moment point of a robot that stands still at its toes, from the start of the
    /// motion on.
    pub predicted_s: f64,
    /// The delay with which the paper's leader loses its balance.
    pub paper_falls_s: f64,
    /// Every run.
    pub runs: Vec<LateRun>,
}

/// One run.
#[derive(Clone, Debug, Serialize)]
pub struct LateRun {
    /// From when the follower notices that it is pulled to when it moves.
    pub delay_s: f64,
    /// Who is too fast.
    pub leader: LateRobot,
    /// Who is too late.
    pub follower: LateRobot,
    /// Whether the team came to a safe stop: what robots felt could not be believed any more.
    pub stops: bool,
}

/// What became of a robot.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LateRobot {
    /// Its smallest distance from the edge; negative outside of the feet that bear.
    pub zmp_margin_min_m: f64,
    /// When its zero moment point was first at the edge, from the start of the motion on.
    pub edge_s: Option<f64>,
    /// Its largest tilt.
    pub tilt_max_rad: f64,
    /// Whether it fell.
    pub fell: bool,
}

type Of = fn(&LateRun) -> &LateRobot;
const ROBOTS: [(&str, Of); 2] = [("leader", |run| &run.leader), ("follower", |run| &run.follower)];

impl FollowerDelay {
    fn sorted(&self) -> Vec<&LateRun> {
        let mut runs: Vec<_> = self.runs.iter().collect();
        runs.sort_by(|a, b| a.delay_s.total_cmp(&b.delay_s));
        runs
    }

    pub(super) fn findings(&self) -> Vec<String> {
        let runs = self.sorted();
        let mut findings: Vec<_> =
            ROBOTS.into_iter().map(|(name, of)| self.edge_finding(&runs, name, of)).collect();
        findings.push(self.paper_finding(&runs));
        if let Some(first) = runs.iter().find(|run| run.stops) {
            let delay_s = first.delay_s;
            findings.push(format!(
                "From a delay of {delay_s} s on the team comes to a safe stop before the end."
            ));
        }
        findings
    }

    /// From which delay on a robot is at its edge, and when against eq. 42.
    fn edge_finding(&self, runs: &[&LateRun], name: &str, of: Of) -> String {
        let is_at_edge = |run: &&&LateRun| of(run).edge_s.is_some();
        let Some(first) = runs.iter().find(is_at_edge) else {
            return format!("The {name}'s zero moment point never comes to the edge of its feet.");
        };
        let before = runs.iter().take_while(|run| run.delay_s < first.delay_s).last();
        let from = match before {
            Some(run) => format!(
                "keeps {:.0} mm from the edge of its feet up to a delay of {} s; from {} s on it gets there",
                1e3 * of(run).zmp_margin_min_m,
                run.delay_s,
                first.delay_s
            ),
            None => "gets to the edge of its feet with every delay".to_owned(),
        };
        let times = || runs.iter().filter_map(|run| of(run).edge_s);
        let (soonest, latest) = (times().fold(f64::INFINITY, f64::min), times().fold(0.0, f64::max));
        let (soonest, latest) = (format!("{soonest:.2}"), format!("{latest:.2}"));
        let times = if soonest == latest { soonest } else { format!("{soonest} to {latest}") };
        format!(
            "The {name}'s zero moment point {from}, {times} s after the start of the motion; \
             eq. 42 says {:.2} s for a robot that stands.",
            self.predicted_s
        )
    }

    /// Whether the leader falls where the paper's does.
    fn paper_finding(&self, runs: &[&LateRun]) -> String {
        let paper_s = self.paper_falls_s;
        let has_fallen = |run: &&&LateRun| run.leader.fell || run.follower.fell;
        let falls = match runs.iter().find(has_fallen) {
            Some(run) => {
                let who = if run.leader.fell { "the leader" } else { "the follower" };
                format!("here {who} first falls with {} s", run.delay_s)
            }
            None => match runs.last() {
                Some(last) => format!("here nobody falls with up to {} s", last.delay_s),
                None => "here nothing was run".to_owned(),
            },
        };
        let off = |run: &&&LateRun| (run.delay_s - paper_s).abs();
        let there = runs.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        let verdict = match there {
            Some(run) if run.leader.fell => "Simulation and paper agree",
            _ => "Simulation and paper disagree",
        };
        let tilt = there.map_or(String::new(), |run| {
            let LateRobot { tilt_max_rad, .. } = run.leader;
            format!("; with {} s the leader tilts by {:.1}°", run.delay_s, tilt_max_rad.to_degrees())
        });
        format!("{verdict}: the paper's leader loses its balance with a delay of {paper_s} s, {falls}{tilt}.")
    }

    pub(super) fn figure(&self) -> Figure {
        let runs = self.sorted();
        let mut legend: Vec<_> =
            ROBOTS.iter().zip(COLOURS).map(|((name, _), colour)| LegendEntry::patch(*name, colour)).collect();
        legend.push(LegendEntry::line("eq. 42, and the edge", equation_stroke()));
        legend.push(LegendEntry::line("the paper's leader falls", paper_stroke()));
        let caption = format!(
            "A leader and its follower at {} m/s, over the delay between the follower's noticing that it is \
             pulled and its moving. Above: smallest distance of the true zero moment point from the edge of the \
             feet that bear; no dot where a robot left the ground. Middle: when it first was within {:.0} mm of it, from the start of the motion on; no \
             dot where it never was. Below: largest tilt of the base, with falls by name.",
            self.velocity_m_s,
            1e3 * Figures::EDGE_M
        );
        let margins = self.panel(&runs, "smallest ZMP margin [mm]", Some(0.0), LEAST_MM, |robot| {
            (robot.zmp_margin_min_m > LEFT_GROUND_M).then_some(1e3 * robot.zmp_margin_min_m)
        });
        let times =
            self.panel(&runs, "time to the edge [s]", Some(self.predicted_s), 1.0, |robot| robot.edge_s);
        let tilts = self.panel(&runs, "largest tilt [°]", None, LEAST_DEG, |robot| {
            (!robot.fell).then_some(robot.tilt_max_rad.to_degrees())
        });
        Figure {
            title: "A follower that starts late".to_owned(),
            subtitle: super::runs(self.runs.len()),
            caption,
            legend,
            columns: 1,
            panels: vec![margins, times, with_falls(tilts, &runs)],
            panel_height_px: PANEL_HEIGHT_PX,
            has_equal_scales: false,
        }
    }

    fn panel(
        &self,
        runs: &[&LateRun],
        label: &str,
        level: Option<f64>,
        least: f64,
        value: impl Fn(&LateRobot) -> Option<f64>,
    ) -> Panel {
        let x = range_of(runs.iter().map(|run| run.delay_s).chain([0.0, self.paper_falls_s]), 1.0);
        let x = x.start..x.end + NAME_ROOM * (x.end - x.start);
        let mut marks = vec![Mark::Vertical { x: self.paper_falls_s, stroke: paper_stroke() }];
        if let Some(level) = level {
            marks.push(Mark::Path {
                points: vec![(x.start, level), (x.end, level)],
                stroke: equation_stroke(),
            });
        }
        let mut shown: Vec<f64> = level.into_iter().chain([0.0]).collect();
        for ((_, of), colour) in ROBOTS.into_iter().zip(COLOURS) {
            let points: Vec<_> =
                runs.iter().map(|run| (run.delay_s, value(of(run)).unwrap_or(f64::NAN))).collect();
            shown.extend(points.iter().map(|point| point.1));
            let dots = points.iter().filter(|point| point.1.is_finite());
            marks.extend(dots.map(|at| Mark::Dot { at: *at, colour }));
            marks.push(Mark::Path { points, stroke: Stroke::thin(colour) });
        }
        Panel {
            title: String::new(),
            note: String::new(),
            x: Axis { label: "the follower's delay [s]".to_owned(), range: x },
            y: Axis { label: label.to_owned(), range: range_of(shown, least) },
            marks,
        }
    }
}

/// Who has fallen has no figure: a name on the upper edge.
fn with_falls(mut panel: Panel, runs: &[&LateRun]) -> Panel {
    let height = panel.y.range.end - panel.y.range.start;
    for (row, ((name, of), colour)) in ROBOTS.into_iter().zip(COLOURS).enumerate() {
        let y = panel.y.range.end - height * (0.12 + 0.24 * row as f64);
        for run in runs.iter().filter(|run| of(run).fell) {
            panel.marks.push(Mark::Label { at: (run.delay_s, y), text: format!("{name} fell"), colour });
        }
    }
    panel
}

fn equation_stroke() -> Stroke {
    Stroke { is_dashed: true, ..Stroke::thin(style::INK) }
}

fn paper_stroke() -> Stroke {
    Stroke::solid(style::PALETTE[3])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn robot(margin_m: f64, edge_s: Option<f64>) -> LateRobot {
        LateRobot { zmp_margin_min_m: margin_m, edge_s, tilt_max_rad: 0.07, fell: false }
    }

    fn compared(runs: Vec<LateRun>) -> FollowerDelay {
        FollowerDelay { velocity_m_s: 0.1, predicted_s: 0.93, paper_falls_s: 1.3, runs }
    }

    fn late(delay_s: f64, edge_s: Option<f64>) -> LateRun {
        LateRun {
            delay_s,
            leader: robot(0.019, edge_s),
            follower: robot(0.003, Some(0.75)),
            stops: delay_s > 1.0,
        }
    }

    #[test]
    fn words_say_from_when_on_the_leader_is_at_its_edge_and_that_it_does_not_fall_as_in_the_paper() {
        let said = compared(vec![late(1.3, Some(0.89)), late(0.6, None), late(0.8, Some(0.88))]).findings();
        assert_eq!(
            said[0],
            "The leader's zero moment point keeps 19 mm from the edge of its feet up to a delay of 0.6 s; from \
             0.8 s on it gets there, 0.88 to 0.89 s after the start of the motion; eq. 42 says 0.93 s for a \
             robot that stands."
        );
        assert!(
            said[1].starts_with(
                "The follower's zero moment point gets to the edge of its feet with every delay"
            ),
            "{said:?}"
        );
        assert_eq!(
            said[2],
            "Simulation and paper disagree: the paper's leader loses its balance with a delay of 1.3 s, here nobody \
             falls with up to 1.3 s; with 1.3 s the leader tilts by 4.0°."
        );
        assert_eq!(said[3], "From a delay of 1.3 s on the team comes to a safe stop before the end.");
    }

    #[test]
    fn a_leader_that_falls_where_the_papers_does_agrees_with_it() {
        let mut run = late(1.3, Some(0.9));
        run.leader.fell = true;
        let comparison = compared(vec![late(0.5, None), run]);
        let said = comparison.findings();
        assert!(said[2].starts_with("Simulation and paper agree"), "{said:?}");
        assert!(said[2].contains("here the leader first falls with 1.3 s"), "{said:?}");
        let figure = comparison.figure();
        let labels = figure.panels.iter().flat_map(|panel| &panel.marks);
        let labels = labels.filter(|mark| matches!(mark, Mark::Label { text, .. } if text == "leader fell"));
        assert_eq!(labels.count(), 1);
    }
}
