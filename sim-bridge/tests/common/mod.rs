//! Teams that stand in the carry posture, made without the services that make them for a real run.

#![allow(dead_code, non_snake_case)] // Each test uses its part; monogram names as in the crates.

use bytemuck::Zeroable;
use mikoshi_config::{RobotSpec, RunSpec, load_scenario};
use mikoshi_humanoid::{Kinematics, Model};
use mikoshi_ipc_types::{JointCommand, ObjectTruth, PoseWire, RobotTruth, Sensors, WrenchWire};
use mikoshi_physics::Physics as _;
use mikoshi_sim_bridge::World as SimulatedWorld;
use mikoshi_spatial::{Base, Foot, Hand, Object, Pose, World};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use std::path::Path;

/// Scenario `name` with these overrides, its robots in their configured carry posture.
pub fn standing_team(name: &str, overrides: &[(&str, &str)]) -> RunSpec {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../config/scenarios/{name}.toml"));
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let loaded = load_scenario(&path, &overrides, None).expect("a valid scenario");
    let scenario = loaded.scenario;
    let object = &scenario.object;
    let X_WA: Pose<World, Object> = Pose::new(Vector3::from(object.position_m), about_z(object.yaw_deg));
    let robots = scenario.robots.iter().map(|member| {
        let robot = &loaded.models[&member.model];
        let config = robot.config.clone();
        let model = Model::from_urdf(&robot.urdf, &|_| None).expect("a valid robot");
        let posture = model.joints().iter().map(|j| config.carry_posture_deg[&j.name].to_radians());
        let initial_posture_rad: Vec<f64> = posture.collect();
        let mut kinematics = Kinematics::new(&model);
        kinematics.update(&model, &Pose::identity(), &initial_posture_rad);
        let sole = |foot: usize| {
            let frame = model.find_frame(&config.feet[foot].sole_link).expect("a sole");
            kinematics.frame_pose::<Foot>(&model, frame).translation
        };
        let ground_in_base = (sole(0) + sole(1)) * 0.5;
        let heading = about_z(member.yaw_deg);
        let X_WB: Pose<World, Base> =
            Pose::new(Vector3::new(member.x_m, member.y_m, 0.0) - heading * ground_in_base, heading);
        kinematics.update(&model, &X_WB, &initial_posture_rad);
        let hands = config.hands.iter().map(|hand| {
            let frame = model.find_frame(&hand.palm_link).expect("a palm");
            (X_WA.inverse() * kinematics.frame_pose::<Hand>(&model, frame)).to_array()
        });
        let hand_in_object: Vec<_> = hands.collect();
        RobotSpec {
            member: member.clone(),
            urdf: robot.urdf.clone(),
            initial_posture_rad,
            initial_base_pose: X_WB.to_array(),
            grasping_hands: (0..hand_in_object.len()).collect(),
            hand_in_object,
            config,
        }
    });
    let robots = robots.collect();
    RunSpec { ticks: scenario.ticks(), scenario, robots, motion: vec![] }
}

fn about_z(degrees: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(0.0, 0.0, degrees.to_radians())
}

/// Commands that hold the postures of tick 0.
pub fn constant_commands(run: &RunSpec) -> Vec<JointCommand> {
    let command = |robot: &RobotSpec| {
        let mut command =
            JointCommand { closed_hands: (1 << robot.grasping_hands.len()) - 1, ..JointCommand::zeroed() };
        command.joint_position_ref_rad[..robot.initial_posture_rad.len()]
            .copy_from_slice(&robot.initial_posture_rad);
        command
    };
    run.robots.iter().map(command).collect()
}

/// Reads all that a world says at its tick.
pub struct Seen {
    pub sensors: Vec<Sensors>,
    pub robots: Vec<RobotTruth>,
    pub object: ObjectTruth,
}

/// All that `world` says at its tick.
pub fn look(world: &SimulatedWorld) -> Seen {
    let robots = world.robot_count();
    let mut seen = Seen {
        sensors: vec![Sensors::zeroed(); robots],
        robots: vec![RobotTruth::zeroed(); robots],
        object: ObjectTruth::zeroed(),
    };
    for (robot, (sensors, truth)) in seen.sensors.iter_mut().zip(&mut seen.robots).enumerate() {
        world.sense(robot, sensors);
        world.robot_truth(robot, truth);
    }
    world.object_truth(&mut seen.object);
    seen
}

/// The bytes of everything, as a run's identity is made of.
pub fn bytes_of(seen: &Seen) -> Vec<u8> {
    let mut bytes = bytemuck::cast_slice(&seen.sensors).to_vec();
    bytes.extend_from_slice(bytemuck::cast_slice(&seen.robots));
    bytes.extend_from_slice(bytemuck::bytes_of(&seen.object));
    bytes
}

/// Commands under which every joint of every robot swings about its posture, each at its own pace.
pub fn swinging_commands(run: &RunSpec, time_s: f64, amplitude_rad: f64) -> Vec<JointCommand> {
    let mut commands = constant_commands(run);
    for (robot, command) in commands.iter_mut().enumerate() {
        let joints = run.robots[robot].initial_posture_rad.len();
        for joint in 0..joints {
            let rate = 3.0 + 0.7 * joint as f64 + 0.3 * robot as f64;
            command.joint_position_ref_rad[joint] += amplitude_rad * (rate * time_s).sin();
            command.joint_velocity_ref_rad_s[joint] = amplitude_rad * rate * (rate * time_s).cos();
        }
    }
    commands
}

/// Force and moment of a frame.
pub fn wrench(wire: &WrenchWire) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::from_column_slice(&wire[..3]), Vector3::from_column_slice(&wire[3..]))
}

/// A pose of a frame.
pub fn pose(wire: &PoseWire) -> Isometry3<f64> {
    let [x, y, z, qw, qx, qy, qz] = *wire;
    Isometry3::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::new_normalize(Quaternion::new(qw, qx, qy, qz)),
    )
}
