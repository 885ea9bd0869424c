//! Why a world cannot be built, and why a step of it cannot be trusted.

use mikoshi_robot::MatchRobotError;
use thiserror::Error;

/// A run that no physical world can be built from.
#[derive(Debug, Error)]
pub enum BuildWorldError {
    /// A robot's description cannot be used, or its configuration names what it lacks.
    #[error("robot '{robot}': {source}")]
    Robot {
        /// The robot.
        robot: String,
        /// What does not fit.
        source: MatchRobotError,
    },
    /// No drive is configured for a joint.
    #[error("robot '{robot}': no pattern of [[drives]] matches joint '{joint}'")]
    NoDrive {
        /// The robot.
        robot: String,
        /// The joint.
        joint: String,
    },
    /// One force sensor carries another, so what each of them carries is not defined.
    #[error(
        "robot '{robot}': sensor '{outer}' carries sensor '{inner}'; expected one sensor per hand or foot"
    )]
    NestedSensors {
        /// The robot.
        robot: String,
        /// The sensor nearer to the trunk.
        outer: String,
        /// The other.
        inner: String,
    },
    /// The run contradicts itself.
    #[error("{place}: {what}")]
    Inconsistent {
        /// Robot or section.
        place: String,
        /// What was found, and what was expected.
        what: String,
    },
    /// The simulator's own objection.
    #[error("{engine} rejects the world: {what}")]
    Simulator {
        /// The simulator.
        engine: &'static str,
        /// Its words.
        what: String,
    },
}

/// A step that could not be made, or whose result is not physics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("{}", self.text())]
pub enum StepWorldError {
    /// There is not one command for each robot.
    CommandCount,
    /// A command is NaN or infinite.
    NotFinite,
    /// A position, velocity or acceleration became NaN, infinite or enormous.
    Diverged,
    /// The simulator had no room for all contacts or constraints, and left some out.
    OutOfMemory,
}

impl StepWorldError {
    /// In words that a tick can pass on: without allocation.
    pub fn text(self) -> &'static str {
        match self {
            Self::CommandCount => "the number of joint commands is not the number of robots",
            Self::NotFinite => "a joint command is not finite",
            Self::Diverged => "the simulated world diverged",
            Self::OutOfMemory => "the simulator ran out of memory for contacts",
        }
    }
}

/// A checkpoint that does not belong to this world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the checkpoint has {found} bytes, this world needs {expected}")]
pub struct LoadWorldError {
    /// Bytes that were given.
    pub found: usize,
    /// Bytes that are needed.
    pub expected: usize,
}
