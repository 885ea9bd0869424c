//! Who decides when the team steps: one pure function over all robots' wishes.
//!
//! ```text
//!              one wants a step, all are ready
//!   Standing ───────────────────────────────────▶ Stepping 0 ──┐ lead, first shift, swing
//!      ▲                                              │        │
//!      │ rest over                     (last step)    │        ▼ (continues)
//!      │                                              │    Stepping n ──┐
//!   Finishing ◀───────────────────────────────────────┴────────┴─▲      │
//!      ▲                                                         └──────┘
//!      └── a robot that can't lift its foot in time: all wait on two feet, then give up the walk
//! ```
//!
//! Whether step n + 1 follows is decided on the tick that starts step n, a whole step ahead, since
//! from then on every robot's preview commits to it; so the wishes are about the state after the NEXT
//! landing.

use super::step_clock::{StepClock, StepTiming};
use crate::balance::Side;

/// What one robot tells the team about its feet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepWish {
    /// Standing: its feet would be too far from their references by the time of a first landing.
    pub wants_step: bool,
    /// Walking: it could stand after the step that starts next.
    pub can_stop: bool,
    /// Its foot may leave the ground at the next lift-off.
    pub ready: bool,
    /// Which foot it would swing first, in the team's terms.
    pub first_swing: Side,
    /// Its largest foot error as a multiple of the starting threshold: whose first foot counts.
    pub urgency: f64,
    /// In how many ticks its swinging foot, or its first one, had better have landed; 0: as the clock has it.
    pub land_in_ticks: u64,
}

impl StepWish {
    /// A robot that needs nothing and is in nobody's way.
    pub const CONTENT: Self = Self {
        wants_step: false,
        can_stop: true,
        ready: true,
        first_swing: Side::Right,
        urgency: 0.0,
        land_in_ticks: 0,
    };
}

/// The team's step clock and how long it has waited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TeamClock {
    /// What the team does now.
    pub clock: StepClock,
    /// Ticks that the pending lift-off has waited for.
    pub waited: u64,
}

impl TeamClock {
    /// The next tick. `may_walk` is the team mode's consent: without it no walk starts, and one that
    /// goes on ends as soon as it can.
    pub fn advance(&self, timing: &StepTiming, wishes: &[StepWish], may_walk: bool) -> Self {
        let continues = may_walk && wishes.iter().any(|wish| !wish.can_stop);
        let all_ready = wishes.iter().all(|wish| wish.ready);
        let clock = match self.clock {
            StepClock::Standing if may_walk && all_ready && wishes.iter().any(|wish| wish.wants_step) => {
                StepClock::Stepping {
                    step_index: 0,
                    tick_in_step: 0,
                    swing: first_swing(wishes),
                    will_continue: continues,
                }
            }
            StepClock::Stepping { step_index, tick_in_step, .. }
                if tick_in_step + 1 == timing.lift_off(step_index) && !all_ready =>
            {
                // Both feet are on the ground and stay there, at the very end of the weight shift.
                return if self.waited < timing.patience {
                    Self { waited: self.waited + 1, ..*self }
                } else {
                    Self { clock: StepClock::Finishing { tick: 0 }, waited: 0 }
                };
            }
            clock => clock.successor(timing, continues),
        };
        // Who falls can't wait, and all land with him: from the next tick on the swing takes the time that is left.
        let wanted = wishes.iter().map(|wish| wish.land_in_ticks).filter(|&ticks| ticks > 0).min();
        Self { clock: wanted.map_or(clock, |ticks| clock.hurried(timing, ticks)), waited: 0 }
    }
}

/// The choice of the robot that needs it most; of equals, the first.
fn first_swing(wishes: &[StepWish]) -> Side {
    let mut urgent = StepWish::CONTENT;
    for wish in wishes.iter().filter(|wish| wish.wants_step) {
        if wish.urgency > urgent.urgency {
            urgent = *wish;
        }
    }
    urgent.first_swing
}
