//! What is published: one payload, of one robot or of the team.

use core::fmt;
use mikoshi_ipc_types::Payload;

/// The name under which frames meet: a payload's name and the robot it is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Topic {
    /// [`Payload::NAME`].
    pub payload: &'static str,
    /// Index of the robot in its team; 0 for payloads of the team.
    pub robot: usize,
}

impl Topic {
    /// The topic of `P` for this robot.
    pub const fn of<P: Payload>(robot: usize) -> Self {
        Self { payload: P::NAME, robot }
    }
}

impl fmt::Display for Topic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}[{}]", self.payload, self.robot)
    }
}
