//! Steps that change while they are made: the rule itself, and a robot of one mass that is pushed.

mod team;

use mikoshi_humanoid::balance::{ExternalLoad, PerFoot, Side};
use mikoshi_humanoid::gait::{
    GaitConfig, GaitInputs, GroundPose, StepAdjustment, StepClock, StepInHand, StepLimits, TeamClock,
};
use nalgebra::Vector2;
use team::{Robot, on_rigid_ground, soles};

const DT: f64 = 0.005;
const OMEGA: f64 = 3.5;

/// The left foot swings; the plan leads to a foothold .17 m aside of the right one, .3 s from now.
fn step() -> StepInHand {
    StepInHand {
        swing: Side::Left,
        stance: GroundPose::new(0.0, -0.085, 0.0),
        pivot: Vector2::new(0.0, -0.085),
        planned: GroundPose::new(0.05, 0.085, 0.0),
        offset: None,
        seconds_left: 0.3,
        planned_dcm: Vector2::new(0.0, -0.03),
    }
}

fn adjusted(excess: Vector2<f64>) -> mikoshi_humanoid::gait::AdjustedStep {
    let limits = StepLimits::standard(soles());
    StepAdjustment::standard(OMEGA).adjust(&step(), &excess, &limits, DT).expect("there is time")
}

#[test]
fn what_the_soles_can_do_is_left_to_them() {
    let adjustment = StepAdjustment::standard(OMEGA);
    let excess = |x, y| {
        let zmp_in_foot = PerFoot { right: Vector2::new(0.015, 0.0), left: Vector2::new(0.015, 0.0) };
        let stance = GroundPose::new(1.0, 2.0, 0.0);
        adjustment.excess(&Vector2::new(x, y), &soles(), &zmp_in_foot, Side::Right, &stance)
    };
    assert_eq!(excess(0.04, 0.02), Vector2::zeros());
    assert_eq!(excess(-0.04, -0.03), Vector2::zeros());
    // A push aside is stepped after aside, and not ahead.
    let aside = excess(0.04, 0.06);
    assert!(aside.x == 0.0 && (0.02..0.05).contains(&aside.y), "{aside}");
    let limits = StepLimits::standard(soles());
    assert_eq!(adjustment.adjust(&step(), &Vector2::zeros(), &limits, DT), None);
}

#[test]
fn a_push_to_the_swinging_foot_is_met_farther_out_and_sooner() {
    let excess = Vector2::new(0.0, 0.025);
    let step = step();
    let adjusted = adjusted(excess);
    let moved = adjusted.to.position - step.planned.position;
    assert!(moved.y > 0.04 && moved.x.abs() < 1e-12, "{moved}");
    assert!(adjusted.land_in_s < 0.28, "{}", adjusted.land_in_s);
    // u + b = p + (ξ − p) τ.
    let growth = (OMEGA * step.seconds_left).exp();
    let dcm = step.pivot + (step.planned_dcm + excess - step.pivot) * growth;
    assert!((adjusted.to.position + adjusted.offset - dcm).norm() < 1e-12);
    // The plan goes towards where the robot is, and not past it.
    assert!(adjusted.take_over.y > 0.0 && adjusted.take_over.y <= excess.y);
}

#[test]
fn feet_do_not_cross_and_what_no_step_can_do_the_plan_does_not_take_over() {
    let adjusted = adjusted(Vector2::new(0.0, -0.08));
    let aside = adjusted.to.position.y - step().stance.position.y;
    assert!(aside >= 0.145 - 1e-9, "{aside}");
    assert!((adjusted.land_in_s - step().seconds_left).abs() < 1e-9, "there is no sooner landing that helps");
    assert!(adjusted.take_over.norm() < 0.02, "{}", adjusted.take_over);
}

/// A robot of one mass on level feet, whose zero moment point goes where its stabiliser would have it. Walks in place, is
/// pushed to its left in the middle of its left foot's swing so that its velocity changes at once; returns how far its
/// divergent component is off after two seconds.
fn pushed(velocity_m_s: f64, adjusts_steps: bool) -> f64 {
    let config = GaitConfig { adjusts_steps, ..on_rigid_ground() };
    let mut robot = Robot::standing_at(GroundPose::default(), config);
    robot.centre.velocity.x = 0.05;
    let timing = config.timing;
    let omega = (9.81 / config.preview.com_height_m).sqrt();
    let mut clock = TeamClock::default();
    let (mut com, mut velocity) = (robot.state.preview.com, Vector2::zeros());
    let mut pushed_at = None;
    for tick in 0..2000 {
        robot.centre.pose.position.x += robot.centre.velocity.x * DT;
        clock = clock.advance(&timing, &[robot.wish()], true);
        if let StepClock::Stepping { step_index: 3.., tick_in_step, swing: Side::Left, .. } = clock.clock
            && pushed_at.is_none()
            && tick_in_step == timing.lift_off(3) + timing.single_support / 3
        {
            pushed_at = Some(tick);
            velocity.y += velocity_m_s;
        }
        let now = robot.gait.reference(&robot.state);
        let dcm = com + velocity / omega;
        let error = dcm - (now.com.xy() + now.com_velocity.xy() / omega);
        if pushed_at.is_some_and(|at| tick == at + 400) {
            return error.norm();
        }
        let [right, left] = [now.feet.right.pose.translation.xy(), now.feet.left.pose.translation.xy()];
        let share =
            ((robot.zmp() - right).dot(&(left - right)) / (left - right).norm_squared()).clamp(0.0, 1.0);
        let bears = PerFoot { right: 1.0 - share, left: share };
        let foot_force = PerFoot::from_fn(|side| {
            if now.feet[side].pose.translation.z <= 1e-6 { 30.0 + 520.0 * bears[side] } else { 0.0 }
        });
        let inputs = GaitInputs {
            clock: clock.clock,
            hand_centre: Some(robot.centre),
            foot_force,
            soles: None,
            sole_heights: None,
            load: ExternalLoad::NONE,
            divergent_component: Some(dcm),
            soles_turn: PerFoot { right: false, left: false },
        };
        robot.gait.act(&mut robot.state, &inputs);
        // What the sole under the planned zero moment point bears at most.
        let offset = (error * 2.0).map(|off| off.clamp(-0.05, 0.05));
        let zmp = robot.zmp() + offset;
        let acceleration = (com - zmp) * (omega * omega);
        velocity += acceleration * DT;
        com += velocity * DT;
        if (com - now.com.xy()).norm() > 1.0 {
            return f64::INFINITY;
        }
    }
    panic!("it was not pushed");
}

#[test]
fn a_robot_that_is_pushed_steps_after_it_and_falls_if_it_may_not() {
    assert!(pushed(0.0, true) < 1e-3, "{}", pushed(0.0, true));
    assert!(pushed(0.25, true) < 0.02, "{}", pushed(0.25, true));
    assert_eq!(pushed(0.25, false), f64::INFINITY);
}

#[test]
fn a_robot_that_nobody_pushes_walks_as_if_steps_did_not_change() {
    let walk = |adjusts_steps| {
        let config = GaitConfig { adjusts_steps, ..on_rigid_ground() };
        let mut robot = Robot::standing_at(GroundPose::default(), config);
        robot.centre.velocity.x = 0.05;
        let mut clock = TeamClock::default();
        for _ in 0..1500 {
            robot.centre.pose.position.x += 0.05 * DT;
            clock = clock.advance(&config.timing, &[robot.wish()], true);
            robot.act(clock.clock);
        }
        robot.state
    };
    assert_eq!(walk(true), walk(false));
}
