//! What a robot plans for the loss of its servo: a stand on both feet.

use bytemuck::Zeroable;
use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_humanoid::Kinematics;
use mikoshi_humanoid::balance::Side;
use mikoshi_humanoid::gait::{StepClock, StepTiming};
use mikoshi_ipc_types::{FALLBACK_PARTS, JointCommand, RobotState, Sensors, TeamCommand, mode};
use mikoshi_robot::Robot;
use mikoshi_servo::Servo;
use mikoshi_spatial::{Base, Foot, Pose, World};
use std::path::Path;

const PARTS: u64 = FALLBACK_PARTS as u64;
const PERIOD_S: f64 = 0.005;
/// Of the object.
const SPEED_M_S: f64 = 0.06;

fn run() -> RunSpec {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/transport.toml");
    // Feet of this robot do not feel what its weight does, which a stabiliser and steps that adapt would answer.
    let overrides = [
        ("motion.acceleration_m_s2", "0.5"),
        ("balance.stabiliser", "false"),
        ("balance.adjusts_steps", "false"),
    ];
    let overrides = overrides.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let scenario = load_scenario(&path, &overrides, None).expect("it loads");
    mikoshi_resolution::resolve(&scenario).expect("it resolves")
}

/// What the sensors read of a robot whose drives do what they are told.
fn sensors(command: &JointCommand, step: StepClock) -> Sensors {
    let mut sensors = Sensors {
        joint_position_rad: command.joint_position_ref_rad,
        joint_velocity_rad_s: command.joint_velocity_ref_rad_s,
        imu_specific_force_m_s2: [0.0, 0.0, 9.81],
        ..Sensors::zeroed()
    };
    let timing = StepTiming::standard(PERIOD_S);
    let weight = |is_up: bool| if is_up { 0.0 } else { -275.0 };
    sensors.ankle_wrench.iter_mut().zip(Side::BOTH).for_each(|(wrench, side)| {
        wrench[2] = weight(matches!(step, StepClock::Stepping { step_index, tick_in_step, swing, .. }
            if swing == side && tick_in_step >= timing.lift_off(step_index)));
    });
    sensors
}

/// Commands of a robot that stands, takes two steps under hands that move, and stands again.
fn walk(run: &RunSpec) -> Vec<JointCommand> {
    let servo = Servo::new(run, 0).expect("a servo");
    let (mut state, mut scratch) = (servo.initial_state(), servo.scratch());
    let (mut said, mut command) = (RobotState::zeroed(), JointCommand::zeroed());
    servo.act(&mut state, &mut scratch, None, &mut command).expect("it holds");
    let timing = StepTiming::standard(PERIOD_S);
    let (mut clock, mut asked) = (StepClock::Standing, None::<TeamCommand>);
    let mut commands = vec![];
    for tick in 0..900_u64 {
        servo.sense(&mut state, &mut scratch, &sensors(&command, clock), &mut said);
        let asked = asked.get_or_insert_with(|| TeamCommand {
            team_mode: mode::CARRY,
            hand_pose_ref: said.hand_pose_commanded,
            ..TeamCommand::zeroed()
        });
        clock = match tick {
            100 => StepClock::Stepping {
                step_index: 0,
                tick_in_step: 0,
                swing: Side::Right,
                will_continue: true,
            },
            _ => clock.extrapolated(&timing, 1),
        };
        asked.step_clock = clock.to_words();
        let speed = if (200..600).contains(&tick) { SPEED_M_S } else { 0.0 };
        for (pose, twist) in asked.hand_pose_ref.iter_mut().zip(&mut asked.hand_twist_ref).take(2) {
            pose[0] += speed * PERIOD_S;
            twist[0] = speed;
        }
        command = JointCommand::zeroed();
        servo.act(&mut state, &mut scratch, Some(asked), &mut command).expect("a command");
        commands.push(command);
    }
    assert!(said.steps == 2, "it walks");
    commands
}

/// Ticks at which plans begin that are whole before the end.
fn plans(commands: &[JointCommand]) -> impl Iterator<Item = (usize, &[JointCommand])> {
    let whole = commands.chunks_exact(PARTS as usize).enumerate();
    whole.map(|(index, parts)| (index * PARTS as usize, parts))
}

#[test]
fn a_part_of_a_plan_rides_with_each_command_in_order_of_time() {
    for (begin, parts) in plans(&walk(&run())) {
        let mut before = 0;
        for (index, command) in parts.iter().enumerate() {
            assert_eq!(command.fallback_part, index as u64 + 1, "of the plan of {begin}");
            let at = index as u64 + command.fallback_ahead_ticks;
            match index {
                0 => assert_eq!(at, PARTS),
                _ if index as u64 + 1 < PARTS => assert!(at > before),
                _ => assert_eq!(at, before),
            }
            before = at;
        }
    }
}

#[test]
fn every_plan_ends_on_both_feet_with_the_weight_between_them_and_keeps_joint_limits() {
    let run = run();
    let spec = &run.robots[0];
    let robot = Robot::new(&spec.config, &spec.urdf).expect("a robot");
    let mut kinematics = Kinematics::new(&robot.model);
    for (begin, parts) in plans(&walk(&run)) {
        for part in parts {
            let joints = robot.model.joints().iter().zip(&part.fallback_position_rad);
            assert!(joints.into_iter().all(|(joint, angle)| (joint.lower..=joint.upper).contains(angle)));
        }
        for end in &parts[FALLBACK_PARTS - 2..] {
            kinematics.update(&robot.model, &Pose::<World, Base>::identity(), &end.fallback_position_rad);
            let [right, left]: [Pose<World, Foot>; 2] =
                Side::BOTH.map(|side| kinematics.frame_pose(&robot.model, robot.soles[side]));
            // As the right sole sees it: the left one is on its plane, and the centre of mass between both.
            let left_in_right = right.inverse() * left.relabel::<World, World>();
            assert!(
                left_in_right.translation.z.abs() < 1e-3,
                "plan of {begin}: {}",
                left_in_right.translation
            );
            assert!(left_in_right.rotation.angle() < 0.3, "plan of {begin}");
            let com = right.inverse().transform_point(&kinematics.com());
            let share = com.y / left_in_right.translation.y;
            assert!((0.4..0.6).contains(&share), "plan of {begin}: {share} of the way from the right foot");
        }
    }
}
