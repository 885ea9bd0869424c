//! Whole-body inverse kinematics (eq. 41) of HRP-2.

#![allow(non_snake_case)]

mod common;

use common::{Carrying, carrying};
use mikoshi_humanoid::balance::Side;
use mikoshi_humanoid::ik::{ConfigureIkError, SettlePostureError, SolveIkError, joint_margin};
use mikoshi_humanoid::{IkConfig, IkGains, IkReport, IkState, IkTargets, WholeBodyIk};
use mikoshi_spatial::{Hand, Pose, Twist, World};
use nalgebra::Vector3;

#[global_allocator]
static ALLOCATOR: assert_no_alloc::AllocDisabler = assert_no_alloc::AllocDisabler;

fn move_hand(targets: &mut IkTargets, hand: usize, linear: [f64; 3], angular: [f64; 3]) {
    let pose: Pose<World, Hand> = targets.hands[hand].unwrap();
    targets.hands[hand] = Some(pose.displaced(&Twist::new(linear.into(), angular.into())));
}

/// Ticks towards constant references; the report of each.
fn follow(setup: &mut Carrying, state: &mut IkState, targets: &IkTargets, ticks: usize) -> Vec<IkReport> {
    let solve = |_| setup.ik.solve(&setup.model, state, &mut setup.scratch, targets).unwrap();
    (0..ticks).map(solve).collect()
}

fn assert_limits_respected(setup: &Carrying, before: &IkState, after: &IkState) {
    let period = setup.ik.config().period_s;
    for (j, joint) in setup.model.joints().iter().enumerate() {
        let (from, to) = (before.joint_position[j], after.joint_position[j]);
        assert!(joint.lower <= to && to <= joint.upper, "{} at {to}", joint.name);
        assert!((to - from).abs() <= joint.velocity * period * (1.0 + 1e-12), "{}", joint.name);
        assert!((after.joint_velocity[j] * period - (to - from)).abs() < 1e-12);
    }
}

fn reversals(values: &[f64], threshold: f64) -> usize {
    let steps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).filter(|d| d.abs() > threshold).collect();
    steps.windows(2).filter(|w| w[0] * w[1] < 0.0).count()
}

#[test]
fn the_carry_posture_settles_on_its_palm_poses_centre_of_mass_and_feet() {
    let mut setup = carrying();
    let posture = setup.ik.config().posture.clone();
    let state = setup.ik.settle(&setup.model, &mut setup.scratch, &posture, &setup.targets).unwrap();
    let targets = setup.targets;
    let report = follow(&mut setup, &mut state.clone(), &targets, 1)[0];
    assert!(report.hand_error_m.iter().chain(&report.hand_error_rad).all(|&e| e < 2e-5), "{report:?}");
    assert!(report.com_error_m < 1e-6 && report.foot_error_m < 1e-6, "{report:?}");
    // The configuration's posture is printed to a tenth of a degree.
    for (j, joint) in setup.model.joints().iter().enumerate() {
        let moved = (state.joint_position[j] - posture[j]).to_degrees();
        assert!(moved.abs() < 3.0, "{} moved by {moved}°", joint.name);
    }
    assert!((report.base_pose.translation.z - 0.603).abs() < 2e-3);
    assert!(joint_margin(&setup.model, &state.joint_position).to_degrees() > 10.0);
}

#[test]
fn hands_follow_moving_references_without_lag() {
    let (mut setup, mut state) = common::settled();
    let mut targets = setup.targets;
    for tick in 0..400 {
        // A circle of 3 cm at 0.5 Hz, and a turn with it.
        let phase = f64::from(tick) * 0.005 * core::f64::consts::PI;
        let offset = [0.03 * phase.sin(), 0.03 * (1.0 - phase.cos()), 0.02 * phase.sin()];
        targets.hands = setup.targets.hands;
        for hand in 0..2 {
            move_hand(&mut targets, hand, offset, [0.0, 0.1 * phase.sin(), 0.0]);
        }
        let before = state;
        let report = follow(&mut setup, &mut state, &targets, 1)[0];
        assert_limits_respected(&setup, &before, &state);
        assert!(report.hand_error_m.iter().all(|&e| e < 2e-4), "{tick}: {report:?}");
        assert!(report.com_error_m < 1e-5 && report.foot_error_m < 1e-5, "{tick}: {report:?}");
    }
}

