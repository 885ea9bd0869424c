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
    /// Forces from outside.
    pub pushes: Vec<PushEvent>,
    /// What is put into the object, or taken out of it.
    pub load_changes: Vec<LoadChange>,
    /// What lies on the floor, unknown to control; a flat floor when absent.
    pub ground: Option<Ground>,
}

/// The object's mass changes, at once and for good.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadChange {
    /// When.
    pub at_s: f64,
    /// By how much: less than nothing where something is taken out.
    pub mass_kg: f64,
    /// Where in the object it lies, as a point.
    #[serde(default)]
    pub position_m: [f64; 3],
}

/// Ground that control is not told of: boards on the floor and patches of it, where the seed has them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ground {
    /// Highest edge of a board over the floor.
    pub step_m: f64,
    /// Steepest board.
    pub slope_deg: f64,
    /// Sliding friction on patches; none when absent.
    pub patch_friction: Option<f64>,
    /// How soft patches are: time constant of their contact, 0.02 for the floor.
    pub patch_contact_s: f64,
}

impl Default for Ground {
    fn default() -> Self {
        Self { step_m: 0.0, slope_deg: 0.0, patch_friction: None, patch_contact_s: 0.02 }
    }
}

impl Ground {
    /// Highest step.
    pub const MAX_STEP_M: f64 = 0.05;
    /// Steepest slope.
    pub const MAX_SLOPE_DEG: f64 = 10.0;

    /// Whether there are patches only.
    pub fn is_flat(&self) -> bool {
        self.step_m == 0.0 && self.slope_deg == 0.0
    }
}

/// Something pushes the object or a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PushEvent {
    /// When it begins.
    pub at_s: f64,
    /// For how long.
    pub for_s: f64,
    /// A robot's name, at its base, or `object`.
    pub on: String,
    /// At the body's centre of mass, in the world.
    pub force_n: [f64; 3],
    /// By how much that is turned about the vertical.
    #[serde(default)]
    pub heading_deg: f64,
}

impl PushEvent {
    /// What pushes the object pushes this.
    pub const OBJECT: &str = "object";
    /// Longest push.
    pub const MAX_S: f64 = 10.0;

    /// What pushes, turned to its heading.
    pub fn turned_force_n(&self) -> [f64; 3] {
        let [x, y, z] = self.force_n;
        let (sin, cos) = self.heading_deg.to_radians().sin_cos();
        [x * cos - y * sin, x * sin + y * cos, z]
    }
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
