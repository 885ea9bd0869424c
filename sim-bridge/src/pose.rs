//! Poses and velocities out of the simulator's arrays.

use crate::layout::BodyLayout;
use mikoshi_ipc_types::PoseWire;
use mikoshi_spatial::{Twist, World};
use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase};
use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A site in the world.
pub fn site_pose(data: &MjData<Box<MjModel>>, site: usize) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(&data.site_xmat()[site]));
    Isometry3::from_parts(
        Translation3::from(data.site_xpos()[site]),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

/// Linear and angular velocity of a site, in world axes.
pub fn site_velocity(data: &MjData<Box<MjModel>>, site: usize) -> [Vector3<f64>; 2] {
    let [wx, wy, wz, vx, vy, vz] = data.object_velocity(MjtObjBase::mjOBJ_SITE, site, false);
    [Vector3::new(vx, vy, vz), Vector3::new(wx, wy, wz)]
}

/// A body on a free joint.
pub fn body_pose(data: &MjData<Box<MjModel>>, body: &BodyLayout) -> Isometry3<f64> {
    let [qw, qx, qy, qz] = data.xquat()[body.body];
    Isometry3::from_parts(
        Translation3::from(data.xpos()[body.body]),
        UnitQuaternion::new_normalize(Quaternion::new(qw, qx, qy, qz)),
    )
}

/// The twist of a body on a free joint, at its origin.
pub fn free_body_twist(data: &MjData<Box<MjModel>>, body: &BodyLayout) -> Twist<World> {
    let velocity = &data.qvel()[body.dof..][..6];
    Twist::new(
        Vector3::from_column_slice(&velocity[..3]),
        // A free joint's angular velocity is in the body's axes.
        body_pose(data, body).rotation * Vector3::from_column_slice(&velocity[3..]),
    )
}

/// `[x, y, z, qw, qx, qy, qz]`.
pub fn wire(pose: &Isometry3<f64>) -> PoseWire {
    let (p, q) = (&pose.translation, pose.rotation.quaternion());
    [p.x, p.y, p.z, q.w, q.i, q.j, q.k]
}
