//! The coordinator's tick: no allocation, nothing that survives in its scratch, a start without a jump.

#![allow(non_snake_case)]

mod common;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use bytemuck::Zeroable;
use common::resolved;
use mikoshi_config::RunSpec;
use mikoshi_coordinator::{Coordinator, CoordinatorOutputs};
use mikoshi_ipc_types::{RobotState, TeamCommand, all_hands, flag, mode};
use mikoshi_spatial::{Hand, Object, Pose, World};
use nalgebra::{UnitQuaternion, Vector3};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

fn hold(overrides: &[(&str, &str)]) -> RunSpec {
    resolved("hold", overrides)
}

/// Robots whose hands are where the run begins, a little off, and pull at the object.
fn robots(run: &RunSpec, tick: u64) -> Vec<RobotState> {
    let object = &run.scenario.object;
    let X_WA = Pose::<World, Object>::new(Vector3::from(object.position_m), UnitQuaternion::identity());
    let state = |(index, robot): (usize, &mikoshi_config::RobotSpec)| {
        let mut state = RobotState::zeroed();
        state.base_pose[3] = 1.0;
        state.zmp_margin_m = 0.05;
        state.holding_hands = all_hands(robot.hand_in_object.len());
        for (hand, X_AH) in robot.hand_in_object.iter().enumerate() {
            let X_AH = Pose::<Object, Hand>::from_array(X_AH).expect("a pose");
            let mut pose = (X_WA * X_AH).to_array();
            state.hand_pose_commanded[hand] = pose;
            pose[2] -= 1e-3 * (1.0 + (0.05 * tick as f64).sin());
            state.hand_pose[hand] = pose;
            let pull = (index as f64 - 1.5) * 4.0 + hand as f64;
            state.hand_wrench[hand] = [pull, -0.5 * pull, 3.7, 0.1 * pull, 0.2, -0.3];
        }
        state
    };
    run.robots.iter().enumerate().map(state).collect()
}

#[test]
fn a_tick_allocates_nothing_and_nothing_survives_in_its_scratch() {
    let run = hold(&[("hybrid.start_s", "0.1")]);
    let coordinator = Coordinator::new(&run).expect("a coordinator");
    let (mut state, mut scratch) = (coordinator.initial_state().expect("a state"), coordinator.scratch());
    let (mut other_state, mut poisoned) = (state, coordinator.scratch());
    let (mut out, mut other_out) = (CoordinatorOutputs::default(), CoordinatorOutputs::default());
    for tick in 0..100 {
        let robots = robots(&run, tick);
        assert_no_alloc(|| coordinator.tick(tick, &mut state, &mut scratch, robots.iter(), &mut out))
            .expect("commands");
        poisoned.poison();
        coordinator
            .tick(tick, &mut other_state, &mut poisoned, robots.iter(), &mut other_out)
            .expect("commands");
        assert_eq!(bytemuck::bytes_of(&out.commands), bytemuck::bytes_of(&other_out.commands), "tick {tick}");
        assert_eq!(
            bytemuck::bytes_of(&out.team_state),
            bytemuck::bytes_of(&other_out.team_state),
            "tick {tick}"
        );
    }
    assert_eq!(bytemuck::bytes_of(&state), bytemuck::bytes_of(&other_state));
    assert_eq!(out.team_state.team_mode, mode::CARRY);
}

#[test]
fn control_starts_on_its_tick_and_without_a_jump() {
    let run = hold(&[("hybrid.start_s", "0.05")]);
    let coordinator = Coordinator::new(&run).expect("a coordinator");
    let (mut state, mut scratch) = (coordinator.initial_state().expect("a state"), coordinator.scratch());
    let mut out = CoordinatorOutputs::default();
    let mut last = None;
    for tick in 0..40 {
        coordinator.tick(tick, &mut state, &mut scratch, robots(&run, 0).iter(), &mut out).expect("commands");
        let expected = if tick < 10 { mode::HOLD } else { mode::CARRY };
        assert_eq!(out.team_state.team_mode, expected, "tick {tick}");
        let hands = out.commands.map(|command| command.hand_pose_ref);
        if let Some(last) = last.replace(hands) {
            let moved = hands.as_flattened().as_flattened().iter().zip(last.as_flattened().as_flattened());
            let largest = moved.map(|(now, before): (&f64, &f64)| (now - before).abs()).fold(0.0, f64::max);
            assert!(largest < 1e-4, "tick {tick}: {largest}");
        }
    }
    let poses = out.team_state.object_pose_ref.iter().zip(&out.team_state.object_pose);
    let largest = poses.map(|(reference, measured)| (reference - measured).abs()).fold(0.0, f64::max);
    // The wrenches by which grasps yield are still being filtered.
    assert!(largest < 1e-4, "it started {largest} from where it was");
}

