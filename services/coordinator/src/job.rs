//! The team's modes: from open hands to an object that rests elsewhere, or, without a job, from closed hands
//! to the hybrid law.
//!
//! ```text
//!                        without a job: start of the law, or drives at their limits before
//!   Waiting ──────────────────────────────────────────────────────────▶ Carrying
//!      │ start                                                             ▲ │
//!      ▼        in reach            all hold              time      lifted │ │ motion over,
//!   Approaching ────────▶ Grasping ─────────▶ Settling ────▶ Lifting ──────┘ │ team stands
//!                                                                            ▼
//!   Done ◀──────────── Withdrawing ◀──────────── Opening ◀── Unloading ◀── Lowering
//!           drawn back               none holds         unloaded    the support bears
//!
//!   Failed ◀── Approaching, Grasping, Lowering, Unloading, Opening that take too long;
//!              Settling to Unloading when a hand lets go
//! ```
//!
//! Where somebody drives, Waiting, Settling, Carrying and Unloading also wait for his word: grasp, lift, lower, release.
//!
//! A pure function of the phase and of what is seen: [`Job::next`]. What a phase asks of hands and object is
//! a function of the phase and the tick.
//!
//! While the object rests on something (Settling, Unloading) the team controls no position of it: hands that
//! insisted on one would strain it against what it rests on. The external force goes to zero instead, along
//! all axes, as the internal forces do.

use bytemuck::{Pod, Zeroable};
use mikoshi_config::scenario::{Job as JobConfig, Scenario};
use mikoshi_ipc_types::{mode, operator};

/// The support bears the object when the hands bear less than this share of what they bore before.
const TOUCHED_SHARE: f64 = 0.5;
/// Hands have nothing to do with the object any more when they apply less than this share to it.
const UNLOADED_SHARE: f64 = 0.05;

/// What the team is to do, and for how long. Immutable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Job {
    /// Hands hold from the beginning; the hybrid law starts at a tick, or never. What strains somebody's drives past their
    /// limits before, it is there to relieve: then it starts at once.
    Hold {
        /// When.
        hybrid_start: Option<u64>,
    },
    /// All of it.
    Whole(Steps),
}

/// Lengths of the steps of a job, in ticks and metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Steps {
    start: u64,
    approach: u64,
    grasp: u64,
    settle: u64,
    lift: u64,
    unload: u64,
    limit: u64,
    draw_back_m: f64,
    lift_m: f64,
    creep_m: f64,
    /// Way in a tick.
    creep_step_m: f64,
    /// Whether somebody says when it goes on.
    by_word: bool,
}

/// Where the team is in its job. `since` is the first tick of the phase.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum Phase {
    /// Nothing has begun.
    #[default]
    Waiting,
    /// Open hands move to where they hold.
    Approaching { since: u64 },
    /// Hands close.
    Grasping { since: u64 },
    /// The hybrid law works on the resting object.
    Settling { since: u64 },
    /// The object goes up.
    Lifting { since: u64 },
    /// The object goes where the operator wants it.
    Carrying { since: u64 },
    /// The object goes down until something bears it; in the beginning the hands bore `borne_n`.
    Lowering { since: u64, borne_n: f64 },
    /// Hands let the support bear the object.
    Unloading { since: u64, borne_n: f64 },
    /// Hands open.
    Opening { since: u64 },
    /// Open hands draw back.
    Withdrawing { since: u64 },
    /// Nothing is left to do.
    Done,
    /// Something went wrong during a mode; all stay where they are.
    Failed { during: u64 },
}

/// What the team sees in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Seen {
    /// Every hand is where it can close.
    pub in_reach: bool,
    /// Every hand holds the object.
    pub all_hold: bool,
    /// No hand holds the object.
    pub none_holds: bool,
    /// The operator asks for no more motion, and the object rests.
    pub motion_is_over: bool,
    /// Nobody steps, nobody wants to.
    pub team_stands: bool,
    /// Vertical force of all hands together on the object \[N\].
    pub carried_n: f64,
    /// Size of their whole force \[N\].
    pub applied_n: f64,
    /// The operator's last word about the job that was not followed yet; 0 if none.
    pub asked: u64,
    /// A robot's drives are at their limits, and not for a moment.
    pub is_strained: bool,
}

