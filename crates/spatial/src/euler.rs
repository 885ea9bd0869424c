//! Z-Y-X Euler angles, for display and for comparison with the paper; nothing is controlled in them.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// `(α, β, γ)` = yaw, pitch, roll \[rad\] with R = Rz(α) Ry(β) Rx(γ).
pub fn euler_zyx(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let (roll, pitch, yaw) = rotation.euler_angles();
    Vector3::new(yaw, pitch, roll)
}

/// B₀ (eq. B1): ω = B₀ (α̇, β̇, γ̇)ᵀ for Z-Y-X Euler angles. Singular at β = ±π/2.
#[rustfmt::skip]
pub fn euler_rate_matrix(yaw_rad: f64, pitch_rad: f64) -> Matrix3<f64> {
    let ((sa, ca), (sb, cb)) = (yaw_rad.sin_cos(), pitch_rad.sin_cos());
    Matrix3::new(
        0.0, -sa, ca * cb,
        0.0,  ca, sa * cb,
        1.0, 0.0, -sb,
    )
}