#[test]
fn without_a_start_hands_hold_for_ever() {
    let run = hold(&[("hybrid.start_s", "")]);
    let coordinator = Coordinator::new(&run).expect("a coordinator");
    let (mut state, mut scratch) = (coordinator.initial_state().expect("a state"), coordinator.scratch());
    let mut out = CoordinatorOutputs::default();
    coordinator.tick(0, &mut state, &mut scratch, robots(&run, 0).iter(), &mut out).expect("commands");
    let first = out;
    for tick in 1..50 {
        coordinator.tick(tick, &mut state, &mut scratch, robots(&run, 0).iter(), &mut out).expect("commands");
        for (command, first) in out.commands.iter().zip(&first.commands) {
            assert_eq!(command.hand_pose_ref, first.hand_pose_ref);
        }
    }
}

/// Hands go ahead of feet until a first one lands: 80 mm at most in the 1.5 s that this takes. What the paper
/// compares with, a leader, starts as it is told.
#[test]
fn a_team_whose_feet_stand_starts_more_gently_than_it_is_asked_to_and_a_leader_does_not() {
    let standing_m_s = 2.0 * 0.08 / (1.5 * 1.5);
    for (scenario, after_1_s_m_s) in
        [("two_robots_symmetry", standing_m_s), ("two_robots_leader_follower", 0.1)]
    {
        let run = resolved(scenario, &[("hybrid.start_s", "0.05"), ("motion.start_s", "0.1")]);
        let coordinator = Coordinator::new(&run).expect("a coordinator");
        let (mut state, mut scratch) = (coordinator.initial_state().expect("a state"), coordinator.scratch());
        let mut out = CoordinatorOutputs::default();
        let frames: Vec<_> = robots(&run, 0)
            .into_iter()
            .map(|robot| RobotState {
                speed_share: 1.0,
                flags: flag::CAN_STOP | flag::READY_TO_STEP,
                ..robot
            })
            .collect();
        for tick in 0..20 + 200 {
            coordinator.tick(tick, &mut state, &mut scratch, frames.iter(), &mut out).expect("commands");
        }
        let speed_m_s = -out.team_state.object_twist_ref[0];
        assert!((speed_m_s - after_1_s_m_s).abs() < 1e-9, "{scenario}: {speed_m_s}");
    }
}

#[test]
fn a_hand_that_is_no_pose_is_refused_and_changes_nothing() {
    let run = hold(&[]);
    let coordinator = Coordinator::new(&run).expect("a coordinator");
    let (mut state, mut scratch) = (coordinator.initial_state().expect("a state"), coordinator.scratch());
    let (before, mut out) = (state, CoordinatorOutputs::default());
    let mut robots = robots(&run, 0);
    robots[2].hand_pose[1][3] = f64::NAN;
    assert!(coordinator.tick(0, &mut state, &mut scratch, robots.iter(), &mut out).is_err());
    assert_eq!(state, before);
    assert_eq!(out, CoordinatorOutputs::default());
}

/// Robots that do what they are told give way for ever to moments that go with no object: they may slip.
const MAY_SLIP: [(&str, &str); 2] = [("safety.slip_m", "1.0"), ("safety.slip_rad", "1.0")];

/// Robots that do what they are told: hands are where they shall be and hold if they shall. The object weighs
/// on hands that have lifted it.
fn obedient(run: &RunSpec, commands: &[TeamCommand], lifted_m: f64) -> Vec<RobotState> {
    let robots = run.robots.iter().zip(commands);
    robots
        .map(|(robot, command)| {
            let mut state = RobotState::zeroed();
            let hands = robot.grasping_hands.len();
            state.holding_hands = command.closed_hands & all_hands(hands);
            (state.flags, state.speed_share) = (flag::READY_TO_STEP | flag::CAN_STOP, 1.0);
            (state.hand_pose, state.hand_pose_commanded) = (command.hand_pose_ref, command.hand_pose_ref);
            for wrench in state.hand_wrench.iter_mut().take(hands) {
                let holds = state.holding_hands == all_hands(hands) && lifted_m > 0.0;
                wrench[2] = if holds { 3.0 * 9.81 / 8.0 } else { 0.0 };
            }
            state
        })
        .collect()
}

