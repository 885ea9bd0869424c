//! What stands in the world beside the floor, the robots and their object.

use serde::{Deserialize, Serialize};

/// Fixed surroundings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct World {
    /// Boxes. The object may touch them; robots may not.
    pub boxes: Vec<FixedBox>,
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
