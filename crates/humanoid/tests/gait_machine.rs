//! One test per transition of the gait's state machine, and what it never does.

use mikoshi_humanoid::balance::{PerFoot, Side};
use mikoshi_humanoid::gait::{
    Foothold, GaitPhase, GroundPose, PlannedStep, StepClock, StepTiming, Swing, SwingConfig, SwingContact,
    SwingingFoot, TransitionInputs,
};
use nalgebra::Vector2;
use proptest::prelude::*;

fn timing() -> StepTiming {
    StepTiming { lead: 4, first_shift: 5, double_support: 2, single_support: 6, rest: 10, patience: 8 }
}

fn feet() -> PerFoot<Foothold> {
    PerFoot {
        right: Foothold::on_ground(GroundPose::new(0.0, -0.085, 0.0)),
        left: Foothold::on_ground(GroundPose::new(0.0, 0.085, 0.0)),
    }
}

const ZMP: Vector2<f64> = Vector2::new(0.01, 0.02);
const MIDDLE: Vector2<f64> = Vector2::new(0.3, 0.4);

fn next_as(phase: GaitPhase, clock: StepClock, mirrored: bool) -> GaitPhase {
    let (timing, feet) = (timing(), feet());
    phase.next(&TransitionInputs {
        clock,
        timing: &timing,
        feet: &feet,
        plane_m: 0.0,
        zmp_ref: ZMP,
        middle: MIDDLE,
        mirrored,
    })
}

fn next(phase: GaitPhase, clock: StepClock) -> GaitPhase {
    next_as(phase, clock, false)
}

/// Left swings in even steps.
fn stepping(step_index: u64, tick_in_step: u64) -> StepClock {
    let swing = if step_index.is_multiple_of(2) { Side::Left } else { Side::Right };
    StepClock::Stepping { step_index, tick_in_step, swing, will_continue: true }
}

const FINISHING: StepClock = StepClock::Finishing { tick: 3 };
const STANDING: GaitPhase = GaitPhase::Standing { zmp: ZMP };

fn step(index: u64) -> PlannedStep {
    let side = if index.is_multiple_of(2) { Side::Left } else { Side::Right };
    PlannedStep { index, side, to: GroundPose::new(0.1, 0.1, 0.0) }
}

fn swinging(side: Side) -> SwingingFoot {
    let to = Foothold::on_ground(GroundPose::new(0.1, 0.1, 0.0));
    SwingingFoot { side, swing: Swing::new(feet()[side], to) }
}

fn shifting() -> GaitPhase {
    GaitPhase::ShiftingWeight { zmp_from: ZMP, step: step(0) }
}

fn single(index: u64) -> GaitPhase {
    GaitPhase::SingleSupport { index, foot: swinging(step(index).side) }
}

fn double(index: u64, landing: Option<SwingingFoot>) -> GaitPhase {
    GaitPhase::DoubleSupport { zmp_from: ZMP, step: step(index), landing }
}

fn finishing(landing: Option<SwingingFoot>) -> GaitPhase {
    GaitPhase::Finishing { zmp_from: ZMP, landing }
}

#[test]
fn standing_shifts_weight_when_a_walk_starts() {
    let GaitPhase::ShiftingWeight { zmp_from, step } = next(STANDING, stepping(0, 0)) else {
        panic!("shifts")
    };
    assert_eq!((zmp_from, step.index, step.side), (ZMP, 0, Side::Left));
    assert_eq!(step.to, feet().left.pose, "in place until it is planned");
}

#[test]
fn a_mirrored_robot_swings_its_other_foot() {
    let GaitPhase::ShiftingWeight { step, .. } = next_as(STANDING, stepping(0, 0), true) else {
        panic!("shifts")
    };
    assert_eq!(step.side, Side::Right);
}

#[test]
fn who_misses_the_start_of_a_walk_stands() {
    for clock in [stepping(0, 4), stepping(0, 9), stepping(1, 0), FINISHING, StepClock::Standing] {
        assert_eq!(next(STANDING, clock), STANDING);
    }
}

#[test]
fn shifting_weight_lifts_the_foot_at_lift_off_and_not_before() {
    assert_eq!(next(shifting(), stepping(0, 8)), shifting());
    let GaitPhase::SingleSupport { index, foot } = next(shifting(), stepping(0, 9)) else { panic!("lifts") };
    assert_eq!((index, foot.side), (0, Side::Left));
    assert_eq!(foot.swing, Swing::new(feet().left, Foothold::on_ground(step(0).to)));
}

#[test]
fn shifting_weight_finishes_when_the_walk_is_given_up() {
    for clock in [FINISHING, StepClock::Standing] {
        assert_eq!(next(shifting(), clock), finishing(None));
    }
}

#[test]
fn single_support_lasts_as_long_as_its_step() {
    assert_eq!(next(single(3), stepping(3, 7)), single(3));
}

#[test]
fn single_support_leads_to_double_support_with_the_next_step() {
    let GaitPhase::DoubleSupport { zmp_from, step, landing } = next(single(2), stepping(3, 0)) else {
        panic!("both feet")
    };
    assert_eq!((zmp_from, step.index, step.side), (ZMP, 3, Side::Right));
    assert_eq!(landing, Some(swinging(Side::Left)));
}