#[test]
fn a_hand_out_of_reach_moves_neither_the_centre_of_mass_nor_a_foot() {
    let (mut setup, start) = common::settled();
    for hand in 0..2 {
        for direction in
            [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, -0.5, 0.0], [0.0, 0.0, 0.5], [-0.4, 0.0, -0.3]]
        {
            let (mut targets, mut state) = (setup.targets, start);
            move_hand(&mut targets, hand, direction, [0.0; 3]);
            for tick in 0..1000 {
                let before = state;
                let report = follow(&mut setup, &mut state, &targets, 1)[0];
                assert_limits_respected(&setup, &before, &state);
                let worst =
                    [report.com_error_m, report.foot_error_m, report.foot_error_rad, report.waist_error_rad];
                assert!(worst.iter().all(|&e| e < 1e-3), "{direction:?}, tick {tick}: {report:?}");
            }
        }
    }
}

#[test]
fn a_hand_out_of_reach_comes_as_close_as_the_joints_let_it() {
    let (mut setup, mut state) = common::settled();
    let mut targets = setup.targets;
    move_hand(&mut targets, 0, [0.5, 0.0, 0.0], [0.0; 3]);
    follow(&mut setup, &mut state, &targets, 4000);
    let cost = |report: &IkReport| {
        (0..2).map(|i| report.hand_error_m[i].powi(2) + report.hand_error_rad[i].powi(2)).sum::<f64>()
    };
    let settled = follow(&mut setup, &mut state, &targets, 1)[0];
    assert!(settled.hand_error_m[0] < 0.45, "{settled:?}");
    // From other postures nothing closer is found: elbow in, shoulder turned, chest turned.
    let config = setup.ik.config().clone();
    for (joint, offset) in [("RARM_JOINT2", -0.5), ("RARM_JOINT1", 0.3), ("CHEST_JOINT0", 0.3)] {
        let mut other = IkState::at_rest(&config.posture);
        other.joint_position[setup.model.find_joint(joint).unwrap()] += offset;
        let report = follow(&mut setup, &mut other, &targets, 4000)[3999];
        assert!(cost(&settled) < 1.02 * cost(&report), "{joint}: {settled:?} against {report:?}");
    }
}

#[test]
fn nothing_chatters_while_a_hand_is_out_of_reach() {
    let (mut setup, start) = common::settled();
    for direction in [[0.5, 0.0, 0.0], [0.5, -0.3, 0.2], [0.0, 0.5, 0.0], [0.2, 0.0, -0.5]] {
        let (mut targets, mut state) = (setup.targets, start);
        move_hand(&mut targets, 0, direction, [0.0; 3]);
        let n = setup.model.joint_count();
        let mut tracks = vec![vec![]; n];
        for _ in 0..2000 {
            follow(&mut setup, &mut state, &targets, 1);
            (0..n).for_each(|j| tracks[j].push(state.joint_position[j]));
        }
        for (j, track) in tracks.iter().enumerate() {
            let name = &setup.model.joints()[j].name;
            // Joints may turn back when others meet their limits on the way, but not time and again.
            let turns = reversals(track, 1e-6);
            assert!(turns <= 8 && reversals(&track[500..], 1e-6) <= 2, "{name} turns {turns} times");
            let rate = (track[1999] - track[1998]).abs() / 0.005;
            assert!(rate < 0.02, "{name} still moves at {rate} rad/s");
        }
    }
}

#[test]
fn a_hand_that_was_out_of_reach_recovers_when_its_reference_returns() {
    let (mut setup, mut state) = common::settled();
    let mut far = setup.targets;
    move_hand(&mut far, 0, [0.5, -0.2, 0.1], [0.0; 3]);
    follow(&mut setup, &mut state, &far, 1000);
    let near = setup.targets;
    let reports = follow(&mut setup, &mut state, &near, 600);
    let report = reports[599];
    assert!(report.hand_error_m[0] < 1e-4 && report.hand_error_rad[0] < 1e-4, "{report:?}");
    assert!(reports.iter().all(|report| report.com_error_m < 1e-3 && report.foot_error_m < 1e-3));
}

