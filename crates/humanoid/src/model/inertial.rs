//! Mass, centre of mass and inertia of a rigid body.

use mikoshi_spatial::skew;
use nalgebra::{Isometry3, Matrix3, Vector3};

/// Mass distribution of a rigid body in some coordinate frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertial {
    /// Mass \[kg\].
    pub mass_kg: f64,
    /// Centre of mass in the frame \[m\].
    pub com: Vector3<f64>,
    /// Inertia about the centre of mass, in the frame's axes \[kg m²\].
    pub inertia: Matrix3<f64>,
}

impl Inertial {
    /// No mass.
    pub fn zero() -> Self {
        Self { mass_kg: 0.0, com: Vector3::zeros(), inertia: Matrix3::zeros() }
    }

    /// The same distribution in frame A, given in B, with `X_AB` the pose of B in A.
    #[allow(non_snake_case)]
    pub fn transformed(&self, X_AB: &Isometry3<f64>) -> Self {
        let R_AB = X_AB.rotation.to_rotation_matrix();
        Self {
            mass_kg: self.mass_kg,
            com: X_AB.rotation * self.com + X_AB.translation.vector,
            inertia: R_AB.matrix() * self.inertia * R_AB.matrix().transpose(),
        }
    }

    /// Both bodies as one rigid body, by the parallel axis theorem.
    pub fn combined(&self, other: &Self) -> Self {
        let mass_kg = self.mass_kg + other.mass_kg;
        if mass_kg == 0.0 {
            return Self::zero();
        }
        let com = (self.com * self.mass_kg + other.com * other.mass_kg) / mass_kg;
        let about_com = |part: &Self| {
            let d = skew(&(part.com - com));
            part.inertia - d * d * part.mass_kg
        };
        Self { mass_kg, com, inertia: about_com(self) + about_com(other) }
    }
}
