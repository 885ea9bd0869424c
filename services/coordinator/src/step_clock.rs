//! When the team steps: what robots wish, as frames carry it, and the clock that all follow.

use bytemuck::{Pod, Zeroable};
use mikoshi_config::scenario::Scenario;
use mikoshi_humanoid::balance::Side;
use mikoshi_humanoid::gait::{StepClock, StepTiming, StepWish, TeamClock};
use mikoshi_ipc_types::{MAX_ROBOTS, RobotState, flag};

/// The team's clock as words.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TeamClockState {
    /// As [`StepClock::to_words`].
    pub clock: [u64; 4],
    /// Ticks that the pending lift-off has waited for.
    pub waited: u64,
}

// SAFETY: zeros are a valid value of integers.
unsafe impl Zeroable for TeamClockState {}
// SAFETY: `repr(C)` over integers of one size only: no padding, any bit pattern valid.
unsafe impl Pod for TeamClockState {}

/// What robots tell about their feet in a tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wishes {
    wishes: [StepWish; MAX_ROBOTS],
    robots: usize,
    /// Of the robot that can keep up least.
    pub speed_share: f64,
}

impl Wishes {
    /// Whether every robot stands well where it stands.
    pub(crate) fn are_content(&self) -> bool {
        self.as_slice().iter().all(|wish| wish.ready && !wish.wants_step)
    }

    /// Of all robots.
    pub(crate) fn of<'a>(robots: impl Iterator<Item = &'a RobotState>) -> Self {
        let mut all = Self { wishes: [StepWish::CONTENT; MAX_ROBOTS], robots: 0, speed_share: 1.0 };
        for (slot, robot) in all.wishes.iter_mut().zip(robots) {
            let is = |bit| robot.flags & bit != 0;
            *slot = StepWish {
                wants_step: is(flag::WANTS_STEP),
                can_stop: is(flag::CAN_STOP),
                ready: is(flag::READY_TO_STEP),
                first_swing: if is(flag::LEFT_FIRST) { Side::Left } else { Side::Right },
                urgency: robot.step_urgency,
                land_in_ticks: robot.land_in_ticks,
            };
            all.robots += 1;
            all.speed_share = all.speed_share.min(robot.speed_share);
        }
        // A NaN or a number out of range is no reason to run.
        if !(0.0..=1.0).contains(&all.speed_share) {
            all.speed_share = 0.0;
        }
        all
    }

    /// Of one robot alone.
    pub(crate) fn of_robot(&self, robot: usize) -> Self {
        let mut one = Self { wishes: [StepWish::CONTENT; MAX_ROBOTS], robots: 1, ..*self };
        if let (Some(slot), Some(wish)) = (one.wishes.first_mut(), self.wishes.get(robot)) {
            *slot = *wish;
        }
        one
    }

    fn as_slice(&self) -> &[StepWish] {
        self.wishes.get(..self.robots).unwrap_or(&self.wishes)
    }
}

impl TeamClockState {
    /// Whether nobody steps.
    pub(crate) fn is_standing(&self) -> bool {
        self.clock == StepClock::Standing.to_words()
    }

    /// Whether a walk goes on that has brought a foot down: before, feet are where it found them.
    pub(crate) fn has_landed(&self) -> bool {
        matches!(StepClock::from_words(self.clock), Some(StepClock::Stepping { step_index: 1.., .. }))
    }

    /// The next tick; `None` if the state is no clock.
    pub(crate) fn advance(&self, timing: &StepTiming, wishes: &Wishes, may_walk: bool) -> Option<Self> {
        let clock = TeamClock { clock: StepClock::from_words(self.clock)?, waited: self.waited };
        let TeamClock { clock, waited } = clock.advance(timing, wishes.as_slice(), may_walk);
        Some(Self { clock: clock.to_words(), waited })
    }
}

/// The timing that the scenario asks for.
pub(crate) fn step_timing(scenario: &Scenario) -> StepTiming {
    let period_s = scenario.control_period_s;
    StepTiming::standard(period_s).with_supports(
        period_s,
        scenario.gait.double_support_s,
        scenario.gait.single_support_s,
    )
}
