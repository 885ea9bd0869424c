//! What a servo believes: sensors and commands come from outside.

use mikoshi_humanoid::Model;
use mikoshi_ipc_types::{RobotState, Sensors, TeamCommand};
use mikoshi_spatial::{Hand, Pose, World};
use nalgebra::Vector3;

/// How far beyond its limit an encoder may see a joint.
const JOINT_TOLERANCE_RAD: f64 = 0.5;
/// No joint turns as fast.
const ABSURD_RATE_RAD_S: f64 = 100.0;
/// No foot and no hand feels as much: ten times what the heaviest robot weighs.
const ABSURD_WRENCH: f64 = 1e4;
/// No base is turned or hit like that and goes on.
const ABSURD_GYRO_RAD_S: f64 = 50.0;
const ABSURD_ACCELERATION_M_S2: f64 = 1000.0;
/// How far from where its hand is a robot may be asked to bring it.
const ABSURD_REACH_M: f64 = 0.3;

/// Whether these readings may be those of the robot that `model` describes.
pub(crate) fn are_credible(sensors: &Sensors, model: &Model) -> bool {
    let all_below = |values: &[f64], limit: f64| values.iter().all(|value| value.abs() <= limit);
    let mut angles = model.joints().iter().zip(&sensors.joint_position_rad);
    let are_in_range = angles.all(|(joint, angle)| {
        (joint.lower - JOINT_TOLERANCE_RAD..=joint.upper + JOINT_TOLERANCE_RAD).contains(angle)
    });
    are_in_range
        && all_below(&sensors.joint_velocity_rad_s, ABSURD_RATE_RAD_S)
        && all_below(sensors.wrist_wrench.as_flattened(), ABSURD_WRENCH)
        && all_below(sensors.ankle_wrench.as_flattened(), ABSURD_WRENCH)
        && all_below(&sensors.imu_angular_velocity_rad_s, ABSURD_GYRO_RAD_S)
        && all_below(&sensors.imu_specific_force_m_s2, ABSURD_ACCELERATION_M_S2)
}

/// Whether a robot in this state, with so many hands, may be asked for this.
pub(crate) fn is_credible(command: &TeamCommand, robot: &RobotState, hands: usize) -> bool {
    command.hand_pose_ref.iter().zip(&robot.hand_pose).take(hands).all(|(reference, pose)| {
        let position = |[x, y, z, ..]: [f64; 7]| Vector3::new(x, y, z);
        Pose::<World, Hand>::from_array(reference).is_some()
            && (position(*reference) - position(*pose)).norm() <= ABSURD_REACH_M
    })
}