/// A [`Phase`] as words, for the state.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PhaseWords([u64; 3]);

// SAFETY: zeros are a valid value of integers.
unsafe impl Zeroable for PhaseWords {}
// SAFETY: `repr(C)` over integers of one size only: no padding, any bit pattern valid.
unsafe impl Pod for PhaseWords {}

impl Job {
    /// As the scenario has it.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let Some(job) = &scenario.job else {
            return Self::Hold { hybrid_start: scenario.hybrid_start_tick() };
        };
        let JobConfig { draw_back_m, lift_m, creep_m, .. } = *job;
        let at_least_one = |time_s| scenario.tick_at(time_s).max(1);
        Self::Whole(Steps {
            start: scenario.tick_at(job.start_s),
            approach: at_least_one(job.approach_s),
            grasp: scenario.tick_at(job.grasp_s),
            settle: scenario.tick_at(job.settle_s),
            lift: at_least_one(job.lift_s),
            unload: scenario.tick_at(job.unload_s),
            limit: at_least_one(job.time_limit_s),
            draw_back_m,
            lift_m,
            creep_m,
            creep_step_m: job.creep_m_s * scenario.control_period_s,
            by_word: scenario.is_driven(),
        })
    }

    /// The phase of `tick`, from the last one and what was seen in it.
    pub(crate) fn next(&self, phase: Phase, tick: u64, seen: &Seen) -> Phase {
        let since = tick;
        let failed = Phase::Failed { during: phase.mode() };
        let steps = match self {
            Self::Hold { hybrid_start } => {
                return match phase {
                    Phase::Waiting if hybrid_start.is_some_and(|start| tick >= start || seen.is_strained) => {
                        Phase::Carrying { since }
                    }
                    _ => phase,
                };
            }
            Self::Whole(steps) => steps,
        };
        let has_lasted = |begun: u64, ticks: u64| tick - begun.min(tick) >= ticks;
        let awaited = self.awaited(&phase);
        let is_told = awaited == 0 || awaited == seen.asked;
        match phase {
            Phase::Waiting if is_told && tick >= steps.start => Phase::Approaching { since },
            Phase::Approaching { since: begun } if has_lasted(begun, steps.approach) && seen.in_reach => {
                Phase::Grasping { since }
            }
            Phase::Approaching { since: begun } if has_lasted(begun, steps.approach + steps.limit) => failed,
            Phase::Grasping { since: begun } if has_lasted(begun, steps.grasp) && seen.all_hold => {
                Phase::Settling { since }
            }
            Phase::Grasping { since: begun } if has_lasted(begun, steps.grasp + steps.limit) => failed,

            phase if mode::is_hybrid(phase.mode()) && !seen.all_hold => failed,
            Phase::Settling { since: begun } if is_told && has_lasted(begun, steps.settle) => {
                Phase::Lifting { since }
            }
            Phase::Lifting { since: begun } if has_lasted(begun, steps.lift) => Phase::Carrying { since },
            Phase::Carrying { .. } if is_told && seen.motion_is_over && seen.team_stands => {
                Phase::Lowering { since, borne_n: seen.carried_n }
            }
            Phase::Lowering { borne_n, .. } if seen.carried_n < TOUCHED_SHARE * borne_n => {
                Phase::Unloading { since, borne_n }
            }
            Phase::Lowering { since: begun, .. } if has_lasted(begun, steps.lowering() + steps.limit) => {
                failed
            }
            Phase::Unloading { since: begun, borne_n }
                if is_told
                    && has_lasted(begun, steps.unload)
                    && seen.applied_n < UNLOADED_SHARE * borne_n =>
            {
                Phase::Opening { since }
            }
            Phase::Unloading { since: begun, .. }
                if !steps.by_word && has_lasted(begun, steps.unload + steps.limit) =>
            {
                failed
            }

            Phase::Opening { .. } if seen.none_holds => Phase::Withdrawing { since },
            Phase::Opening { since: begun } if has_lasted(begun, steps.limit) => failed,
            Phase::Withdrawing { since: begun } if has_lasted(begun, steps.approach) => Phase::Done,
            _ => phase,
        }
    }

    /// The word that a phase waits for, whatever else it waits for; 0 if none.
    pub(crate) fn awaited(&self, phase: &Phase) -> u64 {
        match (self, phase) {
            (Self::Whole(Steps { by_word: true, .. }), phase) => match phase {
                Phase::Waiting => operator::GRASP,
                Phase::Settling { .. } => operator::LIFT,
                Phase::Carrying { .. } => operator::LOWER,
                Phase::Unloading { .. } => operator::RELEASE,
                _ => 0,
            },
            _ => 0,
        }
    }

    /// Whether hands shall hold the object.
    pub(crate) fn closes_hands(&self, phase: &Phase) -> bool {
        match (self, phase) {
            (Self::Hold { .. }, _) => true,
            (Self::Whole(_), Phase::Failed { during }) => *during == mode::GRASP || mode::is_hybrid(*during),
            (Self::Whole(_), phase) => phase.mode() == mode::GRASP || mode::is_hybrid(phase.mode()),
        }
    }

    /// How much further, in this tick, open hands go back along their palms \[m\]: less than nothing as they
    /// approach.
    pub(crate) fn hand_step_m(&self, phase: &Phase, tick: u64) -> f64 {
        match (self, phase) {
            (Self::Whole(steps), Phase::Approaching { since }) => {
                -steps.draw_back_m * smooth_part(tick, *since, steps.approach)
            }
            (Self::Whole(steps), Phase::Withdrawing { since }) => {
                steps.draw_back_m * smooth_part(tick, *since, steps.approach)
            }
            _ => 0.0,
        }
    }

    /// Whether the object touches nothing but hands.
    pub(crate) fn is_in_the_air(&self, phase: &Phase) -> bool {
        match self {
            Self::Hold { .. } => true,
            Self::Whole(_) => mode::is_hybrid(phase.mode()) && !phase.is_resting(),
        }
    }

    /// How long the operator's motion has had its turn, in ticks: without a job, since tick 0; `None` while it
    /// has not.
    pub(crate) fn motion_ticks(&self, phase: &Phase, tick: u64) -> Option<u64> {
        match (self, phase) {
            (Self::Hold { .. }, Phase::Carrying { .. }) => Some(tick),
            (Self::Whole(_), Phase::Carrying { since }) => Some(tick - since.min(&tick)),
            _ => None,
        }
    }

    /// How much higher, in this tick, the object goes \[m\]; `None` where the operator moves it, or nobody.
    pub(crate) fn object_step_m(&self, phase: &Phase, tick: u64) -> Option<f64> {
        match (self, phase) {
            (Self::Whole(steps), Phase::Lifting { since }) => {
                Some(steps.lift_m * smooth_part(tick, *since, steps.lift))
            }
            (Self::Whole(steps), Phase::Lowering { since, .. }) => Some(match tick - since.min(&tick) {
                gone if gone < steps.lift => {
                    (steps.creep_m - steps.lift_m) * smooth_part(tick, *since, steps.lift)
                }
                _ => -steps.creep_step_m,
            }),
            _ => None,
        }
    }
}

