//! What a servo believes: sensors and commands come from outside.

use mikoshi_humanoid::Model;
use mikoshi_ipc_types::{PoseWire, RobotState, Sensors, TeamCommand};
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
const ABSURD_REACH_M: f64 = 1.0;
/// How far that may move in a tick; twenty metres a second are a mistake.
const ABSURD_STEP_M: f64 = 0.1;

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

/// Whether a robot in this state, with so many hands, may be asked for this after `last`.
pub(crate) fn is_credible(
    command: &TeamCommand,
    last: Option<&TeamCommand>,
    robot: &RobotState,
    hands: usize,
) -> bool {
    let gap = |(one, other): (&PoseWire, &PoseWire)| {
        let position = |[x, y, z, ..]: PoseWire| Vector3::new(x, y, z);
        (position(*one) - position(*other)).norm()
    };
    let mut references = command.hand_pose_ref.iter().take(hands);
    let are_poses = references.all(|pose| Pose::<World, Hand>::from_array(pose).is_some());
    let are_in_reach = command
        .hand_pose_ref
        .iter()
        .zip(&robot.hand_pose)
        .take(hands)
        .all(|pair| gap(pair) <= ABSURD_REACH_M);
    let are_continuous = last.is_none_or(|last| {
        command
            .hand_pose_ref
            .iter()
            .zip(&last.hand_pose_ref)
            .take(hands)
            .all(|pair| gap(pair) <= ABSURD_STEP_M)
    });
    are_poses && are_in_reach && are_continuous
}
