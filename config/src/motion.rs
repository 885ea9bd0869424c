//! How the object is asked to move.

use serde::{Deserialize, Serialize};

/// The object's reference velocity (section 4.4): a sequence of segments, given or drawn by seed. Its
/// integral is the reference pose. Changes are smoothed by the limits of acceleration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// When the object is first asked to move; in a job, after it has been lifted.
    pub start_s: f64,
    /// Largest change of its velocity.
    #[serde(default = "default_acceleration_m_s2")]
    pub acceleration_m_s2: f64,
    /// The same for its angular velocity.
    #[serde(default = "default_angular_acceleration_rad_s2")]
    pub angular_acceleration_rad_s2: f64,
    /// One after the other; afterwards the object rests.
    #[serde(default)]
    pub segments: Vec<Segment>,
    /// Segments drawn by seed, after the given ones.
    #[serde(default)]
    pub random: Option<RandomMotion>,
}

fn default_acceleration_m_s2() -> f64 {
    0.05
}

fn default_angular_acceleration_rad_s2() -> f64 {
    0.05
}

/// A velocity that is asked for during some time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// How long.
    pub duration_s: f64,
    /// Velocity of the object's origin, in world axes.
    #[serde(default)]
    pub velocity_m_s: [f64; 3],
    /// Angular velocity, in world axes.
    #[serde(default)]
    pub angular_velocity_rad_s: [f64; 3],
}

/// Velocities in all six axes that change at random, by seed, about those that cover a given way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomMotion {
    /// For how long.
    pub duration_s: f64,
    /// After how long the velocity changes.
    pub change_s: f64,
    /// How far the object is from its start in the end, to one side or the other by seed.
    #[serde(default)]
    pub travel_m: [f64; 3],
    /// How far it has turned then, axis by axis, one way or the other by seed.
    #[serde(default)]
    pub travel_rad: [f64; 3],
    /// Largest departure from the velocity that covers the way, axis by axis.
    #[serde(default)]
    pub deviation_m_s: [f64; 3],
    /// The same of the angular velocity.
    #[serde(default)]
    pub deviation_rad_s: [f64; 3],
}

impl Motion {
    /// The reference velocity changes for the last time.
    pub fn end_s(&self) -> f64 {
        let given: f64 = self.segments.iter().map(|segment| segment.duration_s).sum();
        self.start_s + given + self.random.map_or(0.0, |random| random.duration_s)
    }
}
