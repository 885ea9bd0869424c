//! What an operator may ask of the team while it carries, and what a scenario's own operator says.

use crate::scenario::Axis;
use serde::{Deserialize, Serialize};

/// The operator's part in a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Operator {
    /// How whoever drives may move the object. With it nothing else moves it, and a job waits for words.
    pub drive: Option<DriveLimits>,
    /// What is said, and when, whoever else speaks.
    pub script: Vec<OperatorEvent>,
}

/// Bounds that the coordinator keeps, whatever it is told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DriveLimits {
    /// The object is at rest so long after the last message of whoever drives. Silence is bridged for as much of it
    /// as braking leaves.
    pub timeout_s: f64,
    /// Horizontally.
    pub velocity_max_m_s: f64,
    /// Up and down.
    pub vertical_max_m_s: f64,
    /// About the vertical.
    pub yaw_rate_max_rad_s: f64,
    /// About axes that lie in the plane.
    pub tilt_rate_max_rad_s: f64,
    /// Largest gain of velocity.
    pub acceleration_m_s2: f64,
    /// The same of angular velocity.
    pub angular_acceleration_rad_s2: f64,
    /// Largest loss of velocity.
    pub braking_m_s2: f64,
    /// The same of angular velocity.
    pub angular_braking_rad_s2: f64,
    /// How far from where driving began, horizontally; as far as one likes when absent.
    pub range_m: Option<f64>,
    /// How far above and below where driving began.
    pub height_m: f64,
    /// How far the object may lean from upright.
    pub tilt_rad: f64,
    /// What pressing harder means; nobody can when absent.
    pub squeeze: Option<Squeeze>,
}

impl Default for DriveLimits {
    fn default() -> Self {
        Self {
            timeout_s: 0.5,
            velocity_max_m_s: 0.06,
            vertical_max_m_s: 0.01,
            yaw_rate_max_rad_s: 0.05,
            tilt_rate_max_rad_s: 0.01,
            acceleration_m_s2: 0.05,
            angular_acceleration_rad_s2: 0.05,
            braking_m_s2: 0.25,
            angular_braking_rad_s2: 0.25,
            range_m: None,
            height_m: 0.02,
            tilt_rad: 0.03,
            squeeze: None,
        }
    }
}

impl DriveLimits {
    /// How long it takes to come to rest from the largest velocities.
    pub fn braking_s(&self) -> f64 {
        let linear = self.velocity_max_m_s.hypot(self.vertical_max_m_s) / self.braking_m_s2;
        let angular = self.yaw_rate_max_rad_s.hypot(self.tilt_rate_max_rad_s) / self.angular_braking_rad_s2;
        linear.max(angular)
    }

    /// How long whoever drives may say nothing before the object begins to brake.
    pub fn silence_s(&self) -> f64 {
        self.timeout_s - self.braking_s()
    }
}

/// An internal force that whoever drives may raise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Squeeze {
    /// Its row, as `mikoshi plan` prints it.
    pub row: String,
    /// Along which of its axes.
    pub axis: Axis,
    /// By how much at most \[N\].
    pub max_n: f64,
    /// How fast \[N/s\].
    #[serde(default = "default_rate_n_s")]
    pub rate_n_s: f64,
}

fn default_rate_n_s() -> f64 {
    10.0
}

/// The operator says something.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OperatorEvent {
    /// When.
    pub at_s: f64,
    /// What.
    pub says: OperatorWord,
    /// Of the object's origin in its heading: ahead, left, up. For `drive`.
    #[serde(default)]
    pub velocity_m_s: [f64; 3],
    /// The same about these axes.
    #[serde(default)]
    pub angular_velocity_rad_s: [f64; 3],
    /// How much harder hands shall press.
    #[serde(default)]
    pub squeeze_n: f64,
}

/// What an operator can say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OperatorWord {
    /// Stop the team.
    Stop,
    /// Go on after a safe stop.
    Resume,
    /// Approach the object, and grasp it.
    Grasp,
    /// Lift it.
    Lift,
    /// Set it down.
    Lower,
    /// Let it go.
    Release,
    /// Move so, and say so again in every tick.
    Drive,
    /// Nothing any more, until the next `drive`: as if whoever drives had been killed.
    Silence,
}
