//! The team's step clock: plain data that says what every robot does in a tick.

use crate::balance::Side;
use serde::{Deserialize, Serialize};

/// How many ticks each part of a walk lasts; the same for the whole team.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepTiming {
    /// From the announcement of a walk to its first weight shift: the preview's head start.
    pub lead: u64,
    /// The first weight shift, from the middle to the first stance foot.
    pub first_shift: u64,
    /// Weight shift between two steps, and to the middle after the last one.
    pub double_support: u64,
    /// Swing.
    pub single_support: u64,
    /// From the end of the last weight shift to the next walk: what the last plan still moves comes to
    /// rest, or a restart would tip the robot.
    pub rest: u64,
    /// How long a lift-off waits for robots that can't step yet, before the walk is given up.
    pub patience: u64,
}

impl StepTiming {
    /// Lead .4 s, first shift .5 s, double support .2 s, single support .6 s, rest 1 s, patience 1 s.
    pub fn standard(control_period_s: f64) -> Self {
        let ticks = |seconds: f64| (seconds / control_period_s).round().max(1.0) as u64;
        Self {
            lead: ticks(0.4),
            first_shift: ticks(0.5),
            double_support: ticks(0.2),
            single_support: ticks(0.6),
            rest: ticks(1.0),
            patience: ticks(1.0),
        }
    }

    /// With other lengths of a step's two parts.
    pub fn with_supports(self, control_period_s: f64, double_support_s: f64, single_support_s: f64) -> Self {
        let ticks = |seconds: f64| (seconds / control_period_s).round().max(1.0) as u64;
        Self { double_support: ticks(double_support_s), single_support: ticks(single_support_s), ..self }
    }

    /// Ticks from a step's start to its lift-off.
    pub fn lift_off(&self, step_index: u64) -> u64 {
        if step_index == 0 { self.lead + self.first_shift } else { self.double_support }
    }

    /// Ticks from a step's start to its landing.
    pub fn step(&self, step_index: u64) -> u64 {
        self.lift_off(step_index) + self.single_support
    }

    /// In which tick of its first step a walk begins that somebody falls without.
    pub fn hurried_start(&self) -> u64 {
        // Weight is not shifted in no time.
        self.lift_off(0) - self.first_shift / 4
    }

    /// Ticks from the last landing to the end of the rest.
    pub fn finish(&self) -> u64 {
        self.double_support + self.rest
    }
}

/// What the whole team does in one tick. A step is a weight shift and the swing that follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum StepClock {
    /// Nobody steps.
    #[default]
    Standing,
    /// The team takes a step.
    Stepping {
        /// Index in this walk.
        step_index: u64,
        /// From the step's start.
        tick_in_step: u64,
        /// Which foot swings; a mirrored robot swings the other one.
        swing: Side,
        /// Whether another step follows: known from this step's first tick on.
        will_continue: bool,
    },
    /// The last step has landed: weight goes to the middle and comes to rest.
    Finishing {
        /// From the last landing.
        tick: u64,
    },
}

impl StepClock {
    /// Where the clock stands `ticks` later if nobody says otherwise: what a robot does without a
    /// command. A walk whose continuation isn't known ends.
    pub fn extrapolated(mut self, timing: &StepTiming, ticks: u64) -> Self {
        for _ in 0..ticks {
            self = self.successor(timing, false);
        }
        self
    }

    /// The next tick. Where that starts a step, `continues` says whether another one follows it.
    pub(super) fn successor(self, timing: &StepTiming, continues: bool) -> Self {
        match self {
            Self::Standing => Self::Standing,
            Self::Stepping { step_index, tick_in_step, swing, will_continue } => {
                if tick_in_step + 1 < timing.step(step_index) {
                    Self::Stepping { step_index, tick_in_step: tick_in_step + 1, swing, will_continue }
                } else if will_continue {
                    Self::Stepping {
                        step_index: step_index + 1,
                        tick_in_step: 0,
                        swing: swing.opposite(),
                        will_continue: continues,
                    }
                } else {
                    Self::Finishing { tick: 0 }
                }
            }
            Self::Finishing { tick } if tick + 1 < timing.finish() => Self::Finishing { tick: tick + 1 },
            Self::Finishing { .. } => Self::Standing,
        }
    }

    /// The same tick of a step that is to land in `ticks`, if a foot is in the air or a walk begins: what lies between is
    /// left out. A landing is never put off.
    pub(super) fn hurried(self, timing: &StepTiming, ticks: u64) -> Self {
        match self {
            Self::Stepping { step_index, tick_in_step, swing, will_continue }
                if tick_in_step >= timing.lift_off(step_index) || (step_index, tick_in_step) == (0, 0) =>
            {
                let mut latest = timing.step(step_index).saturating_sub(ticks.max(1));
                if tick_in_step < timing.lift_off(step_index) {
                    latest = latest.min(timing.hurried_start());
                }
                Self::Stepping { step_index, tick_in_step: tick_in_step.max(latest), swing, will_continue }
            }
            clock => clock,
        }
    }

    /// As four integers, for the wire: kind, step index, tick, and flags (bit 0 left, bit 1 continues).
    pub fn to_words(self) -> [u64; 4] {
        match self {
            Self::Standing => [0; 4],
            Self::Stepping { step_index, tick_in_step, swing, will_continue } => {
                let left = u64::from(swing == Side::Left);
                [1, step_index, tick_in_step, left | u64::from(will_continue) << 1]
            }
            Self::Finishing { tick } => [2, 0, tick, 0],
        }
    }

    /// From four integers; `None` unless [`StepClock::to_words`] could have made them.
    pub fn from_words(words: [u64; 4]) -> Option<Self> {
        match words {
            [0, 0, 0, 0] => Some(Self::Standing),
            [1, step_index, tick_in_step, flags @ 0..4] => Some(Self::Stepping {
                step_index,
                tick_in_step,
                swing: if flags & 1 == 1 { Side::Left } else { Side::Right },
                will_continue: flags & 2 == 2,
            }),
            [2, 0, tick, 0] => Some(Self::Finishing { tick }),
            _ => None,
        }
    }
}
