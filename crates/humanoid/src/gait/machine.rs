//! The state machine of one robot's gait, driven by the team's step clock.
//!
//! ```text
//!                 step 0                     tick = lift-off
//!   Standing ───────────────▶ ShiftingWeight ───────────────▶ SingleSupport ◀─┐
//!      ▲                            │                           │    │        │ tick = lift-off,
//!      │ clock stands,              │ walk given up             │    │ step   │ landed
//!      │ landed                     ▼                           │    │ n + 1  │
//!   Finishing ◀─────────────────────┴───────── last step ───────┘    ▼        │
//!      ▲                                                         DoubleSupport┘
//!      └──────────────────────── walk given up ──────────────────────┘
//! ```
//!
//! The robot never runs ahead of the clock, and where the clock asks for what it can't do it stays on
//! the feet it has: a foot that has not landed is lowered further in `DoubleSupport` and `Finishing`
//! (`landing`), and nothing is lifted before, nor long after its lift-off.

use super::ground_pose::GroundPose;
use super::step_clock::{StepClock, StepTiming};
use super::swing::{Foothold, Swing, SwingConfig, SwingContact};
use crate::balance::{PerFoot, Side};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// The step that comes next; until lift-off it follows the moving references.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedStep {
    /// Index in the walk.
    pub index: u64,
    /// Which of the robot's own feet swings.
    pub side: Side,
    /// Where it shall land.
    pub to: GroundPose,
}

/// A foot that is in the air or has just left it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SwingingFoot {
    /// Which one.
    pub side: Side,
    /// Its way.
    pub swing: Swing,
}

/// What the robot's legs do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum GaitPhase {
    /// On both feet.
    Standing {
        /// Where the zero moment point's reference rests \[m, world\].
        zmp: Vector2<f64>,
    },
    /// On both feet, weight going to the first stance foot.
    ShiftingWeight {
        /// Where the reference of the zero moment point came from.
        zmp_from: Vector2<f64>,
        /// The first step.
        step: PlannedStep,
    },
    /// One foot swings.
    SingleSupport {
        /// Index of the step in the walk.
        index: u64,
        /// The swinging foot.
        foot: SwingingFoot,
    },
    /// Weight goes from the old stance foot to the one that has landed.
    DoubleSupport {
        /// Where the reference of the zero moment point came from.
        zmp_from: Vector2<f64>,
        /// The next step.
        step: PlannedStep,
        /// The foot of the last step, if it has not found the ground yet.
        landing: Option<SwingingFoot>,
    },
    /// Weight goes to the middle and comes to rest.
    Finishing {
        /// Where the reference of the zero moment point came from.
        zmp_from: Vector2<f64>,
        /// The foot of the last step, if it has not found the ground yet.
        landing: Option<SwingingFoot>,
    },
}

/// What a transition needs to know beside the phase.
#[derive(Clone, Copy, Debug)]
pub struct TransitionInputs<'a> {
    /// The team's clock in this tick.
    pub clock: StepClock,
    /// Its lengths.
    pub timing: &'a StepTiming,
    /// Where the feet stand.
    pub feet: &'a PerFoot<Foothold>,
    /// Height at which the ground is expected \[m\].
    pub plane_m: f64,
    /// The zero moment point's reference now.
    pub zmp_ref: Vector2<f64>,
    /// Middle between both feet's zero moment points.
    pub middle: Vector2<f64>,
    /// Whether this robot calls left what the team calls right.
    pub mirrored: bool,
}

impl GaitPhase {
    /// The phase in the tick of `inputs.clock`. A step that becomes the next one is planned in place,
    /// for the planner to move.
    pub fn next(self, inputs: &TransitionInputs<'_>) -> Self {
        let TransitionInputs { clock, timing, feet, plane_m, zmp_ref, middle, mirrored } = *inputs;
        match (self, clock) {
            (Self::Standing { .. }, StepClock::Stepping { step_index: 0, tick_in_step, swing, .. })
                if tick_in_step < timing.lead || tick_in_step == timing.hurried_start() =>
            {
                let side = swing.mirrored(mirrored);
                let step = PlannedStep { index: 0, side, to: feet[side].pose };
                Self::ShiftingWeight { zmp_from: zmp_ref, step }
            }
            (Self::Standing { .. }, _) => self,

            (
                Self::ShiftingWeight { zmp_from, step },
                StepClock::Stepping { step_index: 0, tick_in_step, .. },
            ) => {
                if may_lift(timing, 0, tick_in_step) {
                    Self::lift_off(step, feet, plane_m)
                } else {
                    Self::ShiftingWeight { zmp_from, step }
                }
            }
            (Self::ShiftingWeight { .. }, _) => Self::Finishing { zmp_from: zmp_ref, landing: None },

            (Self::SingleSupport { index, .. }, StepClock::Stepping { step_index, .. })
                if index == step_index =>
            {
                self
            }
            (Self::SingleSupport { foot, .. }, StepClock::Stepping { step_index, swing, .. }) => {
                let side = swing.mirrored(mirrored);
                let step = PlannedStep { index: step_index, side, to: feet[side].pose };
                Self::DoubleSupport { zmp_from: zmp_ref, step, landing: Some(foot) }
            }
            (Self::SingleSupport { foot, .. }, _) => {
                Self::Finishing { zmp_from: zmp_ref, landing: Some(foot) }
            }

            (
                Self::DoubleSupport { step, landing, .. },
                StepClock::Stepping { step_index, tick_in_step, .. },
            ) if step.index == step_index => {
                if landing.is_none() && may_lift(timing, step_index, tick_in_step) {
                    Self::lift_off(step, feet, plane_m)
                } else {
                    self
                }
            }
            (Self::DoubleSupport { landing, .. }, _) => Self::Finishing { zmp_from: zmp_ref, landing },

            (Self::Finishing { landing: None, .. }, StepClock::Standing) => Self::Standing { zmp: middle },
            (Self::Finishing { .. }, _) => self,
        }
    }

