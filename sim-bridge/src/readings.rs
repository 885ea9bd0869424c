//! What a robot's sensors read: the truth; noise comes later.

use crate::layout::{ForceTorqueLayout, RobotLayout};
use crate::tally::Tally;
use mikoshi_ipc_types::{Sensors, WrenchWire};
use mujoco_rs::prelude::{MjData, MjModel};

/// Reads a robot's sensors as they are. Positions, rates and gyroscope are of now; wrenches and the
/// accelerometer are of the last physics step, unfiltered; torques are averaged over the last tick.
pub fn read(data: &MjData<Box<MjModel>>, layout: &RobotLayout, tally: &Tally, sensors: &mut Sensors) {
    let (qpos, qvel, raw) = (data.qpos(), data.qvel(), data.sensordata());
    for (index, joint) in layout.joints.iter().enumerate() {
        sensors.joint_position_rad[index] = qpos[joint.qpos];
        sensors.joint_velocity_rad_s[index] = qvel[joint.dof];
        sensors.joint_torque_nm[index] = tally.mean_torque_nm(index);
    }
    let wrench = |at: &ForceTorqueLayout| -> WrenchWire {
        core::array::from_fn(|i| if i < 3 { raw[at.force + i] } else { raw[at.torque + i - 3] })
    };
    for (reading, hand) in sensors.wrist_wrench.iter_mut().zip(&layout.hands) {
        *reading = wrench(&hand.sensor);
    }
    for (reading, foot) in sensors.ankle_wrench.iter_mut().zip(&layout.feet) {
        *reading = wrench(&foot.sensor);
    }
    sensors.imu_angular_velocity_rad_s.copy_from_slice(&raw[layout.gyro..][..3]);
    sensors.imu_specific_force_m_s2.copy_from_slice(&raw[layout.accelerometer..][..3]);
}