/// Where hands begin in this run: drawn back from where they will hold.
fn drawn_back(run: &RunSpec, draw_back_m: f64) -> Vec<TeamCommand> {
    let X_WA = Pose::<World, Object>::new(run.scenario.object.position_m.into(), UnitQuaternion::identity());
    let back = Pose::<Hand, Hand>::new(Vector3::new(0.0, 0.0, draw_back_m), UnitQuaternion::identity());
    let command = |robot: &mikoshi_config::RobotSpec| {
        let mut command = TeamCommand::zeroed();
        for (pose, X_AH) in command.hand_pose_ref.iter_mut().zip(&robot.hand_in_object) {
            *pose = (X_WA * Pose::<Object, Hand>::from_array(X_AH).expect("a pose") * back).to_array();
        }
        command
    };
    run.robots.iter().map(command).collect()
}

#[test]
fn a_job_goes_through_all_its_modes_without_an_allocation_and_without_a_jump() {
    let short = [
        ("motion.segments", "[{duration_s = 1.0, velocity_m_s = [0.0, 0.05, 0.0]}]"),
        ("job.settle_s", "0.5"),
        ("job.unload_s", "0.5"),
    ];
    let run = resolved("pick_and_place", &[&short[..], &MAY_SLIP].concat());
    let coordinator = Coordinator::new(&run).expect("a coordinator");
    let (mut state, mut scratch) = (coordinator.initial_state().expect("a state"), coordinator.scratch());
    let (mut other_state, mut poisoned) = (state, coordinator.scratch());
    let (mut out, mut other_out) = (CoordinatorOutputs::default(), CoordinatorOutputs::default());
    let start = drawn_back(&run, 0.05);
    let (mut commands, mut modes, mut lifted_m) = (start.clone(), vec![], 0.0);
    for tick in 0..4000 {
        let robots = obedient(&run, &commands, lifted_m);
        assert_no_alloc(|| coordinator.tick(tick, &mut state, &mut scratch, robots.iter(), &mut out))
            .expect("commands");
        poisoned.poison();
        coordinator
            .tick(tick, &mut other_state, &mut poisoned, robots.iter(), &mut other_out)
            .expect("commands");
        assert_eq!(bytemuck::bytes_of(&out.commands), bytemuck::bytes_of(&other_out.commands), "tick {tick}");

        for (now, before) in out.commands.iter().zip(&commands) {
            let moved = now.hand_pose_ref.as_flattened().iter().zip(before.hand_pose_ref.as_flattened());
            let largest = moved.map(|(now, before)| (now - before).abs()).fold(0.0, f64::max);
            assert!(largest < 5e-4, "tick {tick}: {largest}");
        }
        if modes.last() != Some(&out.team_state.team_mode) {
            modes.push(out.team_state.team_mode);
        }
        commands = out.commands[..run.robots.len()].to_vec();
        lifted_m = commands[0].hand_pose_ref[0][2] - 0.96;
    }
    use mode::{APPROACH, CARRY, GRASP, HOLD, LIFT, LOWER, RELEASE};
    assert_eq!(modes, [HOLD, APPROACH, GRASP, LIFT, CARRY, LOWER, RELEASE, HOLD]);
    // Hands end where they began, as far aside as the object was carried.
    for (end, start) in commands.iter().zip(&start) {
        for (end, start) in end.hand_pose_ref.iter().zip(&start.hand_pose_ref).take(2) {
            let way = [end[0] - start[0], end[1] - start[1] - 0.05, end[2] - start[2]];
            assert!(way.iter().all(|way| way.abs() < 5e-3), "{way:?}");
        }
        assert_eq!(end.closed_hands, 0);
    }
}

#[test]
fn a_hand_that_lets_go_on_the_way_stops_the_team_where_it_is() {
    let run = resolved("pick_and_place", &[&[("job.settle_s", "0.5")][..], &MAY_SLIP].concat());
    let coordinator = Coordinator::new(&run).expect("a coordinator");
    let (mut state, mut scratch) = (coordinator.initial_state().expect("a state"), coordinator.scratch());
    let (mut out, mut commands) = (CoordinatorOutputs::default(), drawn_back(&run, 0.05));
    for tick in 0..1200 {
        let mut robots = obedient(&run, &commands, 0.01);
        if tick >= 1000 {
            robots[2].holding_hands = 0b01;
        }
        coordinator.tick(tick, &mut state, &mut scratch, robots.iter(), &mut out).expect("commands");
        let expected = if tick <= 1000 { mode::LIFT } else { mode::SAFE_STOP };
        assert!(tick < 990 || out.team_state.team_mode == expected, "tick {tick}");
        if tick > 1001 {
            for (now, before) in out.commands.iter().zip(&commands) {
                assert_eq!(now.hand_pose_ref, before.hand_pose_ref);
                assert_eq!(now.closed_hands, 0b11, "the others go on to hold");
            }
        }
        commands = out.commands[..run.robots.len()].to_vec();
    }
}
