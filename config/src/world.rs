//! What stands in the world beside the floor, the robots and their object, and what goes wrong in it.

use serde::{Deserialize, Serialize};

/// Fixed surroundings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct World {
    /// Boxes. The object may touch them; robots may not.
    pub boxes: Vec<FixedBox>,
    /// Hands that lose the object.
    pub grasp_failures: Vec<GraspFailure>,
}

/// A hand loses its grip, for good.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GraspFailure {
    /// Whose hand.
    pub robot: String,
    /// Its name in the robot's configuration.
    pub hand: String,
    /// When.
    pub at_s: f64,
    /// How.
    pub kind: GraspFailureKind,
    /// What a hand that slips still passes on.
    #[serde(default = "default_friction_n")]
    pub friction_n: f64,
    /// Whether the gripper notices; one that does not goes on to say that it holds.
    #[serde(default)]
    pub is_noticed: bool,
}

/// How a hand loses its grip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GraspFailureKind {
    /// Nothing is left between palm and object.
    Open,
    /// The palm slides and turns on the object against a limited friction.
    Slip,
}

fn default_friction_n() -> f64 {
    2.0
}

impl GraspFailure {
    /// A palm that slides as fast as this feels all of its friction; a slower one less, in proportion.
    pub const SLIDING_M_S: f64 = 0.01;
    /// The same of a palm that turns.
    pub const TURNING_RAD_S: f64 = 0.1;
    /// At which radius friction holds against turning.
    pub const PATCH_M: f64 = 0.03;

    /// Damping · step / mass of a slipping hand on this object: an explicit damper oscillates from 1 on.
    pub fn damping_ratio(&self, step_s: f64, mass_kg: f64) -> f64 {
        self.friction_n / Self::SLIDING_M_S * step_s / mass_kg
    }
}

/// A box that nothing moves: a wall to press against, a pedestal to rest on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FixedBox {
    /// Name, unique in the world.
    pub name: String,
    /// Centre in the world.
    pub position_m: [f64; 3],
    /// Full edge lengths.
    pub size_m: [f64; 3],
    /// Heading.
    #[serde(default)]
    pub yaw_deg: f64,
    /// Sliding friction against it, whatever the object's; `physics.friction` when absent.
    #[serde(default)]
    pub friction: Option<f64>,
}