impl Steps {
    /// Ticks in which an object comes down to where it was lifted.
    fn lowering(&self) -> u64 {
        self.lift + (self.creep_m / self.creep_step_m).ceil() as u64
    }
}

impl Phase {
    /// Its team mode, one of [`mode`].
    pub(crate) fn mode(&self) -> u64 {
        match self {
            Self::Waiting | Self::Done => mode::HOLD,
            Self::Approaching { .. } => mode::APPROACH,
            Self::Grasping { .. } => mode::GRASP,
            Self::Settling { .. } | Self::Lifting { .. } => mode::LIFT,
            Self::Carrying { .. } => mode::CARRY,
            Self::Lowering { .. } | Self::Unloading { .. } => mode::LOWER,
            Self::Opening { .. } | Self::Withdrawing { .. } => mode::RELEASE,
            Self::Failed { .. } => mode::SAFE_STOP,
        }
    }

    /// Whether the object rests on something while hands hold it.
    pub(crate) fn is_resting(&self) -> bool {
        matches!(self, Self::Settling { .. } | Self::Unloading { .. })
    }

    /// The same a tick later: nothing of it passes while the team is stopped.
    pub(crate) fn delayed(mut self) -> Self {
        match &mut self {
            Self::Approaching { since }
            | Self::Grasping { since }
            | Self::Settling { since }
            | Self::Lifting { since }
            | Self::Lowering { since, .. }
            | Self::Unloading { since, .. }
            | Self::Opening { since }
            | Self::Withdrawing { since } => *since += 1,
            // The operator's motion has a clock of its own.
            Self::Carrying { .. } | Self::Waiting | Self::Done | Self::Failed { .. } => {}
        }
        self
    }

