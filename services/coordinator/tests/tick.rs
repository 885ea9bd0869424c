//! The coordinator's tick: no allocation, nothing that survives in its scratch, a start without a jump.

#![allow(non_snake_case)]

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use bytemuck::Zeroable;
use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_coordinator::{Coordinator, CoordinatorOutputs};
use mikoshi_ipc_types::{RobotState, mode};
use mikoshi_spatial::{Hand, Object, Pose, World};
use nalgebra::{UnitQuaternion, Vector3};
use std::path::Path;

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

fn hold(overrides: &[(&str, &str)]) -> RunSpec {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
    let overrides: Vec<_> =
        overrides.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    mikoshi_resolution::resolve(&load_scenario(&path, &overrides, None).expect("it loads"))
        .expect("it resolves")
}

/// Robots whose hands are where the run begins, a little off, and pull at the object.
fn robots(run: &RunSpec, tick: u64) -> Vec<RobotState> {
    let object = &run.scenario.object;
    let X_WA = Pose::<World, Object>::new(Vector3::from(object.position_m), UnitQuaternion::identity());
    let state = |(index, robot): (usize, &mikoshi_config::RobotSpec)| {
        let mut state = RobotState::zeroed();
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