#[test]
fn a_foot_out_of_reach_leaves_the_centre_of_mass_where_it_should_be() {
    let (mut setup, mut state) = common::settled();
    let mut targets = setup.targets;
    targets.stance = Side::Left;
    targets.feet.right =
        targets.feet.right.displaced(&Twist::new(Vector3::new(0.9, 0.0, 0.0), Vector3::zeros()));
    for report in follow(&mut setup, &mut state, &targets, 1500) {
        assert!(report.com_error_m < 1e-3 && report.waist_error_rad < 2e-3, "{report:?}");
    }
    let at_rest = follow(&mut setup, &mut state, &targets, 1)[0];
    assert!(at_rest.foot_error_m > 0.1, "this was to be out of reach: {at_rest:?}");
    assert!(state.joint_velocity.iter().all(|rate| rate.abs() < 1e-2));
}

/// The left sole lies half on a board of 15 mm, its outer side up, and the robot comes to stand on it alone: its ankle, which
/// has 20 degrees and keeps 3 of them, would need more.
#[test]
fn where_an_ankle_has_no_room_the_body_leans_and_neither_hands_nor_balance_give_way() {
    let (mut setup, mut state) = common::settled();
    let mut targets = setup.targets;
    targets.stance = Side::Left;
    let start = targets;
    let ankle = setup.model.find_joint("LLEG_JOINT5").unwrap();
    let (trunk, mut most, mut lean, mut bend) = (state.joint_position, 0.0_f64, 0.0_f64, 0.0_f64);
    for tick in 0..600 {
        // There within .5 s, and back after 1 s more.
        let share = (f64::from(tick) / 100.0).min(1.0).min((400.0 - f64::from(tick)) / 100.0).max(0.0);
        let tilt = Twist::new(Vector3::zeros(), Vector3::new(0.11 * share, 0.0, 0.0));
        targets.feet.left = start.feet.left.displaced(&tilt);
        targets.com.y = start.com.y + 0.08 * share;
        let before = state;
        let report = follow(&mut setup, &mut state, &targets, 1)[0];
        assert_limits_respected(&setup, &before, &state);
        assert!(report.hand_error_m.iter().all(|&e| e < 2e-3), "tick {tick}: {report:?}");
        assert!(report.com_error_m < 1e-3 && report.foot_error_m < 1e-3, "tick {tick}: {report:?}");
        most = most.max(state.joint_position[ankle]);
        lean = lean.max(report.waist_error_rad);
        for joint in ["CHEST_JOINT0", "CHEST_JOINT1"] {
            let joint = setup.model.find_joint(joint).unwrap();
            bend = bend.max((state.joint_position[joint] - trunk[joint]).abs());
        }
    }
    let limit = setup.model.joints()[ankle].upper - setup.ik.config().gains.limit_margin;
    assert!((most - limit).abs() < 1e-3, "the ankle was to be at its limit: {most}, {limit}");
    assert!((0.01..0.15).contains(&lean), "and the body to lean: {lean}");
    assert!(bend < 0.1, "its drive has no more torque than for carrying upright: {bend}");
    let upright = follow(&mut setup, &mut state, &targets, 1)[0].waist_error_rad;
    assert!(upright < 1e-4, "it is upright again: {upright}");
}

#[test]
fn it_makes_no_difference_which_of_two_feet_on_the_ground_is_the_base() {
    let (mut setup, mut by_right) = common::settled();
    let mut targets = setup.targets;
    targets.com += Vector3::new(0.02, 0.03, -0.01);
    follow(&mut setup, &mut by_right, &targets, 50);
    let mut by_left = by_right;
    for tick in 0..200 {
        targets.com.y -= 0.0002;
        targets.stance = Side::Right;
        let right = follow(&mut setup, &mut by_right, &targets, 1)[0];
        // The base changes sides in every third tick: nothing may jump.
        targets.stance = if tick % 3 == 0 { Side::Left } else { Side::Right };
        let left = follow(&mut setup, &mut by_left, &targets, 1)[0];
        let apart = right.base_pose.displacement_to(&left.base_pose).to_vector().amax();
        assert!(apart < 2e-5, "tick {tick}: {apart}");
        let joints = by_right.joint_position.iter().zip(by_left.joint_position);
        let apart = joints.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-6, "tick {tick}: {apart}");
    }
}

