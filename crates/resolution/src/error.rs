//! Why a scenario can't be run.

use mikoshi_config::LoadConfigError;
use mikoshi_humanoid::ik::SettlePostureError;

/// A scenario that is well written and yet can't be run.
#[derive(Debug, thiserror::Error)]
pub enum ResolveRunError {
    /// A key names what a robot lacks, or a robot's description can't be used.
    #[error(transparent)]
    Config(#[from] LoadConfigError),
    /// A palm has nothing to hold where it is.
    #[error(
        "unreachable grasp: the {hand} palm of robot {robot} is {:.0} mm {} the object's surface, expected at most {:.0} mm",
        distance_m.abs() * 1e3,
        if *distance_m < 0.0 { "inside" } else { "off" },
        limit_m * 1e3
    )]
    PalmOffSurface {
        /// The robot's name.
        robot: String,
        /// The hand's name.
        hand: String,
        /// Distance from the surface, negative inside.
        distance_m: f64,
        /// How large it may be.
        limit_m: f64,
    },
    /// A hand doesn't come to its grasp.
    #[error("unreachable grasp: the {hand} hand of robot {robot}: {source}")]
    HandOutOfReach {
        /// The robot's name.
        robot: String,
        /// The hand's name.
        hand: String,
        /// By how much, and what is in its way.
        source: SettlePostureError,
    },
    /// A robot can't stand as its configuration says.
    #[error("robot {robot} can't stand as it should: {source}")]
    NoStance {
        /// The robot's name.
        robot: String,
        /// By how much, and what is in its way.
        source: SettlePostureError,
    },
}
