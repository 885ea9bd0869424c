//! A resolved run: everything that its services need, in one file, written once and read by all.

use crate::robot::RobotConfig;
use crate::scenario::{Member, Scenario};
use serde::{Deserialize, Serialize};

/// A scenario after all files are read, all overrides applied and all grasps found reachable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunSpec {
    /// The scenario, seed included.
    pub scenario: Scenario,
    /// The robots, in the order of their indices.
    pub robots: Vec<RobotSpec>,
    /// Number of ticks.
    pub ticks: u64,
}

/// One robot of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotSpec {
    /// Its place in the team.
    pub member: Member,
    /// Its model.
    pub config: RobotConfig,
    /// The text of its URDF.
    pub urdf: String,
    /// Posture at tick 0, in the order of the model's joints.
    pub initial_posture_rad: Vec<f64>,
    /// Root link in the world at tick 0: `[x, y, z, qw, qx, qy, qz]`.
    pub initial_base_pose: [f64; 7],
    /// Indices into `config.hands` of the hands that grasp, in order.
    pub grasping_hands: Vec<usize>,
    /// Grasping hands in the object at tick 0, in the same order.
    pub hand_in_object: Vec<[f64; 7]>,
}
