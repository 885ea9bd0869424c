//! The runs of a sweep beside what the paper predicts of them.

use super::run_folder::RunFolder;
use crate::failure::Failure;
use crate::pull::{Pull, pulls};
use mikoshi_config::scenario::{Policy, Scenario};
use mikoshi_config::sweep::Comparison;
use mikoshi_ipc_types::mode;
use mikoshi_report::{ComparedRuns, EdgeTime, FollowerDelay, LateRobot, LateRun, TimeToEdge};
use mikoshi_resolution::resolve;
use serde_json::Value;

/// What `comparison` asks for, of finished runs.
///
/// # Errors
/// A scenario without leader, follower or motion; a summary that can't be read.
pub fn compare(comparison: &Comparison, folders: &[RunFolder]) -> Result<ComparedRuns, Failure> {
    let runs = folders.iter().map(|folder| Run::of(folder).map_err(|failure| failure.context(&folder.label)));
    let runs = runs.collect::<Result<Vec<_>, _>>()?;
    Ok(match *comparison {
        Comparison::TimeToEdge { within } => {
            ComparedRuns::TimeToEdge(TimeToEdge { within, runs: runs.iter().map(Run::edge_time).collect() })
        }
        Comparison::FollowerDelay { paper_falls_s } => ComparedRuns::FollowerDelay(FollowerDelay {
            velocity_m_s: runs.first().map_or(f64::NAN, |run| run.pull.velocity_m_s),
            predicted_s: runs.first().map_or(f64::NAN, |run| run.predicted_s),
            paper_falls_s,
            runs: runs.iter().map(Run::late).collect(),
        }),
    })
}

/// A run of a leader and a follower.
struct Run {
    /// The follower, if it stood.
    pull: Pull,
    predicted_s: f64,
    delay_s: f64,
    leader: LateRobot,
    follower: LateRobot,
    stops: bool,
}

impl Run {
    fn of(folder: &RunFolder) -> Result<Self, Failure> {
        let spec = resolve(folder.loaded()).map_err(Failure::usage)?;
        let scenario = &spec.scenario;
        let (leader, follower) = leader_and_follower(scenario)
            .ok_or_else(|| Failure::usage("comparison: expected a scenario with a leader and a follower"))?;
        let pull = pulls(&spec)?.swap_remove(follower);
        let (Some(motion), Some(predicted_s)) = (&scenario.motion, pull.time_s) else {
            return Err(Failure::usage("comparison: expected a scenario whose object moves"));
        };
        let summary = folder.summary()?;
        let robot = |index: usize| late_robot(&summary, &scenario.robots[index].name, motion.start_s);
        Ok(Self {
            predicted_s,
            delay_s: scenario.coordination.delay_s,
            leader: robot(leader),
            follower: robot(follower),
            stops: summary["modes"].as_array().is_some_and(|modes| modes.iter().any(is_safe_stop)),
            pull,
        })
    }

    fn edge_time(&self) -> EdgeTime {
        EdgeTime {
            velocity_m_s: self.pull.velocity_m_s,
            stiffness_n_m: self.pull.stiffness_n_m,
            predicted_s: self.predicted_s,
            measured_s: self.follower.edge_s,
        }
    }

    fn late(&self) -> LateRun {
        LateRun { delay_s: self.delay_s, leader: self.leader, follower: self.follower, stops: self.stops }
    }
}

/// The leader's index, and that of the first one who follows it.
fn leader_and_follower(scenario: &Scenario) -> Option<(usize, usize)> {
    let coordination = &scenario.coordination;
    let mut names = scenario.robots.iter().map(|robot| &robot.name);
    let leader =
        coordination.leader.as_ref().map_or(Some(0), |leader| names.position(|name| name == leader))?;
    let follower = (0..scenario.robots.len()).find(|index| *index != leader)?;
    (coordination.policy == Policy::LeaderFollower).then_some((leader, follower))
}

fn is_safe_stop(entry: &Value) -> bool {
    entry["mode"] == mode::name(mode::SAFE_STOP)
}

/// What a summary says of a robot; times count from `start_s`.
fn late_robot(summary: &Value, name: &str, start_s: f64) -> LateRobot {
    let of_name = |robot: &&Value| robot["name"] == name;
    let robot =
        summary["robots"].as_array().and_then(|robots| robots.iter().find(of_name)).unwrap_or(&Value::Null);
    let number = |key: &str| robot[key].as_f64();
    LateRobot {
        zmp_margin_min_m: number("zmp_margin_min_m").unwrap_or(f64::NAN),
        edge_s: number("zmp_edge_s").map(|edge_s| edge_s - start_s),
        tilt_max_rad: number("tilt_max_rad").unwrap_or(f64::NAN),
        fell: summary["fell"].as_array().is_some_and(|fell| fell.iter().any(|fallen| fallen == name)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn times_count_from_the_start_of_the_motion_and_who_never_was_at_the_edge_has_none() {
        let summary = json!({
            "fell": ["B"],
            "robots": [
                { "name": "A", "zmp_margin_min_m": 0.02, "zmp_edge_s": null, "tilt_max_rad": 0.01 },
                { "name": "B", "zmp_margin_min_m": null, "zmp_edge_s": 2.75, "tilt_max_rad": 1.5 },
            ],
        });
        let (a, b) = (late_robot(&summary, "A", 2.0), late_robot(&summary, "B", 2.0));
        assert_eq!((a.edge_s, a.fell, a.zmp_margin_min_m), (None, false, 0.02));
        assert_eq!((b.edge_s, b.fell), (Some(0.75), true));
        assert!(b.zmp_margin_min_m.is_nan());
    }
}
