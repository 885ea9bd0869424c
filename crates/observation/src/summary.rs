//! `summary.json`: what others script against. Keys stay; more may follow. SI units.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A run's result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Summary {
    pub scenario: String,
    pub seed: u64,
    pub ticks: u64,
    /// The first tick that was seen: 0, unless the run was adopted. All figures are of what was seen.
    #[serde(default)]
    pub first_tick: u64,
    pub control_period_s: f64,
    pub sim_time_s: f64,
    pub wall_time_s: f64,
    pub real_time_factor: f64,
    pub passed: bool,
    /// Every threshold that was not met, in words.
    pub failures: Vec<String>,
    /// One hash over the payload of every frame of every service, in tick order.
    pub log_hash: String,
    /// Names of the robots that fell.
    pub fell: Vec<String>,
    /// The team's modes, one after the other.
    pub modes: Vec<ModeSummary>,
    pub object: ObjectSummary,
    pub internal: Vec<InternalSummary>,
    /// Largest difference between the internal forces that control saw and the true ones over the last
    /// second.
    pub internal_measurement_error_n: f64,
    pub internal_measurement_error_nm: f64,
    pub robots: Vec<RobotSummary>,
    /// How far the robots' own estimates have moved against each other, horizontally.
    pub drift_between_robots_m: f64,
    /// The run minute by minute.
    #[serde(default)]
    pub minutes: Vec<MinuteSummary>,
    /// Ticks in which something touched that nobody meant to.
    pub unintended_contact_ticks: u64,
    pub timing: Timing,
    pub faults: Vec<Fault>,
    pub swaps: Vec<Swap>,
    /// What is carried, as the team knew it last.
    #[serde(default)]
    pub load: LoadSummary,
    /// Robots that left the team or joined it, stage by stage; empty where nobody did.
    #[serde(default)]
    pub members: Vec<MemberSummary>,
}

/// A stage of a robot on its way out of the team or into it, or as a member between, and what was largest while it lasted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct MemberSummary {
    pub robot: String,
    pub stage: String,
    /// The first one.
    pub tick: u64,
    pub ticks: u64,
    /// The farthest that the reference of any hand of the team went in a tick.
    pub hand_step_max_m: f64,
    /// Norm of the row that has most, true and unfiltered, once what was there at the start has had its 3 s to go.
    pub internal_peak_n: f64,
    /// Of the object, from its reference.
    pub object_peak_m: f64,
    /// Why it did not go on as it was asked to.
    pub fault: Option<String>,
}

/// What is carried, in the object's axes, by hands' wrenches and motion; standard deviations beside. All zero where nobody
/// knows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct LoadSummary {
    pub mass_kg: f64,
    pub mass_std_kg: f64,
    /// Since when the mass has not changed by more than 3 %.
    pub mass_stays_since_s: f64,
    /// Centre of mass from the object's origin.
    pub com_m: [f64; 3],
    pub com_std_m: [f64; 3],
    /// About the centre of mass: xx, yy, zz, xy, xz, yz.
    pub inertia_kg_m2: [f64; 6],
    pub inertia_std_kg_m2: [f64; 6],
}

/// A mode of the team, and when it began.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct ModeSummary {
    pub mode: String,
    pub start_s: f64,
}

/// A minute of a run, or what there is of its last: largest errors and forces of any axis, row and robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct MinuteSummary {
    pub start_s: f64,
    pub object_rms_m: f64,
    pub object_peak_m: f64,
    /// Mean norm of the row that has most.
    pub internal_mean_n: f64,
    pub internal_peak_n: f64,
    pub zmp_margin_min_m: f64,
    /// How far apart the object would be by two robots' own odometries, at the end of the minute.
    pub odometry_apart_m: f64,
    pub odometry_apart_rad: f64,
    /// The same as the team sees it, which knows where each odometry has the world.
    pub frames_apart_m: f64,
    pub frames_apart_rad: f64,
}

