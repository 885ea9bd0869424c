//! The whole job: from open hands to an object that rests elsewhere.

use serde::{Deserialize, Serialize};

/// Approach, grasp, lift, carry, lower, release (the paper's first step, and its reverse at the end). Without
/// a job hands hold the object from tick 0 on, and never let it go.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Job {
    /// When the hands begin to approach.
    pub start_s: f64,
    /// How far open hands are drawn back, along their palms, from where they hold.
    pub draw_back_m: f64,
    /// How long they take from there to where they hold, and back in the end.
    #[serde(default = "default_approach_s")]
    pub approach_s: f64,
    /// How long they take to close firmly.
    #[serde(default = "default_grasp_s")]
    pub grasp_s: f64,
    /// How long the hybrid law works on the object at rest, so that what the grasps strain goes away, before
    /// it is lifted.
    #[serde(default = "default_settle_s")]
    pub settle_s: f64,
    /// How high the object is lifted, and lowered in the end.
    pub lift_m: f64,
    /// How long it takes to lift it, and to lower it.
    #[serde(default = "default_lift_s")]
    pub lift_s: f64,
    /// The last part of the way down is crept, since nobody knows to the millimetre where the support is.
    #[serde(default = "default_creep_m")]
    pub creep_m: f64,
    /// How fast.
    #[serde(default = "default_creep_m_s")]
    pub creep_m_s: f64,
    /// How long hands take to leave the object to its new support before they open.
    #[serde(default = "default_unload_s")]
    pub unload_s: f64,
    /// How much longer than planned anything may take before the team stops: hands that don't come, don't
    /// close or don't open, a support that bears nothing.
    #[serde(default = "default_time_limit_s")]
    pub time_limit_s: f64,
}

fn default_approach_s() -> f64 {
    2.0
}

fn default_grasp_s() -> f64 {
    0.5
}

fn default_settle_s() -> f64 {
    3.0
}

fn default_lift_s() -> f64 {
    3.0
}

fn default_creep_m() -> f64 {
    0.004
}

fn default_creep_m_s() -> f64 {
    0.002
}

fn default_unload_s() -> f64 {
    3.0
}

fn default_time_limit_s() -> f64 {
    5.0
}

impl Job {
    /// How long all of it takes but the carrying, if nobody waits for anything.
    pub fn shortest_s(&self) -> f64 {
        self.start_s
            + 2.0 * self.approach_s
            + self.grasp_s
            + self.settle_s
            + 2.0 * self.lift_s
            + self.creep_m / self.creep_m_s
            + self.unload_s
    }
}