#[test]
fn a_swinging_foot_follows_its_reference_while_the_hands_stay() {
    let (mut setup, mut state) = common::settled();
    let mut targets = setup.targets;
    targets.stance = Side::Left;
    targets.com.y += 0.07;
    follow(&mut setup, &mut state, &targets, 300);
    let start = targets.feet.right;
    for tick in 0..140 {
        let s = f64::from(tick) / 140.0;
        let lift = 0.05 * (core::f64::consts::PI * s).sin().powi(2);
        let ahead = 0.1 * (1.0 - (core::f64::consts::PI * s).cos()) / 2.0;
        targets.feet.right = start.displaced(&Twist::new(Vector3::new(ahead, 0.0, lift), Vector3::zeros()));
        let report = follow(&mut setup, &mut state, &targets, 1)[0];
        assert!(report.foot_error_m < 5e-4, "{report:?}");
        assert!(report.com_error_m < 1e-4, "{report:?}");
        assert!(report.hand_error_m.iter().all(|&e| e < 1e-3), "{report:?}");
    }
}

#[test]
fn the_null_space_flees_a_limit_when_nothing_asks_for_it() {
    let (setup, start) = common::settled();
    let head = setup.model.find_joint("HEAD_JOINT0").unwrap();
    let mut config = setup.ik.config().clone();
    // A preferred posture beyond the limit's margin: the joint comes to rest before it.
    let limit = setup.model.joints()[head].upper;
    config.posture[head] = limit;
    let ik = WholeBodyIk::new(&setup.model, config).unwrap();
    let mut setup = Carrying { ik, ..setup };
    let mut state = start;
    let targets = setup.targets;
    follow(&mut setup, &mut state, &targets, 3000);
    let distance = limit - state.joint_position[head];
    assert!(distance > 0.05 + 0.01 && distance < 0.2, "{distance}");
}

#[test]
fn a_joint_that_starts_beyond_its_margin_comes_back_within_its_speed() {
    let (mut setup, start) = common::settled();
    let elbow = setup.model.find_joint("RARM_JOINT3").unwrap();
    let mut state = start;
    state.joint_position[elbow] = setup.model.joints()[elbow].lower + 0.001;
    let targets = setup.targets;
    for _ in 0..200 {
        let before = state;
        follow(&mut setup, &mut state, &targets, 1);
        assert_limits_respected(&setup, &before, &state);
    }
    assert!(joint_margin(&setup.model, &state.joint_position) > 0.04);
}

#[test]
fn an_arm_speed_cap_binds_arms_and_nothing_else() {
    let (setup, start) = common::settled();
    let mut config = setup.ik.config().clone();
    config.gains.arm_speed = Some(0.2);
    config.gains.trunk_acceleration = 1e3;
    let ik = WholeBodyIk::new(&setup.model, config).unwrap();
    let mut setup = Carrying { ik, ..setup };
    let (mut state, mut targets) = (start, setup.targets);
    // Hands up and about the robot, so that the chest turns too.
    move_hand(&mut targets, 0, [0.1, 0.0, 0.1], [0.0; 3]);
    move_hand(&mut targets, 1, [-0.1, 0.0, 0.1], [0.0; 3]);
    targets.com.z -= 0.02;
    let (mut fastest_arm, mut fastest_leg, mut fastest_chest) = (0.0_f64, 0.0_f64, 0.0_f64);
    for _ in 0..100 {
        follow(&mut setup, &mut state, &targets, 1);
        for (j, joint) in setup.model.joints().iter().enumerate() {
            let rate = state.joint_velocity[j].abs();
            match &joint.name[1..4] {
                "ARM" => fastest_arm = fastest_arm.max(rate),
                "LEG" => fastest_leg = fastest_leg.max(rate),
                "HES" => fastest_chest = fastest_chest.max(rate),
                _ => {}
            }
        }
    }
    assert!((fastest_arm - 0.2).abs() < 1e-9, "{fastest_arm}");
    assert!(fastest_leg > 0.5 && fastest_chest > 0.5, "{fastest_leg}, {fastest_chest}");
}

#[test]
fn trunk_and_head_gain_speed_gently_whatever_is_asked_of_hands_and_feet() {
    let (mut setup, mut state) = common::settled();
    let mut targets = setup.targets;
    move_hand(&mut targets, 0, [0.1, 0.0, 0.1], [0.0; 3]);
    move_hand(&mut targets, 1, [-0.1, 0.0, 0.1], [0.0; 3]);
    targets.feet.left.translation.x += 0.1;
    let most = setup.ik.config().gains.trunk_acceleration * setup.ik.config().period_s;
    for _ in 0..100 {
        let before = state;
        follow(&mut setup, &mut state, &targets, 1);
        for (j, joint) in setup.model.joints().iter().enumerate() {
            // Before a limit of position they stop as they must.
            let gain = state.joint_velocity[j].abs() - before.joint_velocity[j].abs();
            let is_of_trunk = joint.name.starts_with("CHEST") || joint.name.starts_with("HEAD");
            assert!(!is_of_trunk || gain < most + 1e-9, "{}: {gain}", joint.name);
        }
    }
}

