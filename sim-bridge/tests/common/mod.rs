//! Teams that stand in the carry posture, made without the services that make them for a real run.

#![allow(dead_code)] // Each test uses its part.

use mikoshi_config::load_scenario;
use mikoshi_config::{RobotSpec, RunSpec};
use mikoshi_humanoid::{Kinematics, Model};
use mikoshi_ipc_types::{JointCommand, MAX_JOINTS};
use mikoshi_spatial::{Base, Foot, Hand, Object, Pose, World};
use nalgebra::{UnitQuaternion, Vector3};
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
    RunSpec { ticks: scenario.ticks(), scenario, robots }
}

fn about_z(degrees: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(0.0, 0.0, degrees.to_radians())
}

/// Commands that hold the postures of tick 0.
pub fn constant_commands(run: &RunSpec) -> Vec<JointCommand> {
    let command = |robot: &RobotSpec| {
        let mut command = JointCommand {
            joint_position_ref_rad: [0.0; MAX_JOINTS],
            joint_velocity_ref_rad_s: [0.0; MAX_JOINTS],
            team_command_tick: 0,
        };
        command.joint_position_ref_rad[..robot.initial_posture_rad.len()]
            .copy_from_slice(&robot.initial_posture_rad);
        command
    };
    run.robots.iter().map(command).collect()
}