    /// As words.
    pub(crate) fn to_words(self) -> PhaseWords {
        PhaseWords(match self {
            Self::Waiting => [0; 3],
            Self::Approaching { since } => [1, since, 0],
            Self::Grasping { since } => [2, since, 0],
            Self::Lifting { since } => [3, since, 0],
            Self::Carrying { since } => [4, since, 0],
            Self::Lowering { since, borne_n } => [5, since, borne_n.to_bits()],
            Self::Opening { since } => [6, since, 0],
            Self::Withdrawing { since } => [7, since, 0],
            Self::Done => [8, 0, 0],
            Self::Failed { during } => [9, during, 0],
            Self::Settling { since } => [10, since, 0],
            Self::Unloading { since, borne_n } => [11, since, borne_n.to_bits()],
        })
    }

    /// From words; `None` unless [`Phase::to_words`] could have made them.
    pub(crate) fn from_words(words: PhaseWords) -> Option<Self> {
        let force = |bits| Some(f64::from_bits(bits)).filter(|force| force.is_finite());
        match words.0 {
            [0, 0, 0] => Some(Self::Waiting),
            [1, since, 0] => Some(Self::Approaching { since }),
            [2, since, 0] => Some(Self::Grasping { since }),
            [3, since, 0] => Some(Self::Lifting { since }),
            [4, since, 0] => Some(Self::Carrying { since }),
            [5, since, bits] => Some(Self::Lowering { since, borne_n: force(bits)? }),
            [6, since, 0] => Some(Self::Opening { since }),
            [7, since, 0] => Some(Self::Withdrawing { since }),
            [8, 0, 0] => Some(Self::Done),
            [9, during, 0] => Some(Self::Failed { during }),
            [10, since, 0] => Some(Self::Settling { since }),
            [11, since, bits] => Some(Self::Unloading { since, borne_n: force(bits)? }),
            _ => None,
        }
    }
}

