//! Where feet belong (Fig. 6, eq. 40) and where the next step may go.

mod team;

use core::f64::consts::PI;
use mikoshi_humanoid::balance::{PerFoot, Side};
use mikoshi_humanoid::gait::{FootError, FootPlacement, GroundPose, StepLimits, heading, wrap};
use mikoshi_spatial::{Hand, Pose, Twist, World, exp};
use nalgebra::{Rotation2, Vector2, Vector3};
use proptest::prelude::*;
use team::soles;

fn feet() -> PerFoot<GroundPose> {
    PerFoot { right: GroundPose::new(0.0, -0.085, 0.0), left: GroundPose::new(0.0, 0.085, 0.0) }
}

/// The palms of the carry posture: toed in, rolled, not level.
fn hands() -> [Pose<World, Hand>; 2] {
    [-1.0, 1.0].map(|side| {
        Pose::new(Vector3::new(0.35, 0.25 * side, 0.96), exp(&Vector3::new(0.7 * side, -1.1, 0.6 * side)))
    })
}

fn moved(hands: &[Pose<World, Hand>], by: &Pose<World, World>) -> Vec<(Pose<World, Hand>, Twist<World>)> {
    hands.iter().map(|hand| (*by * *hand, Twist::zero())).collect()
}

fn near(a: &GroundPose, b: &GroundPose) -> bool {
    let error = FootError::between(a, b);
    error.position < 1e-9 && error.yaw < 1e-9
}

fn any_ground_pose() -> impl Strategy<Value = GroundPose> {
    (-5.0..5.0, -5.0..5.0, -PI..PI).prop_map(|(x, y, yaw)| GroundPose::new(x, y, yaw))
}

proptest! {
    #[test]
    fn reference_feet_move_rigidly_with_the_hands(motion in any_ground_pose(), lift in -0.2..0.2) {
        let placement = FootPlacement::record(&hands(), &feet()).expect("two hands");
        let by = motion.at_height(lift);
        let centre = placement.centre(&moved(&hands(), &by)).expect("two hands");
        let reference = placement.reference_feet(&centre.pose);
        for side in Side::BOTH {
            prop_assert!(near(&reference[side], &motion.then(&feet()[side])));
        }
    }

    #[test]
    fn ground_poses_compose_like_rigid_motions(
        a in any_ground_pose(), b in any_ground_pose(), c in any_ground_pose(),
    ) {
        prop_assert!(near(&a.then(&b).then(&c), &a.then(&b.then(&c))));
        prop_assert!(near(&a.then(&a.inverse()), &GroundPose::default()));
        let world: Pose<World, World> = a.at_height(0.3);
        prop_assert!(near(&GroundPose::of(&world), &a));
    }

    #[test]
    fn a_foothold_never_leaves_its_limits_and_soles_never_meet(
        stance in any_ground_pose(), x in -1.0..1.0, y in -1.0..1.0, yaw in -PI..PI, left in any::<bool>(),
    ) {
        let limits = StepLimits::standard(soles());
        let swing = if left { Side::Left } else { Side::Right };
        let desired = stance.then(&GroundPose::new(x, y, yaw));
        let step = stance.inverse().then(&limits.foothold(swing, &stance, &desired));
        let lateral = step.position.y * swing.sign();
        prop_assert!(step.position.x.abs() <= limits.reach_m + 1e-9);
        prop_assert!(step.yaw.abs() <= limits.yaw_rad + 1e-9);
        prop_assert!(lateral >= 0.145 - 0.02 && lateral <= limits.lateral_max_m + 1e-9);
        // Every corner of the swing sole stays beyond the stance foot's inner edge by the gap that
        // parallel feet keep.
        let sole = limits.soles[swing];
        let inner = limits.soles.right.y_max;
        let gap = limits.lateral_min_m - 2.0 * inner;
        for x in [sole.x_min, sole.x_max] {
            for y in [sole.y_min, sole.y_max] {
                let at = step.position + Rotation2::new(step.yaw) * Vector2::new(x, y);
                prop_assert!(at.y * swing.sign() >= inner + gap - 1e-9, "{at}");
            }
        }
    }

    #[test]
    fn a_foothold_within_reach_is_taken_as_it_is(
        stance in any_ground_pose(), x in -0.22..0.22, lateral in 0.19..0.28, yaw in -0.25..0.25,
    ) {
        let limits = StepLimits::standard(soles());
        let desired = stance.then(&GroundPose::new(x, lateral, yaw));
        prop_assert!(near(&limits.foothold(Side::Left, &stance, &desired), &desired));
    }
}

