//! Poses and velocities out of the simulator's arrays.

use crate::layout::BodyLayout;
use mikoshi_spatial::{CoordinateFrame, Pose, Twist, World};
use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// A site in the world.
pub fn site_pose<F: CoordinateFrame>(data: &MjData<Box<MjModel>>, site: usize) -> Pose<World, F> {
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(&data.site_xmat()[site]));
    Pose::new(Vector3::from(data.site_xpos()[site]), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// The twist of a site, at its origin.
pub fn site_twist(data: &MjData<Box<MjModel>>, site: usize) -> Twist<World> {
    let [wx, wy, wz, vx, vy, vz] = data.object_velocity(MjtObjBase::mjOBJ_SITE, site, false);
    Twist::new(Vector3::new(vx, vy, vz), Vector3::new(wx, wy, wz))
}

/// A body on a free joint.
pub fn body_pose<F: CoordinateFrame>(data: &MjData<Box<MjModel>>, body: &BodyLayout) -> Pose<World, F> {
    let [qw, qx, qy, qz] = data.xquat()[body.body];
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(qw, qx, qy, qz));
    Pose::new(Vector3::from(data.xpos()[body.body]), rotation)
}

/// The twist of a body on a free joint, at its origin.
pub fn body_twist<F: CoordinateFrame>(data: &MjData<Box<MjModel>>, body: &BodyLayout) -> Twist<World> {
    let velocity = &data.qvel()[body.dof..][..6];
    let X_WF = body_pose::<F>(data, body);
    Twist::new(
        Vector3::from_column_slice(&velocity[..3]),
        // A free joint's angular velocity is in the body's axes.
        X_WF.rotation * Vector3::from_column_slice(&velocity[3..]),
    )
}
