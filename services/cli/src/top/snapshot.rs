//! What there is to tell of a run at one moment: the schema of `mikoshi top --once --json`.

use super::window::{PhaseTimes, RobotMoment};
use crate::commands::status::ProcessStatus;
use mikoshi_ipc_types::{RobotState, TeamState, all_hands, flag, member_stage, mode, stop_cause};
use mikoshi_observation::{Observation, ObservedRobot, ObservedRun};
use mikoshi_spatial::{Object, Pose, World};
use nalgebra::Vector3;
use serde::Serialize;

/// A run at one moment.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct Snapshot {
    pub run: String,
    pub scenario: String,
    pub seed: u64,
    /// `lockstep`, or `wall` where ticks are paced by the clock.
    pub clock: &'static str,
    pub tick: u64,
    pub ticks: u64,
    pub time_s: f64,
    pub rate_hz: f64,
    pub real_time_factor: f64,
    /// Ticks that this observer was too slow for.
    pub ticks_unseen: u64,
    pub team: Option<Team>,
    pub processes: Vec<ProcessRow>,
    pub robots: Vec<RobotRow>,
    /// What happened while it was watched, the newest first.
    pub events: Vec<Happening>,
}

/// The team as the coordinator sees it.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct Team {
    pub mode: &'static str,
    pub stop_cause: Option<&'static str>,
    pub stop_robot: Option<String>,
    pub speed_share: f64,
    pub internal_force_max_n: f64,
    pub internal_force_max_row: Option<String>,
    pub internal_moment_max_nm: f64,
    pub internal_moment_max_row: Option<String>,
    pub object_position_error_m: f64,
    pub object_attitude_error_rad: f64,
    pub hands_absent: u32,
}

/// A process: what `mikoshi status` says, and how it works.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct ProcessRow {
    #[serde(flatten)]
    pub status: ProcessStatus,
    pub rate_hz: f64,
    /// In the last second.
    pub phases: Vec<PhaseTimes>,
    /// Results that came too late to be used, since watching began.
    pub missed: u64,
    /// Of one core.
    pub cpu_share: Option<f64>,
    /// How often somebody else has taken its place.
    pub swaps: u64,
}

/// A robot as its own sensors tell; margins, tilt and torque are the worst of the last second.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct RobotRow {
    pub name: String,
    /// As the robot was told.
    pub mode: &'static str,
    /// `member`, or how far it is on its way out of the team or into it.
    pub member: &'static str,
    pub zmp_margin_m: f64,
    pub capture_point_margin_m: f64,
    pub tilt_rad: f64,
    pub torque_share: f64,
    pub torque_joint: String,
    pub steps: u64,
    pub hands: usize,
    pub hands_holding: u32,
    pub flags: Vec<&'static str>,
}

/// Something that happened.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct Happening {
    pub tick: u64,
    pub what: String,
}

const FLAGS: [(u64, &str); 6] = [
    (flag::JOINT_LIMIT, "joint-limit"),
    (flag::VELOCITY_LIMIT, "velocity-limit"),
    (flag::TORQUE_LIMIT, "torque-limit"),
    (flag::HANDS_BEHIND, "hands-behind"),
    (flag::INPUT_REJECTED, "input-rejected"),
    (flag::INPUT_MISSING, "input-missing"),
];

impl Team {
    /// By what the coordinator said in a tick.
    pub fn of(state: &TeamState, observed: &ObservedRun) -> Self {
        // The first row is the external force.
        let rows = || observed.internal_rows.iter().zip(&state.generalized_force[1..]);
        let largest = |norm: fn(&[f64; 6]) -> f64| {
            let norms = rows().map(|((name, _), wrench)| (norm(wrench), Some(name.clone())));
            norms.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default()
        };
        let (internal_force_max_n, internal_force_max_row) =
            largest(|[x, y, z, ..]| Vector3::new(*x, *y, *z).norm());
        let (internal_moment_max_nm, internal_moment_max_row) =
            largest(|[.., x, y, z]| Vector3::new(*x, *y, *z).norm());
        let pose = |array| Pose::<World, Object>::from_array(array);
        let error = match (pose(&state.object_pose_ref), pose(&state.object_pose)) {
            (Some(wanted), Some(measured)) => wanted.displacement_to(&measured),
            _ => Default::default(),
        };
        let stop_robot =
            state.stop_robot.checked_sub(1).and_then(|robot| observed.robots.get(robot as usize));
        Self {
            mode: mode::name(state.team_mode),
            stop_cause: (state.stop_cause != 0).then(|| stop_cause::name(state.stop_cause)),
            stop_robot: stop_robot.map(|robot| robot.name.clone()),
            speed_share: state.speed_share,
            internal_force_max_n,
            internal_force_max_row,
            internal_moment_max_nm,
            internal_moment_max_row,
            object_position_error_m: error.linear.norm(),
            object_attitude_error_rad: error.angular.norm(),
            hands_absent: state.absent_hands.count_ones(),
        }
    }
}

impl RobotRow {
    /// By what a robot and the coordinator said in a tick, and what was worst before.
    pub fn of(robot: &ObservedRobot, index: usize, observation: &Observation, worst: &RobotMoment) -> Self {
        let state: &RobotState = &observation.robot_state[index].payload;
        let set = |(bit, name): (u64, &'static str)| (state.flags & bit != 0).then_some(name);
        let joint = robot.joints.get(worst.torque_joint);
        Self {
            name: robot.name.clone(),
            mode: mode::name(observation.team_command[index].payload.team_mode),
            member: member_stage::name(observation.team_state.payload.member_stage[index]),
            zmp_margin_m: worst.zmp_margin_m,
            capture_point_margin_m: worst.capture_point_margin_m,
            tilt_rad: worst.tilt_rad,
            torque_share: worst.torque_share,
            torque_joint: joint.map_or_else(String::new, |joint| joint.name.clone()),
            steps: state.steps,
            hands: robot.hands,
            hands_holding: (state.holding_hands & all_hands(robot.hands)).count_ones(),
            flags: FLAGS.into_iter().filter_map(set).collect(),
        }
    }
}