#[test]
fn a_reference_that_is_not_a_number_leaves_the_state_as_it_was() {
    let (mut setup, start) = common::settled();
    let spoilers: [fn(&mut IkTargets); 5] = [
        |targets| targets.com.x = f64::NAN,
        |targets| targets.com.z = f64::INFINITY,
        |targets| targets.feet.right.translation.y = f64::NAN,
        |targets| targets.feet.left.translation.y = f64::NAN,
        |targets| targets.hands[1].as_mut().unwrap().translation.z = f64::NAN,
    ];
    for spoil in spoilers {
        let (mut state, mut targets) = (start, setup.targets);
        spoil(&mut targets);
        let result = setup.ik.solve(&setup.model, &mut state, &mut setup.scratch, &targets);
        assert_eq!((result, state), (Err(SolveIkError), start));
    }
}

#[test]
fn a_tick_allocates_nothing_and_nothing_survives_in_its_workspace() {
    let (mut setup, start) = common::settled();
    let mut targets = setup.targets;
    move_hand(&mut targets, 0, [0.5, -0.2, 0.1], [0.0, 0.3, 0.0]);
    let (mut state, mut again) = (start, start);
    for _ in 0..100 {
        let report = setup.ik.solve(&setup.model, &mut state, &mut setup.scratch, &targets);
        setup.scratch.fill_with_nan();
        let Carrying { model, ik, scratch, .. } = &mut setup;
        let report_again =
            assert_no_alloc::assert_no_alloc(|| ik.solve(model, &mut again, scratch, &targets));
        scratch.fill_with_nan();
        assert_eq!((report, state), (report_again, again));
    }
}

#[test]
fn an_unreachable_grasp_is_refused_with_the_hand_the_distance_and_the_joints_in_the_way() {
    let mut setup = carrying();
    let posture = setup.ik.config().posture.clone();
    let mut targets = setup.targets;
    move_hand(&mut targets, 1, [0.4, 0.0, 0.0], [0.0; 3]);
    let error = setup.ik.settle(&setup.model, &mut setup.scratch, &posture, &targets).unwrap_err();
    let SettlePostureError::UnreachableGrasp { hand, missed_by_m, ref limiting_joints, .. } = error else {
        panic!("{error}")
    };
    assert_eq!(hand, 1);
    assert!((0.05..0.4).contains(&missed_by_m), "{missed_by_m}");
    assert!(!limiting_joints.is_empty());
    assert!(error.to_string().contains(&limiting_joints[0]), "{error}");
}

#[test]
fn an_unreachable_stance_is_refused() {
    let mut setup = carrying();
    let posture = setup.ik.config().posture.clone();
    let mut targets = setup.targets;
    targets.hands = [None; 4];
    targets.com.z = 1.2;
    let error = setup.ik.settle(&setup.model, &mut setup.scratch, &posture, &targets).unwrap_err();
    assert!(matches!(error, SettlePostureError::UnreachableStance { .. }), "{error}");
    targets.com.z = f64::NAN;
    let error = setup.ik.settle(&setup.model, &mut setup.scratch, &posture, &targets).unwrap_err();
    assert_eq!(error, SettlePostureError::NotFinite);
}

#[test]
fn a_configuration_that_does_not_fit_the_model_is_refused() {
    let setup = carrying();
    let config = setup.ik.config().clone();
    let refused = |change: &dyn Fn(&mut IkConfig)| {
        let mut config = config.clone();
        change(&mut config);
        WholeBodyIk::new(&setup.model, config).unwrap_err()
    };
    let hand = config.hands[0];
    assert_eq!(refused(&|c| c.hands = vec![hand; 5]), ConfigureIkError::TooManyHands(5));
    assert!(matches!(refused(&|c| c.posture.clear()), ConfigureIkError::PostureSize { found: 0, .. }));
    assert!(matches!(refused(&|c| c.period_s = 0.0), ConfigureIkError::NotPositive { name: "period_s", .. }));
    let nan = IkGains { damping: f64::NAN, ..IkGains::default() };
    assert!(matches!(refused(&|c| c.gains = nan), ConfigureIkError::NotPositive { name: "damping", .. }));
}
