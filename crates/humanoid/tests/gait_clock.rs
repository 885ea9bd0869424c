//! The team's step clock: common ticks, decided a step ahead, waiting for the slowest.

use mikoshi_humanoid::balance::Side;
use mikoshi_humanoid::gait::{StepClock, StepTiming, StepWish, TeamClock};
use proptest::prelude::*;

fn timing() -> StepTiming {
    StepTiming { lead: 4, first_shift: 5, double_support: 2, single_support: 6, rest: 10, patience: 8 }
}

const WALKER: StepWish = StepWish {
    wants_step: true,
    can_stop: false,
    ready: true,
    first_swing: Side::Left,
    urgency: 1.5,
    land_in_ticks: 0,
};

fn stepping(step_index: u64, tick_in_step: u64, will_continue: bool) -> StepClock {
    let swing = if step_index.is_multiple_of(2) { Side::Left } else { Side::Right };
    StepClock::Stepping { step_index, tick_in_step, swing, will_continue }
}

fn at(clock: StepClock) -> TeamClock {
    TeamClock { clock, waited: 0 }
}

/// The clocks of `ticks` ticks with wishes by tick.
fn run(wishes: impl Fn(u64, &StepClock) -> Vec<StepWish>, ticks: u64) -> Vec<StepClock> {
    let mut team = TeamClock::default();
    (0..ticks)
        .map(|tick| {
            team = team.advance(&timing(), &wishes(tick, &team.clock), true);
            team.clock
        })
        .collect()
}

#[test]
fn a_team_of_contented_robots_stands() {
    let team = TeamClock::default();
    assert_eq!(team.advance(&timing(), &[StepWish::CONTENT; 3], true), team);
}

#[test]
fn one_robot_that_wants_a_step_makes_all_step() {
    let next = TeamClock::default().advance(&timing(), &[StepWish::CONTENT, WALKER, StepWish::CONTENT], true);
    assert_eq!(next.clock, stepping(0, 0, true));
}

#[test]
fn no_walk_starts_while_a_robot_is_not_ready_or_the_mode_forbids_it() {
    let team = TeamClock::default();
    let unready = StepWish { ready: false, ..StepWish::CONTENT };
    assert_eq!(team.advance(&timing(), &[WALKER, unready], true).clock, StepClock::Standing);
    assert_eq!(team.advance(&timing(), &[WALKER], false).clock, StepClock::Standing);
}

#[test]
fn the_robot_that_needs_it_most_chooses_the_first_foot() {
    let calm = StepWish { first_swing: Side::Right, urgency: 1.2, ..WALKER };
    for wishes in [[WALKER, calm], [calm, WALKER]] {
        let next = TeamClock::default().advance(&timing(), &wishes, true);
        assert_eq!(next.clock, stepping(0, 0, true));
    }
    let equal = StepWish { first_swing: Side::Right, ..WALKER };
    let StepClock::Stepping { swing, .. } =
        TeamClock::default().advance(&timing(), &[equal, WALKER], true).clock
    else {
        panic!("it steps")
    };
    assert_eq!(swing, Side::Right, "of equals, the first robot's");
}

#[test]
fn a_step_that_continues_leads_to_the_next_one_with_the_other_foot() {
    let last = timing().step(0) - 1;
    assert_eq!(at(stepping(0, last, true)).advance(&timing(), &[WALKER], true).clock, stepping(1, 0, true));
    let last = timing().step(1) - 1;
    assert_eq!(
        at(stepping(1, last, true)).advance(&timing(), &[StepWish::CONTENT], true).clock,
        stepping(2, 0, false),
        "nobody needs a third: the next one is announced as the last"
    );
}

#[test]
fn wishes_within_a_step_change_nothing() {
    for tick in 0..timing().step(1) - 1 {
        let next = at(stepping(1, tick, false)).advance(&timing(), &[WALKER], true);
        assert_eq!(next.clock, stepping(1, tick + 1, false));
    }
}

#[test]
fn the_last_step_leads_to_finishing_and_the_rest_to_standing() {
    let last = timing().step(3) - 1;
    let finishing = at(stepping(3, last, false)).advance(&timing(), &[WALKER], true);
    assert_eq!(finishing.clock, StepClock::Finishing { tick: 0 });
    let rested = at(StepClock::Finishing { tick: timing().finish() - 1 });
    assert_eq!(rested.advance(&timing(), &[WALKER], true).clock, StepClock::Standing);
}

#[test]
fn a_restart_waits_for_the_whole_rest() {
    let clocks = run(|tick, _| vec![StepWish { can_stop: tick > 0, ..WALKER }], 200);
    let gaps: Vec<usize> = clocks
        .split(|clock| matches!(clock, StepClock::Stepping { .. }))
        .map(<[_]>::len)
        .filter(|length| *length > 0)
        .collect();
    let expected = timing().finish() as usize + 1;
    assert!(gaps.len() > 3 && gaps[..gaps.len() - 1].iter().all(|gap| *gap == expected), "{gaps:?}");
}

#[test]
fn lift_off_waits_for_a_robot_that_is_not_ready() {
    let late = |tick, clock: &StepClock| {
        let in_second = matches!(clock, StepClock::Stepping { step_index: 1, .. });
        vec![WALKER, StepWish { ready: !in_second || tick >= 20, ..StepWish::CONTENT }]
    };
    let clocks = run(late, 40);
    let start = clocks.iter().position(|clock| *clock == stepping(1, 0, true)).expect("a second step");
    let lift_off = clocks.iter().position(|clock| *clock == stepping(1, 2, true)).expect("it lifts off");
    assert_eq!((start, lift_off), (15, 20));
    assert!(clocks[start + 1..lift_off].iter().all(|clock| *clock == stepping(1, 1, true)));
}

