//! The servo's tick: no allocation, nothing that survives in its scratch, every exit a defined command.

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use bytemuck::Zeroable;
use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_ipc_types::{JointCommand, RobotState, Sensors, TeamCommand, flag, mode};
use mikoshi_servo::Servo;
use std::path::Path;

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

fn hold() -> RunSpec {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
    mikoshi_resolution::resolve(&load_scenario(&path, &[], None).expect("it loads")).expect("it resolves")
}

/// What the sensors of a robot read that stands as commanded, and sways a little.
fn sensors(run: &RunSpec, command: &JointCommand, tick: u64) -> Sensors {
    let mut sensors = Sensors::zeroed();
    let sway = 1e-3 * (0.1 * tick as f64).sin();
    let joints = run.robots[0].initial_posture_rad.len();
    for joint in 0..joints {
        sensors.joint_position_rad[joint] = command.joint_position_ref_rad[joint] + sway;
        sensors.joint_velocity_rad_s[joint] = command.joint_velocity_ref_rad_s[joint];
    }
    sensors.imu_specific_force_m_s2 = [0.0, 0.0, 9.81];
    sensors.ankle_wrench = [[0.0, 0.0, -275.0, 0.0, 0.0, 0.0]; 2];
    sensors.wrist_wrench[0] = [3.0 * sway, 1.0, -5.0, 0.1, 0.2, 0.0];
    sensors
}

/// Hands to where the servo says they are, and a little on.
fn follow(state: &RobotState) -> TeamCommand {
    let mut command = TeamCommand { team_mode: mode::CARRY, ..TeamCommand::zeroed() };
    command.hand_pose_ref = state.hand_pose_commanded;
    command.hand_pose_ref[0][0] += 1e-4;
    command.hand_pose_ref[1][2] -= 5e-5;
    command
}

#[test]
fn a_tick_allocates_nothing_and_nothing_survives_in_its_scratch() {
    let run = hold();
    let servo = Servo::new(&run, 0).expect("a servo");
    let (mut state, mut scratch) = (servo.initial_state(), servo.scratch());
    let (mut other_state, mut poisoned) = (servo.initial_state(), servo.scratch());
    let (mut said, mut other_said) = (RobotState::zeroed(), RobotState::zeroed());
    let (mut command, mut other_command) = (JointCommand::zeroed(), JointCommand::zeroed());
    servo.act(&mut state, &mut scratch, None, &mut command).expect("it holds");
    for tick in 0..100 {
        let sensors = sensors(&run, &command, tick);
        assert_no_alloc(|| {
            servo.sense(&mut state, &mut scratch, &sensors, &mut said);
            servo.act(&mut state, &mut scratch, Some(&follow(&said)), &mut command)
        })
        .expect("a command");
        poisoned.poison();
        servo.sense(&mut other_state, &mut poisoned, &sensors, &mut other_said);
        poisoned.poison();
        servo
            .act(&mut other_state, &mut poisoned, Some(&follow(&other_said)), &mut other_command)
            .expect("a command");
        assert_eq!(bytemuck::bytes_of(&said), bytemuck::bytes_of(&other_said), "tick {tick}");
        assert_eq!(bytemuck::bytes_of(&command), bytemuck::bytes_of(&other_command), "tick {tick}");
    }
    let posture = &run.robots[0].initial_posture_rad;
    assert!(posture.iter().zip(&command.joint_position_ref_rad).any(|(from, to)| (from - to).abs() > 1e-3));
}

#[test]
fn without_a_command_and_on_hold_the_posture_stays() {
    let run = hold();
    let servo = Servo::new(&run, 1).expect("a servo");
    let (mut state, mut scratch) = (servo.initial_state(), servo.scratch());
    let hold = TeamCommand { team_mode: mode::HOLD, ..TeamCommand::zeroed() };
    for team_command in [None, Some(&hold)] {
        let mut command = JointCommand::zeroed();
        servo.act(&mut state, &mut scratch, team_command, &mut command).expect("it holds");
        let posture = &run.robots[1].initial_posture_rad;
        assert_eq!(&command.joint_position_ref_rad[..posture.len()], &posture[..]);
        assert_eq!(command.joint_velocity_ref_rad_s, [0.0; 64]);
    }
}

