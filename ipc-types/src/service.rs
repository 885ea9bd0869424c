//! Who takes part in a tick.

use core::fmt;

/// A participant of the tick. Observers have no identity here: nothing waits for them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ServiceId {
    /// The physical world.
    Bridge,
    /// The controller of the robot with this index in the team.
    Servo(usize),
    /// The controller of the team.
    Coordinator,
}

impl ServiceId {
    /// The services of a team of `robots` robots, in canonical order.
    pub fn of_team(robots: usize) -> impl Iterator<Item = Self> {
        core::iter::once(Self::Bridge)
            .chain((0..robots).map(Self::Servo))
            .chain(core::iter::once(Self::Coordinator))
    }

    /// The robot this service controls, if it controls one.
    pub fn robot(self) -> Option<usize> {
        match self {
            Self::Servo(robot) => Some(robot),
            Self::Bridge | Self::Coordinator => None,
        }
    }
}

impl fmt::Display for ServiceId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bridge => f.write_str("bridge"),
            Self::Servo(robot) => write!(f, "servo-{robot}"),
            Self::Coordinator => f.write_str("coordinator"),
        }
    }
}