#[test]
fn a_walk_whose_lift_off_never_comes_is_given_up_on_two_feet() {
    let stuck = |_, clock: &StepClock| {
        vec![StepWish { ready: !matches!(clock, StepClock::Stepping { step_index: 1, .. }), ..WALKER }]
    };
    let clocks = run(stuck, 40);
    let waits = clocks.iter().filter(|clock| **clock == stepping(1, 1, true)).count() as u64;
    assert_eq!(waits, timing().patience + 1);
    assert!(clocks.contains(&StepClock::Finishing { tick: 0 }));
    assert!(!clocks.contains(&stepping(1, 2, true)), "nobody lifted a foot");
}

#[test]
fn a_mode_that_forbids_walking_ends_a_walk_at_the_next_decision() {
    let mut team = at(stepping(0, timing().step(0) - 1, true));
    team = team.advance(&timing(), &[WALKER], false);
    assert_eq!(team.clock, stepping(1, 0, false));
}

proptest! {
    #[test]
    fn whether_a_step_is_the_last_is_known_from_its_first_tick(can_stop in proptest::collection::vec(any::<bool>(), 300)) {
        let clocks = run(|tick, _| vec![StepWish { can_stop: can_stop[tick as usize], ..WALKER }], 300);
        for pair in clocks.windows(2) {
            match (pair[0], pair[1]) {
                (StepClock::Stepping { step_index: a, will_continue: x, swing: s, .. },
                 StepClock::Stepping { step_index: b, will_continue: y, swing: t, tick_in_step }) => {
                    prop_assert!(a == b && x == y && s == t || a + 1 == b && x && s != t && tick_in_step == 0);
                }
                (StepClock::Stepping { will_continue, .. }, next) => {
                    prop_assert!(!will_continue);
                    prop_assert_eq!(next, StepClock::Finishing { tick: 0 });
                }
                _ => {}
            }
        }
    }

    #[test]
    fn words_on_the_wire_lead_back_to_the_clock(index in 0..1000u64, tick in 0..1000u64, bits in 0..4u64, kind in 0..3u64) {
        let clock = match kind {
            0 => StepClock::Standing,
            1 => StepClock::Stepping {
                step_index: index,
                tick_in_step: tick,
                swing: if bits & 1 == 1 { Side::Left } else { Side::Right },
                will_continue: bits & 2 == 2,
            },
            _ => StepClock::Finishing { tick },
        };
        prop_assert_eq!(StepClock::from_words(clock.to_words()), Some(clock));
    }

    #[test]
    fn words_that_mean_nothing_are_refused(kind in 3..u64::MAX, flags in 4..u64::MAX) {
        prop_assert_eq!(StepClock::from_words([kind, 0, 0, 0]), None);
        prop_assert_eq!(StepClock::from_words([1, 0, 0, flags]), None);
        prop_assert_eq!(StepClock::from_words([0, 0, 1, 0]), None);
        prop_assert_eq!(StepClock::from_words([2, 1, 0, 0]), None);
    }

    #[test]
    fn a_robot_without_commands_goes_on_as_the_team_does_within_a_step(ticks in 0..14u64) {
        let mut team = at(stepping(0, 0, false));
        for _ in 0..ticks {
            team = team.advance(&timing(), &[StepWish::CONTENT], true);
        }
        prop_assert_eq!(stepping(0, 0, false).extrapolated(&timing(), ticks), team.clock);
    }
}

#[test]
fn a_robot_that_is_not_told_of_a_further_step_takes_the_announced_one_and_stops() {
    let ahead = |ticks| stepping(0, 0, true).extrapolated(&timing(), ticks);
    assert_eq!(ahead(timing().step(0)), stepping(1, 0, false));
    assert_eq!(ahead(timing().step(0) + timing().step(1)), StepClock::Finishing { tick: 0 });
    assert_eq!(ahead(1000), StepClock::Standing);
}

#[test]
fn all_land_as_soon_as_one_robot_needs_it_and_never_later_than_they_were_to() {
    let swinging = at(stepping(1, 3, true));
    let falling = StepWish { land_in_ticks: 2, ..WALKER };
    let land_in = |clock: StepClock| match clock {
        StepClock::Stepping { step_index, tick_in_step, .. } => timing().step(step_index) - tick_in_step,
        _ => 0,
    };
    let next = swinging.advance(&timing(), &[WALKER, falling], true).clock;
    assert_eq!(land_in(next), 2, "{next:?}");
    let patient = StepWish { land_in_ticks: 100, ..WALKER };
    assert_eq!(swinging.advance(&timing(), &[patient], true), swinging.advance(&timing(), &[WALKER], true));
    // On two feet there is nothing to hurry: weight is not shifted in no time.
    let shifting = at(stepping(1, 0, true));
    assert_eq!(shifting.advance(&timing(), &[falling], true), shifting.advance(&timing(), &[WALKER], true));
}

#[test]
fn a_robot_that_falls_where_it_stands_has_all_step_without_a_head_start() {
    let falling = StepWish { land_in_ticks: 1, ..WALKER };
    let StepClock::Stepping { step_index: 0, tick_in_step, .. } =
        TeamClock::default().advance(&timing(), &[StepWish::CONTENT, falling], true).clock
    else {
        panic!("it steps")
    };
    assert_eq!(tick_in_step, timing().lift_off(0) - timing().first_shift / 4);
}
