//! Between Rapier's vectors and ours.

use mikoshi_spatial::{CoordinateFrame, Pose, Wrench};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use rapier3d_f64::math;

pub fn vector(v: &Vector3<f64>) -> math::Vector {
    math::Vector::new(v.x, v.y, v.z)
}

pub fn from_vector(v: math::Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

pub fn matrix(m: &Matrix3<f64>) -> math::Matrix {
    math::Matrix::from_cols(
        vector(&m.column(0).into_owned()),
        vector(&m.column(1).into_owned()),
        vector(&m.column(2).into_owned()),
    )
}

pub fn isometry(X: &Isometry3<f64>) -> math::Pose {
    let q = X.rotation;
    math::Pose::from_parts(vector(&X.translation.vector), math::Rotation::from_xyzw(q.i, q.j, q.k, q.w))
}

pub fn from_isometry(X: &math::Pose) -> Isometry3<f64> {
    let q = X.rotation;
    Isometry3::from_parts(
        from_vector(X.translation).into(),
        UnitQuaternion::new_normalize(nalgebra::Quaternion::new(q.w, q.x, q.y, q.z)),
    )
}

pub fn pose<A: CoordinateFrame, B: CoordinateFrame>(X: &Isometry3<f64>) -> Pose<A, B> {
    Pose::new(X.translation.vector, X.rotation)
}

/// Force and torque about the same point, as Rapier wants them.
pub fn force_and_torque<F: CoordinateFrame>(wrench: &Wrench<F>) -> (math::Vector, math::Vector) {
    (vector(&wrench.force), vector(&wrench.moment))
}
