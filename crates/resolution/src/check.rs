//! One robot by itself: whether its files fit each other, whether it can stand as it is to carry, and how far its
//! hands reach from there.

use crate::robot::{Ground, carry_pose, standing};
use mikoshi_config::{LoadConfigError, LoadedRobot};
use mikoshi_humanoid::ik::{IkScratch, SettlePostureError};
use mikoshi_humanoid::{FrameId, Kinematics, Model};
use mikoshi_ipc_types::MAX_HANDS;
use mikoshi_robot::Robot;
use mikoshi_spatial::{Hand, Pose, World};
use nalgebra::Vector3;

/// A tick of the search for a posture; the result does not depend on it.
const PERIOD_S: f64 = 0.005;
/// No hand is looked for further away.
const FURTHEST_M: f64 = 0.64;
/// How exactly a reach is known: the furthest, halved eight times.
const HALVINGS: u32 = 8;

/// What a robot comes to.
#[derive(Clone, Debug)]
pub struct CheckedRobot {
    /// Its body, and what its parts are for.
    pub robot: Robot,
    /// How it stands while it carries \[rad or m\], in the order of the model's joints.
    pub posture_rad: Vec<f64>,
    /// How far all its hands can be moved at once from where they carry, along ±x, ±y and ±z of the ground's axes
    /// (x ahead): minus, then plus \[m\].
    pub reach_m: [[f64; 2]; 3],
}

/// Checks a robot's files.
///
/// # Errors
/// What does not fit, with file and line: links, joints, limits, inertias, drives, sensors, the posture to carry in.
pub fn check_robot(loaded: &LoadedRobot) -> Result<CheckedRobot, LoadConfigError> {
    let config = &loaded.config;
    let robot =
        Robot::new(config, &loaded.urdf).map_err(|error| loaded.error_at(&error.key, error.problem))?;
    check_drives(loaded, &robot.model)?;
    check_sensors(loaded, &robot)?;
    let ik = robot.whole_body_ik(PERIOD_S).map_err(|error| loaded.error_at("hands", error.to_string()))?;
    let X_WG = Pose::<World, Ground>::identity();
    let moved = |by: &Vector3<f64>| {
        let mut hands = [None; MAX_HANDS];
        for (target, hand) in hands.iter_mut().zip(&config.hands) {
            let X_WH: Pose<World, Hand> = X_WG * carry_pose(hand);
            *target = Some(Pose::new(X_WH.translation + by, X_WH.rotation));
        }
        hands
    };
    let mut scratch = IkScratch::new(&robot.model);
    let mut settle = |by: &Vector3<f64>| {
        let targets = standing(&X_WG, config, moved(by));
        ik.settle(&robot.model, &mut scratch, &robot.carry_posture_rad, &targets)
    };
    let settled = settle(&Vector3::zeros()).map_err(|error| cant_stand(loaded, &robot, error))?;
    let mut reach = |direction: Vector3<f64>| {
        let (mut near, mut far) = (0.0, FURTHEST_M);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (near + far);
            *(if settle(&(direction * middle)).is_ok() { &mut near } else { &mut far }) = middle;
        }
        near
    };
    let reach_m = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| [reach(-axis), reach(axis)]);
    let posture_rad = settled.joint_position[..robot.model.joint_count()].to_vec();
    Ok(CheckedRobot { robot, posture_rad, reach_m })
}

fn check_drives(loaded: &LoadedRobot, model: &Model) -> Result<(), LoadConfigError> {
    let is_driven = |joint: &str| loaded.config.drive_of(joint).is_some();
    let idle: Vec<_> =
        model.joints().iter().map(|joint| joint.name.as_str()).filter(|joint| !is_driven(joint)).collect();
    if idle.is_empty() {
        return Ok(());
    }
    Err(loaded
        .error_at("drives", format!("found none for {}, expected one for every joint", idle.join(", "))))
}

/// A sensor feels what it carries: palm and sole hang on theirs, and on no other.
fn check_sensors(loaded: &LoadedRobot, robot: &Robot) -> Result<(), LoadConfigError> {
    let model = &robot.model;
    let name = |frame: FrameId| &model.frame(frame).name;
    let hands = robot.palms.iter().zip(&robot.wrist_sensors).enumerate();
    let hands =
        hands.map(|(index, (palm, sensor))| (format!("hands.{index}.sensor_link"), *palm, sensor.frame));
    let feet = robot.soles.into_array().into_iter().zip(robot.ankle_sensors.into_array()).enumerate();
    let feet = feet.map(|(index, (sole, sensor))| (format!("feet.{index}.sensor_link"), sole, sensor.frame));
    let all: Vec<_> = hands.chain(feet).collect();
    for (key, carried, sensor) in &all {
        if !model.is_carried_by(*carried, *sensor) {
            let problem = format!(
                "found {:?}, expected a link that carries {:?} by fixed joints only",
                name(*sensor),
                name(*carried)
            );
            return Err(loaded.error_at(key, problem));
        }
        if let Some((_, _, inner)) =
            all.iter().find(|(other, _, inner)| other != key && model.is_carried_by(*inner, *sensor))
        {
            let problem = format!(
                "found {:?}, expected one that carries no other sensor: it carries {:?}",
                name(*sensor),
                name(*inner)
            );
            return Err(loaded.error_at(key, problem));
        }
    }
    Ok(())
}

/// Where it does not stand as it should, what it would have to be told instead.
fn cant_stand(loaded: &LoadedRobot, robot: &Robot, error: SettlePostureError) -> LoadConfigError {
    match &error {
        SettlePostureError::UnreachableGrasp { hand, .. } => {
            let key = format!("hands.{hand}.carry_position_m");
            loaded.error_at(&key, format!("out of reach: {error}"))
        }
        _ => {
            let (com_m, spacing_m) = as_configured(robot);
            let problem = format!(
                "{error}; by carry_posture_deg the centre of mass is {com_m:.3} m above the right sole, and the soles are {spacing_m:.3} m apart"
            );
            loaded.error_at("com_height_m", problem)
        }
    }
}

/// Height of the centre of mass above the right sole, and the soles' distance, in the posture as it is written.
fn as_configured(robot: &Robot) -> (f64, f64) {
    let mut kinematics = Kinematics::new(&robot.model);
    kinematics.update(&robot.model, &Pose::identity(), &robot.carry_posture_rad);
    let right = kinematics.frame_position(&robot.model, robot.soles.right);
    let left = kinematics.frame_position(&robot.model, robot.soles.left);
    (kinematics.com().z - right.z, (left - right).xy().norm())
}
