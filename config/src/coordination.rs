//! Who decides where the hands go.

use serde::{Deserialize, Serialize};

/// How the team is coordinated: the paper's symmetry, or for comparison its leader-follower type (section
/// 4.1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Coordination {
    /// Which of both.
    pub policy: Policy,
    /// The robot that leads; the first one when absent.
    pub leader: Option<String>,
    /// Force at its hands that a follower notices.
    pub detection_n: f64,
    /// From noticing to moving.
    pub delay_s: f64,
    /// Whether followers move at all: without, the time to the edge of their feet can be told (eq. 42).
    pub followers_move: bool,
}

/// A way to coordinate a team.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// All robots move synchronously; the hybrid law controls object and internal forces.
    #[default]
    Symmetry,
    /// One robot moves the object; the others follow what they feel at their hands.
    LeaderFollower,
}

impl Default for Coordination {
    fn default() -> Self {
        Self { policy: Policy::Symmetry, leader: None, detection_n: 5.0, delay_s: 0.5, followers_move: true }
    }
}
