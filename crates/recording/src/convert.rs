//! Numbers of ours in the words of the schemas.

use foxglove::messages::{Color, Point3, Pose, Quaternion, Timestamp, Vector3};
use mikoshi_spatial::{CoordinateFrame, World};
use nalgebra::{Isometry3, UnitQuaternion};

const NS_PER_S: u64 = 1_000_000_000;

/// A time of the run; it begins at zero.
pub fn timestamp(time_ns: u64) -> Timestamp {
    let (s, ns) = (time_ns / NS_PER_S, time_ns % NS_PER_S);
    // Less than a billion: it fits.
    Timestamp::new(u32::try_from(s).unwrap_or(u32::MAX), ns as u32)
}

pub fn vector(v: &nalgebra::Vector3<f64>) -> Vector3 {
    Vector3 { x: v.x, y: v.y, z: v.z }
}

/// Three numbers of a twist or a wrench as it travels, from this one on: 0 or 3.
pub fn half(six: &[f64; 6], first: usize) -> Vector3 {
    Vector3 { x: six[first], y: six[first + 1], z: six[first + 2] }
}

pub fn point(v: &nalgebra::Vector3<f64>) -> Point3 {
    Point3 { x: v.x, y: v.y, z: v.z }
}

pub fn quaternion(q: &UnitQuaternion<f64>) -> Quaternion {
    Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }
}

pub fn pose(X: &Isometry3<f64>) -> Pose {
    Pose { position: Some(vector(&X.translation.vector)), orientation: Some(quaternion(&X.rotation)) }
}

/// A pose as it travels; none if it is none, as before anybody has said one.
pub fn isometry(array: &[f64; 7]) -> Option<Isometry3<f64>> {
    /// Whatever the pose leads to.
    #[derive(Clone, Copy, Debug)]
    enum Any {}
    impl CoordinateFrame for Any {}
    let X = mikoshi_spatial::Pose::<World, Any>::from_array(array)?;
    Some(Isometry3::from_parts(X.translation.into(), X.rotation))
}

pub fn color([r, g, b, a]: [f64; 4]) -> Color {
    Color { r, g, b, a }
}
