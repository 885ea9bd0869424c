//! Rotation vectors: the logarithm and the exponential of SO(3).

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// `[v]×`, the skew-symmetric matrix with `[v]× w = v × w` (eq. A2).
pub fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// Rotation vector \[rad\] of a rotation, of norm at most π.
///
/// With q = (w, v) and w ≥ 0, φ = 2 atan2(|v|, w) v / |v|: exact at 0 (series below 1e-8) and well
/// conditioned at π, where formulas by arccos of the trace are not. At exactly π the sign of the axis
/// is the quaternion's.
pub fn log(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let q = rotation.quaternion();
    let (w, v) = if q.w < 0.0 { (-q.w, -q.imag()) } else { (q.w, q.imag()) };
    let norm = v.norm();
    // Below 1e-8 the next term of 2 atan2(s, w) / s = 2 / w (1 − s²/3w² …) lies under the last bit.
    let scale = if norm < 1e-8 { 2.0 / w } else { 2.0 * norm.atan2(w) / norm };
    v * scale
}

/// Rotation of a rotation vector \[rad\]: the inverse of [`log`] for norms up to π.
pub fn exp(rotation_vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    let angle = rotation_vector.norm();
    // sin(θ/2)/θ, by its series where θ²/48 lies under the last bit.
    let scale = if angle < 1e-8 { 0.5 } else { (0.5 * angle).sin() / angle };
    let v = rotation_vector * scale;
    UnitQuaternion::new_normalize(Quaternion::new((0.5 * angle).cos(), v.x, v.y, v.z))
}
