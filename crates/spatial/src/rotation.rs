//! Rotation vectors: the logarithm and the exponential of SO(3).

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Squares below this have series of five terms that are exact to the last bit.
const SMALL: f64 = 1e-4;

/// `[v]×`, the skew-symmetric matrix with `[v]× w = v × w` (eq. A2).
pub fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// Rotation vector \[rad\] of a rotation, of norm at most π.
///
/// With q = (w, v) and w ≥ 0, φ = 2 atan2(|v|, w) v / |v|: exact at 0 and well conditioned at π, where
/// formulas by arccos of the trace are not. At exactly π the sign of the axis is the quaternion's. Small
/// rotations, which a tick has many of, take the series of the arctangent to the last bit.
#[inline]
pub fn log(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let q = rotation.quaternion();
    let (w, v) = if q.w < 0.0 { (-q.w, -q.imag()) } else { (q.w, q.imag()) };
    let tangent_squared = v.norm_squared() / (w * w);
    let scale = if tangent_squared < SMALL {
        let t = tangent_squared;
        2.0 / w * (1.0 - t * (1.0 / 3.0 - t * (1.0 / 5.0 - t * (1.0 / 7.0 - t * (1.0 / 9.0)))))
    } else {
        let norm = v.norm();
        2.0 * norm.atan2(w) / norm
    };
    v * scale
}

/// Rotation of a rotation vector \[rad\]: the inverse of [`log`] for norms up to π.
#[inline]
pub fn exp(rotation_vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    let angle_squared = rotation_vector.norm_squared();
    // cos(θ/2) and sin(θ/2)/θ.
    if angle_squared < SMALL {
        let h = 0.25 * angle_squared;
        let cosine = 1.0 - h * (1.0 / 2.0 - h * (1.0 / 24.0 - h * (1.0 / 720.0 - h * (1.0 / 40_320.0))));
        let v = rotation_vector * (0.5 - h * (1.0 / 12.0 - h * (1.0 / 240.0 - h * (1.0 / 10_080.0))));
        UnitQuaternion::new_unchecked(Quaternion::new(cosine, v.x, v.y, v.z))
    } else {
        let angle = angle_squared.sqrt();
        let (sine, cosine) = (0.5 * angle).sin_cos();
        let v = rotation_vector * (sine / angle);
        UnitQuaternion::new_normalize(Quaternion::new(cosine, v.x, v.y, v.z))
    }
}
