//! Robots that leave the team while it carries, and come back.

use serde::{Deserialize, Serialize};

/// A robot lets go and walks off, or walks up and takes hold, while the others carry. Of several entries for one robot each
/// is of a later time. A robot whose first entry has `join_s` alone begins away from the object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Membership {
    /// Which one.
    pub robot: String,
    /// When it is asked to leave.
    #[serde(default)]
    pub leave_s: Option<f64>,
    /// When it is asked to join; with `leave_s`, to come back.
    #[serde(default)]
    pub join_s: Option<f64>,
    /// How far it walks off, backwards from its place at the object.
    #[serde(default = "default_distance_m")]
    pub distance_m: f64,
    /// How fast.
    #[serde(default = "default_speed_m_s")]
    pub speed_m_s: f64,
    /// How far open hands are drawn back, along their palms, before it walks.
    #[serde(default = "default_draw_back_m")]
    pub draw_back_m: f64,
}

fn default_distance_m() -> f64 {
    0.5
}

fn default_speed_m_s() -> f64 {
    0.06
}

fn default_draw_back_m() -> f64 {
    0.05
}

impl Membership {
    /// Of this robot, neither to leave nor to join, with what is usual.
    pub fn of(robot: &str) -> Self {
        Self {
            robot: robot.to_owned(),
            leave_s: None,
            join_s: None,
            distance_m: default_distance_m(),
            speed_m_s: default_speed_m_s(),
            draw_back_m: default_draw_back_m(),
        }
    }

    /// No robot walks off farther.
    pub const MAX_DISTANCE_M: f64 = 5.0;
    /// No robot walks off faster: nobody but its own feet tells it to slow down.
    pub const MAX_SPEED_M_S: f64 = 0.15;
    /// No hand is drawn back farther.
    pub const MAX_DRAW_BACK_M: f64 = 0.15;

    /// Whether its robot begins away, if this is its first entry.
    pub fn begins_away(&self) -> bool {
        self.leave_s.is_none()
    }
}