/// How well Σa, as it was fixed to the object when the hybrid law started, kept to its reference from then
/// on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct ObjectSummary {
    pub position_rms_m: [f64; 3],
    pub position_peak_m: [f64; 3],
    pub attitude_rms_rad: [f64; 3],
    pub attitude_peak_rad: [f64; 3],
    /// True displacement over the whole run.
    pub travel_m: [f64; 3],
    /// True rotation over the whole run.
    pub travel_rad: [f64; 3],
    /// Where the object rests in the end against where the job was to set it down; none without a job.
    pub goal_error_m: Option<[f64; 3]>,
    pub goal_error_rad: Option<[f64; 3]>,
    /// Its largest speed over the last 0.2 s.
    pub speed_end_m_s: f64,
    /// Mean force of the world's fixed boxes on the object over the last 0.2 s, in world axes.
    pub support_force_end_n: [f64; 3],
    /// Where Σa, the frame that control created on the object when it started, lies in the object's body:
    /// what the hands could not know of how they grasped.
    pub frame_offset_m: [f64; 3],
}

/// One internal force: norms of its force and of its moment, true and unfiltered.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct InternalSummary {
    pub name: String,
    /// Largest once what was there at the start has had its 3 s to go.
    pub peak_n: f64,
    pub peak_nm: f64,
    /// When the hybrid law starts, or at tick 0 where it never does.
    pub start_n: f64,
    pub start_nm: f64,
    /// Largest from 3.0 to 3.2 s after the start.
    pub after_3s_n: f64,
    pub after_3s_nm: f64,
    /// Largest of the last 0.2 s of the run, or of the hybrid law where it ends before.
    pub end_n: f64,
    pub end_nm: f64,
    /// Mean wrench of the last 0.2 s in the object's axes.
    pub end_mean: [f64; 6],
    /// Largest distance from its reference once what was there at the start has had its 3 s to go.
    #[serde(default)]
    pub error_peak_n: f64,
    #[serde(default)]
    pub error_peak_nm: f64,
    /// The same of the last 0.2 s.
    #[serde(default)]
    pub error_end_n: f64,
    #[serde(default)]
    pub error_end_nm: f64,
}

/// One robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct RobotSummary {
    pub name: String,
    pub zmp_margin_min_m: f64,
    /// When its zero moment point first came within 5 mm of the edge.
    pub zmp_edge_s: Option<f64>,
    /// Largest horizontal displacement of a loaded sole since it was set down.
    pub foot_slip_max_m: f64,
    pub tilt_max_rad: f64,
    pub steps: u64,
    /// Length of its walk: half of what its feet have stepped.
    pub walked_m: f64,
    /// How far its own estimate of its base has moved against the truth, horizontally.
    pub drift_m: f64,
    /// The same per metre walked, of at least 0.1 m.
    pub drift_m_per_m: f64,
    pub joint_margin_min_rad: f64,
    /// The joint that came nearest to its limit.
    pub joint_margin_joint: String,
    pub saturated_ticks: u64,
    /// Largest torque that each drive asked for, before its limit.
    pub torque_peak_nm: BTreeMap<String, f64>,
    pub torque_limit_nm: BTreeMap<String, f64>,
}

/// How long ticks took; zero where no clock is read. In wall-clock time a tick is late that is more than a tenth of
/// a period longer, and held where the world moved on without a robot's command.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Timing {
    pub tick_p50_s: f64,
    pub tick_p99_s: f64,
    pub ticks_late: u64,
    pub ticks_held: u64,
    /// Frames that the recorder never saw.
    #[serde(default)]
    pub frames_lost: u64,
}

/// Something went wrong, and where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Fault {
    pub tick: u64,
    pub service: String,
    pub robot: Option<String>,
    pub code: String,
}

/// A process was replaced.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Swap {
    pub tick: u64,
    pub service: String,
    pub robot: Option<String>,
    pub cause: String,
    pub ticks_lost: u64,
}
