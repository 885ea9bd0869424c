//! Where everything truly was in a tick, and those ticks of a log that are to be seen.

use mikoshi_ipc_types::MAX_JOINTS;
use mikoshi_observation::{LogReader, Observation, ReadLogError};

/// Where everything truly was in a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// When the tick began.
    pub time_s: f64,
    pub(crate) object: [f64; 7],
    pub(crate) robots: Vec<RobotSnapshot>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RobotSnapshot {
    pub base: [f64; 7],
    pub joints_rad: [f64; MAX_JOINTS],
}

impl Snapshot {
    /// Of a tick.
    pub fn of(observation: &Observation, period_s: f64) -> Self {
        let robots = observation.robot_truth.iter().map(|truth| RobotSnapshot {
            base: truth.payload.base_pose,
            joints_rad: truth.payload.joint_position_rad,
        });
        Self {
            time_s: observation.tick() as f64 * period_s,
            object: observation.object_truth.payload.pose,
            robots: robots.collect(),
        }
    }
}

/// What a log shows from one time to another, `hz` times a second of the run; every time the first tick that is not
/// earlier.
///
/// # Errors
/// The log can't be read. Where it is cut or damaged it ends.
pub fn course(log: &mut LogReader, from_s: f64, to_s: f64, hz: f64) -> Result<Vec<Snapshot>, ReadLogError> {
    let period_s = log.run().scenario.control_period_s;
    let mut observation = Observation::for_team(log.run().robots.len());
    let mut course: Vec<Snapshot> = vec![];
    // Ticks are counted in whole periods: half of one is no lateness.
    let slack_s = 0.5 * period_s;
    while log.read_tick(&mut observation)? {
        let time_s = observation.tick() as f64 * period_s;
        if time_s > to_s + slack_s {
            break;
        }
        if time_s + slack_s >= from_s + course.len() as f64 / hz {
            course.push(Snapshot::of(&observation, period_s));
        }
    }
    Ok(course)
}