#[test]
fn the_error_of_eq_40_is_zero_on_the_reference_and_takes_the_short_way_round() {
    let a = GroundPose::new(1.0, 2.0, PI - 0.01);
    assert_eq!(FootError::between(&a, &a), FootError { position: 0.0, yaw: 0.0 });
    let b = GroundPose::new(1.03, 2.04, -PI + 0.01);
    let error = FootError::between(&a, &b);
    assert!((error.position - 0.05).abs() < 1e-12);
    assert!((error.yaw - 0.02).abs() < 1e-12);
    let threshold = FootError { position: 0.1, yaw: 0.01 };
    assert!((error.relative_to(&threshold) - 2.0).abs() < 1e-9, "the worse of both counts");
}

#[test]
fn hands_that_stretch_apart_don_t_move_the_reference_feet() {
    let placement = FootPlacement::record(&hands(), &feet()).expect("two hands");
    let mut stretched = moved(&hands(), &Pose::identity());
    stretched[0].0.translation += Vector3::new(0.02, -0.03, 0.0);
    stretched[1].0.translation -= Vector3::new(0.02, -0.03, 0.0);
    let reference = placement.reference_feet(&placement.centre(&stretched).expect("two hands").pose);
    for side in Side::BOTH {
        assert!(near(&reference[side], &feet()[side]));
    }
}

#[test]
fn hands_turned_about_half_a_turn_average_to_half_a_turn() {
    let placement = FootPlacement::record(&hands(), &feet()).expect("two hands");
    let by = |yaw: f64| GroundPose::new(0.0, 0.0, yaw).at_height::<World>(0.0);
    let pair = [by(PI - 0.02) * hands()[0], by(-PI + 0.04) * hands()[1]].map(|hand| (hand, Twist::zero()));
    let yaw = placement.centre(&pair).expect("two hands").pose.yaw;
    assert!(wrap(yaw - (PI + 0.01)).abs() < 1e-9, "{yaw}");
}

#[test]
fn a_moving_centre_is_extrapolated_along_its_motion() {
    let placement = FootPlacement::record(&hands(), &feet()).expect("two hands");
    let twist = Twist::new(Vector3::new(0.1, -0.05, 0.2), Vector3::new(0.3, 0.0, 0.2));
    let centre = placement.centre(&hands().map(|hand| (hand, twist))).expect("two hands");
    let later = centre.after(2.0);
    assert!((later.position - Vector2::new(0.55, -0.1)).norm() < 1e-12);
    assert!((later.yaw - 0.4).abs() < 1e-12);
}

#[test]
fn there_is_no_placement_without_hands_and_no_centre_without_references() {
    assert_eq!(FootPlacement::record(&[], &feet()), None);
    assert_eq!(FootPlacement::record(&[Pose::identity(); 5], &feet()), None);
    let placement = FootPlacement::record(&hands()[..1], &feet()).expect("one hand is enough");
    assert_eq!(placement.centre(&[]), None);
}

#[test]
fn heading_ignores_pitch_and_roll_of_either_order() {
    for yaw in [-3.0, -1.0, 0.0, 0.5, 2.0] {
        let turn = exp(&Vector3::new(0.0, 0.0, yaw));
        let tilt = exp(&Vector3::new(0.4, -0.9, 0.0));
        assert!(wrap(heading(&(turn * tilt)) - yaw).abs() < 1e-12);
        assert!(wrap(heading(&(tilt * turn)) - yaw).abs() < 1e-12);
    }
}

#[test]
fn the_foot_on_the_side_of_a_lateral_motion_or_turn_leads() {
    let limits = StepLimits::standard(soles());
    let first = |motion: GroundPose| {
        limits.first_swing(&feet(), &PerFoot::from_fn(|side| motion.then(&feet()[side])))
    };
    assert_eq!(first(GroundPose::new(0.0, 0.1, 0.0)), Side::Left);
    assert_eq!(first(GroundPose::new(0.0, -0.1, 0.0)), Side::Right);
    assert_eq!(first(GroundPose::new(0.0, 0.0, 0.3)), Side::Left);
    assert_eq!(first(GroundPose::new(0.0, 0.0, -0.3)), Side::Right);
    assert_eq!(first(GroundPose::new(0.1, 0.0, 0.0)), Side::Right, "of equals, right");
}