    fn lift_off(step: PlannedStep, feet: &PerFoot<Foothold>, plane_m: f64) -> Self {
        let swing = Swing::new(feet[step.side], Foothold { pose: step.to, height: plane_m });
        Self::SingleSupport { index: step.index, foot: SwingingFoot { side: step.side, swing } }
    }

    /// The foot that is in the air, or not yet known to have landed.
    pub fn swinging_foot(&self) -> Option<SwingingFoot> {
        match *self {
            Self::SingleSupport { foot, .. } => Some(foot),
            Self::DoubleSupport { landing, .. } | Self::Finishing { landing, .. } => landing,
            Self::Standing { .. } | Self::ShiftingWeight { .. } => None,
        }
    }

    /// The same, for its way to be changed.
    pub fn swinging_foot_mut(&mut self) -> Option<&mut SwingingFoot> {
        match self {
            Self::SingleSupport { foot, .. } => Some(foot),
            Self::DoubleSupport { landing, .. } | Self::Finishing { landing, .. } => landing.as_mut(),
            Self::Standing { .. } | Self::ShiftingWeight { .. } => None,
        }
    }

    /// With the contact of the swinging foot brought up to this tick, which ends at share `s` of the
    /// swing, `force` being the vertical force on it \[N\]. Returns where a foot has come to stand whose
    /// swing is over.
    pub fn meet_ground(
        &mut self,
        config: &SwingConfig,
        force: &PerFoot<f64>,
        s: f64,
        duration: f64,
        dt: f64,
    ) -> Option<(Side, Foothold)> {
        match self {
            Self::SingleSupport { foot, .. } => {
                foot.swing.contact = foot.swing.contact_after(config, force[foot.side], s, duration, dt);
                None
            }
            Self::DoubleSupport { landing, .. } | Self::Finishing { landing, .. } => {
                let foot = landing.as_mut()?;
                foot.swing.contact = foot.swing.contact_after(config, force[foot.side], s, duration, dt);
                let SwingContact::Landed { at } = foot.swing.contact else { return None };
                let side = foot.side;
                *landing = None;
                Some((side, at))
            }
            Self::Standing { .. } | Self::ShiftingWeight { .. } => None,
        }
    }

    /// The step that is planned but not begun.
    pub fn planned_step(mut self) -> Option<PlannedStep> {
        self.planned_step_mut().copied()
    }

    /// The same, for the planner to move.
    pub fn planned_step_mut(&mut self) -> Option<&mut PlannedStep> {
        match self {
            Self::ShiftingWeight { step, .. } | Self::DoubleSupport { step, .. } => Some(step),
            _ => None,
        }
    }

    /// Whether a foot may leave the ground when `clock` says so.
    pub fn is_ready(&self, clock: &StepClock) -> bool {
        match (self, clock) {
            (Self::Standing { .. }, StepClock::Standing) => true,
            (Self::ShiftingWeight { step, .. }, StepClock::Stepping { step_index, .. }) => {
                step.index == *step_index
            }
            (Self::DoubleSupport { step, landing: None, .. }, StepClock::Stepping { step_index, .. }) => {
                step.index == *step_index
            }
            (Self::SingleSupport { index, .. }, StepClock::Stepping { step_index, .. }) => {
                index == step_index
            }
            _ => false,
        }
    }
}

/// Whether a swing may begin: from lift-off on, and not so late that the foot would have to catch up
/// with a swing that is visibly under way.
fn may_lift(timing: &StepTiming, step_index: u64, tick_in_step: u64) -> bool {
    let lift_off = timing.lift_off(step_index);
    (lift_off..=lift_off + timing.single_support / 10).contains(&tick_in_step)
}