/// The part of a way that `tick` covers, if the way takes `ticks` from `since` on: with neither speed nor
/// acceleration at both ends, 10 x³ − 15 x⁴ + 6 x⁵.
fn smooth_part(tick: u64, since: u64, ticks: u64) -> f64 {
    let covered_after = |gone: u64| {
        let x = (gone as f64 / ticks as f64).clamp(0.0, 1.0);
        x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
    };
    if tick < since {
        return 0.0;
    }
    let gone = tick - since;
    covered_after(gone + 1) - covered_after(gone)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEPS: Steps = Steps {
        start: 10,
        approach: 20,
        grasp: 2,
        settle: 5,
        lift: 30,
        unload: 8,
        limit: 40,
        draw_back_m: 0.05,
        lift_m: 0.03,
        creep_m: 0.004,
        creep_step_m: 0.001,
        by_word: false,
    };
    const WHOLE: Job = Job::Whole(STEPS);
    const NOTHING: Seen = Seen {
        in_reach: false,
        all_hold: false,
        none_holds: false,
        motion_is_over: false,
        team_stands: false,
        carried_n: 30.0,
        applied_n: 30.0,
        asked: 0,
        is_strained: false,
    };
    const HELD: Seen = Seen { all_hold: true, ..NOTHING };

    fn failed(during: u64) -> Phase {
        Phase::Failed { during }
    }

    #[test]
    fn without_a_job_the_law_starts_at_its_tick_or_never() {
        let job = Job::Hold { hybrid_start: Some(100) };
        assert_eq!(job.next(Phase::Waiting, 99, &NOTHING), Phase::Waiting);
        assert_eq!(job.next(Phase::Waiting, 100, &NOTHING), Phase::Carrying { since: 100 });
        let carrying = Phase::Carrying { since: 100 };
        assert_eq!(
            job.next(carrying, 5000, &Seen { motion_is_over: true, team_stands: true, ..HELD }),
            carrying
        );
        let never = Job::Hold { hybrid_start: None };
        assert_eq!(never.next(Phase::Waiting, u64::MAX, &NOTHING), Phase::Waiting);
        let strained = Seen { is_strained: true, ..NOTHING };
        assert_eq!(job.next(Phase::Waiting, 12, &strained), Phase::Carrying { since: 12 });
        assert_eq!(never.next(Phase::Waiting, 12, &strained), Phase::Waiting);
        assert!(job.closes_hands(&Phase::Waiting) && job.closes_hands(&carrying));
    }

    #[test]
    fn where_somebody_drives_a_job_goes_on_when_he_says_so() {
        let job = Job::Whole(Steps { by_word: true, ..STEPS });
        let rested = Seen { motion_is_over: true, team_stands: true, applied_n: 0.1, ..HELD };
        let (since, borne_n) = (10, 30.0);
        for (phase, word, next) in [
            (Phase::Waiting, operator::GRASP, mode::APPROACH),
            (Phase::Settling { since }, operator::LIFT, mode::LIFT),
            (Phase::Carrying { since }, operator::LOWER, mode::LOWER),
            (Phase::Unloading { since, borne_n }, operator::RELEASE, mode::RELEASE),
        ] {
            assert_eq!(job.awaited(&phase), word);
            for asked in 0..=operator::RELEASE {
                let after = job.next(phase, 100_000, &Seen { asked, ..rested });
                assert_eq!(after != phase, asked == word, "{phase:?} {asked}");
                assert!(after == phase || after.mode() == next, "{phase:?} {after:?}");
            }
            assert_ne!(WHOLE.next(phase, 100_000, &rested), phase, "nobody drives");
            assert_eq!(WHOLE.awaited(&phase), 0);
        }
    }

    #[test]
    fn hands_wait_for_their_time_and_approach() {
        assert_eq!(WHOLE.next(Phase::Waiting, 9, &NOTHING), Phase::Waiting);
        assert_eq!(WHOLE.next(Phase::Waiting, 10, &NOTHING), Phase::Approaching { since: 10 });
        assert!(!WHOLE.closes_hands(&Phase::Waiting));
    }

    #[test]
    fn hands_close_when_all_have_come_and_not_before_their_way_is_over() {
        let approaching = Phase::Approaching { since: 10 };
        let there = Seen { in_reach: true, ..NOTHING };
        assert_eq!(WHOLE.next(approaching, 29, &there), approaching);
        assert_eq!(WHOLE.next(approaching, 30, &NOTHING), approaching);
        assert_eq!(WHOLE.next(approaching, 31, &there), Phase::Grasping { since: 31 });
        assert!(!WHOLE.closes_hands(&approaching) && WHOLE.closes_hands(&Phase::Grasping { since: 31 }));
    }

    #[test]
    fn hands_that_do_not_come_stop_the_team() {
        let approaching = Phase::Approaching { since: 10 };
        assert_eq!(WHOLE.next(approaching, 69, &NOTHING), approaching);
        assert_eq!(WHOLE.next(approaching, 70, &NOTHING), failed(mode::APPROACH));
        assert!(!WHOLE.closes_hands(&failed(mode::APPROACH)));
    }

    #[test]
    fn the_law_starts_when_all_hands_hold_firmly() {
        let grasping = Phase::Grasping { since: 30 };
        assert_eq!(WHOLE.next(grasping, 31, &HELD), grasping);
        assert_eq!(WHOLE.next(grasping, 32, &NOTHING), grasping);
        let settling = Phase::Settling { since: 32 };
        assert_eq!(WHOLE.next(grasping, 32, &HELD), settling);
        assert!(mode::is_hybrid(settling.mode()) && !mode::is_hybrid(grasping.mode()));
    }

    #[test]
    fn hands_that_do_not_close_stop_the_team() {
        let grasping = Phase::Grasping { since: 30 };
        assert_eq!(WHOLE.next(grasping, 71, &NOTHING), grasping);
        assert_eq!(WHOLE.next(grasping, 72, &NOTHING), failed(mode::GRASP));
        // Those that hold go on to hold.
        assert!(WHOLE.closes_hands(&failed(mode::GRASP)));
    }

    #[test]
    fn an_object_is_lifted_when_nothing_strains_it_any_more() {
        let settling = Phase::Settling { since: 100 };
        assert_eq!(WHOLE.next(settling, 104, &HELD), settling);
        assert_eq!(WHOLE.next(settling, 105, &HELD), Phase::Lifting { since: 105 });
        assert!(settling.is_resting() && !Phase::Lifting { since: 105 }.is_resting());
    }

    #[test]
    fn an_object_that_is_up_is_carried() {
        let lifting = Phase::Lifting { since: 105 };
        assert_eq!(WHOLE.next(lifting, 134, &HELD), lifting);
        assert_eq!(WHOLE.next(lifting, 135, &HELD), Phase::Carrying { since: 135 });
    }

    #[test]
    fn an_object_goes_down_when_its_way_is_over_and_the_team_stands() {
        let carrying = Phase::Carrying { since: 135 };
        for (motion_is_over, team_stands) in [(false, false), (true, false), (false, true)] {
            let seen = Seen { motion_is_over, team_stands, ..HELD };
            assert_eq!(WHOLE.next(carrying, 9999, &seen), carrying);
        }
        let seen = Seen { motion_is_over: true, team_stands: true, ..HELD };
        assert_eq!(WHOLE.next(carrying, 200, &seen), Phase::Lowering { since: 200, borne_n: 30.0 });
    }

    #[test]
    fn a_hand_that_lets_go_stops_the_team() {
        for (phase, mode) in [
            (Phase::Settling { since: 0 }, mode::LIFT),
            (Phase::Lifting { since: 0 }, mode::LIFT),
            (Phase::Unloading { since: 0, borne_n: 30.0 }, mode::LOWER),
            (Phase::Carrying { since: 0 }, mode::CARRY),
            (Phase::Lowering { since: 0, borne_n: 30.0 }, mode::LOWER),
        ] {
            assert_eq!(WHOLE.next(phase, 1, &NOTHING), failed(mode));
            assert!(WHOLE.closes_hands(&failed(mode)), "the others go on to hold");
        }
    }

    #[test]
    fn hands_leave_the_object_to_a_support_that_bears_it() {
        let lowering = Phase::Lowering { since: 200, borne_n: 30.0 };
        assert_eq!(WHOLE.next(lowering, 234, &Seen { carried_n: 15.1, ..HELD }), lowering);
        let unloading = Phase::Unloading { since: 235, borne_n: 30.0 };
        assert_eq!(WHOLE.next(lowering, 235, &Seen { carried_n: 14.9, ..HELD }), unloading);
        assert!(unloading.is_resting() && !lowering.is_resting());
    }

    #[test]
    fn hands_open_when_they_apply_nothing_any_more() {
        let unloading = Phase::Unloading { since: 235, borne_n: 30.0 };
        let nothing = Seen { applied_n: 1.4, ..HELD };
        assert_eq!(WHOLE.next(unloading, 242, &nothing), unloading);
        assert_eq!(WHOLE.next(unloading, 243, &Seen { applied_n: 1.6, ..HELD }), unloading);
        assert_eq!(WHOLE.next(unloading, 243, &nothing), Phase::Opening { since: 243 });
        assert!(!WHOLE.closes_hands(&Phase::Opening { since: 243 }));
    }

    #[test]
    fn hands_that_can_not_leave_the_object_stop_the_team() {
        let unloading = Phase::Unloading { since: 235, borne_n: 30.0 };
        assert_eq!(WHOLE.next(unloading, 282, &HELD), unloading);
        assert_eq!(WHOLE.next(unloading, 283, &HELD), failed(mode::LOWER));
    }

    #[test]
    fn a_support_that_is_not_there_stops_the_team() {
        let lowering = Phase::Lowering { since: 200, borne_n: 30.0 };
        // 30 ticks of lowering, 4 of creeping, 40 of patience.
        assert_eq!(WHOLE.next(lowering, 273, &HELD), lowering);
        assert_eq!(WHOLE.next(lowering, 274, &HELD), failed(mode::LOWER));
    }

    #[test]
    fn open_hands_draw_back_and_the_job_is_done() {
        let opening = Phase::Opening { since: 240 };
        assert_eq!(WHOLE.next(opening, 241, &HELD), opening);
        let open = Seen { none_holds: true, ..NOTHING };
        assert_eq!(WHOLE.next(opening, 242, &open), Phase::Withdrawing { since: 242 });
        assert_eq!(WHOLE.next(opening, 280, &HELD), failed(mode::RELEASE));
        let withdrawing = Phase::Withdrawing { since: 242 };
        assert_eq!(WHOLE.next(withdrawing, 261, &open), withdrawing);
        assert_eq!(WHOLE.next(withdrawing, 262, &open), Phase::Done);
        assert!(!WHOLE.closes_hands(&withdrawing) && !WHOLE.closes_hands(&Phase::Done));
        assert!(!WHOLE.closes_hands(&failed(mode::RELEASE)));
    }

    #[test]
    fn what_is_over_stays_over() {
        let everything = Seen { in_reach: true, motion_is_over: true, team_stands: true, ..HELD };
        for phase in [Phase::Done, failed(mode::GRASP)] {
            assert_eq!(WHOLE.next(phase, u64::MAX, &everything), phase);
        }
    }

    #[test]
    fn hands_go_all_the_way_and_back_without_a_jerk() {
        let way = |phase: Phase, ticks: core::ops::Range<u64>| -> f64 {
            let steps: Vec<f64> = ticks.map(|tick| WHOLE.hand_step_m(&phase, tick)).collect();
            assert!(steps[0].abs() < 0.01 * 0.05 && steps[steps.len() - 1].abs() < 0.01 * 0.05, "{steps:?}");
            assert!(steps.iter().all(|step| step.abs() < 0.05 * 2.0 / 20.0), "{steps:?}");
            steps.iter().sum()
        };
        assert!((way(Phase::Approaching { since: 10 }, 10..30) + 0.05).abs() < 1e-12);
        assert!((way(Phase::Withdrawing { since: 50 }, 50..70) - 0.05).abs() < 1e-12);
        // Hands that are late don't go on.
        assert_eq!(WHOLE.hand_step_m(&Phase::Approaching { since: 10 }, 30), 0.0);
        assert_eq!(WHOLE.hand_step_m(&Phase::Grasping { since: 30 }, 31), 0.0);
    }

    #[test]
    fn the_object_goes_up_and_comes_down_and_creeps_in_the_end() {
        let lifting = Phase::Lifting { since: 105 };
        let step = |tick| WHOLE.object_step_m(&lifting, tick).expect("it is lifted");
        assert!(((105..135).map(step).sum::<f64>() - 0.03).abs() < 1e-12);
        assert_eq!(step(135), 0.0);

        let lowering = Phase::Lowering { since: 200, borne_n: 30.0 };
        let step = |tick| WHOLE.object_step_m(&lowering, tick).expect("it is lowered");
        assert!(((200..230).map(step).sum::<f64>() + 0.03 - 0.004).abs() < 1e-12);
        assert!((230..300).all(|tick| step(tick) == -0.001));

        for phase in [Phase::Waiting, Phase::Grasping { since: 0 }, Phase::Carrying { since: 0 }, Phase::Done]
        {
            assert_eq!(WHOLE.object_step_m(&phase, 7), None);
        }
    }

    #[test]
    fn phases_survive_as_words_and_nothing_else_does() {
        for phase in [
            Phase::Waiting,
            Phase::Approaching { since: 1 },
            Phase::Grasping { since: 2 },
            Phase::Lifting { since: 3 },
            Phase::Carrying { since: 4 },
            Phase::Lowering { since: 5, borne_n: 29.4 },
            Phase::Opening { since: 6 },
            Phase::Withdrawing { since: 7 },
            Phase::Done,
            failed(mode::LOWER),
            Phase::Settling { since: 8 },
            Phase::Unloading { since: 9, borne_n: -3.0 },
        ] {
            assert_eq!(Phase::from_words(phase.to_words()), Some(phase));
        }
        for words in [
            [12, 0, 0],
            [0, 1, 0],
            [2, 5, 1],
            [8, 1, 0],
            [5, 0, f64::NAN.to_bits()],
            [11, 0, f64::INFINITY.to_bits()],
        ] {
            assert_eq!(Phase::from_words(PhaseWords(words)), None);
        }
    }
}