#[test]
fn a_reference_that_is_no_pose_is_refused_and_changes_nothing() {
    let run = hold();
    let servo = Servo::new(&run, 0).expect("a servo");
    let (mut state, mut scratch) = (servo.initial_state(), servo.scratch());
    let before = state;
    let mut command = JointCommand::zeroed();
    let bad = TeamCommand { team_mode: mode::CARRY, ..TeamCommand::zeroed() };
    assert!(servo.act(&mut state, &mut scratch, Some(&bad), &mut command).is_err());
    assert_eq!(state, before);
}

#[test]
fn hands_that_fall_behind_their_references_are_reported() {
    let run = hold();
    let servo = Servo::new(&run, 0).expect("a servo");
    let (mut state, mut scratch) = (servo.initial_state(), servo.scratch());
    let (mut said, mut command) = (RobotState::zeroed(), JointCommand::zeroed());
    servo.act(&mut state, &mut scratch, None, &mut command).expect("it holds");
    let mut far = TeamCommand::zeroed();
    for tick in 0..3 {
        servo.sense(&mut state, &mut scratch, &sensors(&run, &command, tick), &mut said);
        if tick == 0 {
            assert_eq!(said.flags & flag::HANDS_BEHIND, 0);
            far = follow(&said);
            far.hand_pose_ref[0][0] += 0.5;
        }
        servo.act(&mut state, &mut scratch, Some(&far), &mut command).expect("a command");
    }
    assert_ne!(said.flags & flag::HANDS_BEHIND, 0);
    assert!(said.hand_error_max_m > 0.3);
}

/// What the servo says after it has followed hands that go aside in `mode`, 0.1 m in a second.
fn after_going_aside(
    servo: &Servo,
    run: &RunSpec,
    state: &mut mikoshi_servo::ServoState,
    team_mode: u64,
) -> (RobotState, JointCommand) {
    let mut scratch = servo.scratch();
    let (mut said, mut command) = (RobotState::zeroed(), JointCommand::zeroed());
    servo.act(state, &mut scratch, None, &mut command).expect("it holds");
    let mut aside = TeamCommand::zeroed();
    for tick in 0..200 {
        servo.sense(state, &mut scratch, &sensors(run, &command, tick), &mut said);
        if tick == 0 {
            aside = TeamCommand { team_mode, closed_hands: 0b10, ..follow(&said) };
        }
        aside.hand_pose_ref.iter_mut().take(2).for_each(|pose| pose[1] += 5e-4);
        servo.act(state, &mut scratch, Some(&aside), &mut command).expect("a command");
    }
    servo.sense(state, &mut scratch, &sensors(run, &command, 200), &mut said);
    (said, command)
}

#[test]
fn feet_follow_hands_that_carry_and_no_others() {
    let run = hold();
    let servo = Servo::new(&run, 0).expect("a servo");
    let wants_step = |state: &mut _, team_mode| {
        after_going_aside(&servo, &run, state, team_mode).0.flags & flag::WANTS_STEP != 0
    };
    let mut state = servo.initial_state();
    assert!(!wants_step(&mut state, mode::APPROACH) && !wants_step(&mut state, mode::RELEASE));
    let mut state = servo.initial_state();
    assert!(wants_step(&mut state, mode::CARRY));
    // Hands that have let go forget where the feet belonged.
    assert!(!wants_step(&mut state, mode::RELEASE));
}

#[test]
fn hands_stay_closed_or_open_until_somebody_says_otherwise() {
    let run = hold();
    let servo = Servo::new(&run, 0).expect("a servo");
    let mut state = servo.initial_state();
    let (mut scratch, mut command) = (servo.scratch(), JointCommand::zeroed());
    servo.act(&mut state, &mut scratch, None, &mut command).expect("it holds");
    assert_eq!(command.closed_hands, 0b11, "hands hold from the beginning");
    assert_eq!(after_going_aside(&servo, &run, &mut state, mode::APPROACH).1.closed_hands, 0b10);
    servo.act(&mut state, &mut scratch, None, &mut command).expect("it holds");
    assert_eq!(command.closed_hands, 0b10);
}
