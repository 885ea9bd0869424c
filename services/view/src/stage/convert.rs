//! Numbers of ours in Rerun's words.

use mikoshi_spatial::{CoordinateFrame, Pose};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use re_sdk_types::archetypes::Transform3D;
use re_sdk_types::datatypes::Quaternion;

pub fn vector(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

pub fn quaternion(q: &UnitQuaternion<f64>) -> Quaternion {
    Quaternion::from_xyzw([q.i as f32, q.j as f32, q.k as f32, q.w as f32])
}

pub fn isometry<A: CoordinateFrame, B: CoordinateFrame>(X: &Pose<A, B>) -> Isometry3<f64> {
    Isometry3::from_parts(X.translation.into(), X.rotation)
}

pub fn transform(X: &Isometry3<f64>) -> Transform3D {
    Transform3D::from_translation(vector(&X.translation.vector)).with_quaternion(quaternion(&X.rotation))
}