#[test]
fn single_support_of_the_last_step_leads_to_finishing() {
    assert_eq!(next(single(2), FINISHING), finishing(Some(swinging(Side::Left))));
}

#[test]
fn double_support_lifts_the_next_foot_once_the_last_has_landed() {
    assert_eq!(next(double(1, None), stepping(1, 1)), double(1, None));
    assert!(matches!(next(double(1, None), stepping(1, 2)), GaitPhase::SingleSupport { index: 1, .. }));
    let waiting = double(1, Some(swinging(Side::Left)));
    assert_eq!(next(waiting, stepping(1, 2)), waiting, "whatever the clock says");
}

#[test]
fn who_comes_too_late_for_a_lift_off_stays_on_two_feet() {
    assert_eq!(next(double(1, None), stepping(1, 5)), double(1, None));
    assert_eq!(next(shifting(), stepping(0, 12)), shifting());
    assert_eq!(next(double(1, None), stepping(2, 0)), finishing(None));
}

#[test]
fn double_support_finishes_when_the_walk_is_given_up() {
    let landing = Some(swinging(Side::Left));
    assert_eq!(next(double(1, landing), FINISHING), finishing(landing));
    assert_eq!(
        next(double(1, None), stepping(2, 0)),
        finishing(None),
        "a clock that skips a step is not followed"
    );
}

#[test]
fn finishing_stands_when_the_clock_stands_and_the_foot_has_landed() {
    assert_eq!(next(finishing(None), FINISHING), finishing(None));
    assert_eq!(next(finishing(None), StepClock::Standing), GaitPhase::Standing { zmp: MIDDLE });
    let waiting = finishing(Some(swinging(Side::Left)));
    assert_eq!(next(waiting, StepClock::Standing), waiting);
}

#[test]
fn a_foot_that_lands_late_becomes_a_foothold_once() {
    let config = SwingConfig::default();
    let mut phase = double(1, Some(swinging(Side::Left)));
    let mut meet =
        |force| phase.meet_ground(&config, &PerFoot { right: 500.0, left: force }, 1.01, 0.6, 0.005);
    for _ in 0..3 {
        assert_eq!(meet(0.0), None);
    }
    let Some((Side::Left, foothold)) = meet(100.0) else { panic!("it landed") };
    assert!(foothold.height < config.touchdown_m);
    assert_eq!(meet(100.0), None);
    assert_eq!(phase, double(1, None));
}

#[test]
fn a_foot_that_landed_early_is_a_foothold_when_its_swing_is_over() {
    let at = Foothold { pose: GroundPose::new(0.09, 0.1, 0.0), height: 0.004 };
    let mut foot = swinging(Side::Left);
    foot.swing.contact = SwingContact::Landed { at };
    let mut phase = finishing(Some(foot));
    let landed =
        phase.meet_ground(&SwingConfig::default(), &PerFoot { right: 300.0, left: 250.0 }, 1.01, 0.6, 0.005);
    assert_eq!(landed, Some((Side::Left, at)));
}

#[test]
fn a_robot_is_ready_only_for_the_step_it_is_in_and_on_two_feet() {
    assert!(STANDING.is_ready(&StepClock::Standing));
    assert!(shifting().is_ready(&stepping(0, 8)));
    assert!(double(1, None).is_ready(&stepping(1, 1)));
    assert!(!double(1, Some(swinging(Side::Left))).is_ready(&stepping(1, 1)));
    assert!(!STANDING.is_ready(&stepping(0, 8)));
    assert!(!double(1, None).is_ready(&stepping(3, 1)));
    assert!(!finishing(Some(swinging(Side::Left))).is_ready(&StepClock::Standing));
}

/// A clock that jumps, or goes on as clocks do.
fn any_jump() -> impl Strategy<Value = Option<StepClock>> {
    prop_oneof![
        20 => Just(None),
        1 => Just(Some(StepClock::Standing)),
        2 => (0..4u64, 0..12u64).prop_map(|(index, tick)| Some(stepping(index, tick))),
        1 => (0..12u64).prop_map(|tick| Some(StepClock::Finishing { tick })),
    ]
}

proptest! {
    #[test]
    fn under_any_clock_a_foot_is_lifted_only_while_the_other_one_stands(
        ticks in proptest::collection::vec((any_jump(), 0.0..60.0, 0.0..60.0), 1..400),
    ) {
        let (mut phase, mut clock) = (STANDING, stepping(0, 0));
        for (jump, right, left) in ticks {
            let before = phase.swinging_foot().map(|foot| foot.side);
            clock = jump.unwrap_or_else(|| clock.extrapolated(&timing(), 1));
            phase = next(phase, clock);
            let after = phase.swinging_foot().map(|foot| foot.side);
            if let (Some(before), Some(after)) = (before, after) {
                prop_assert_eq!(before, after);
            }
            phase.meet_ground(&SwingConfig::default(), &PerFoot { right, left }, 1.1, 0.6, 0.005);
        }
    }
}
