//! Rigid poses between two coordinate frames.

use crate::{CoordinateFrame, Twist, finite::are_finite, rotation};
use core::marker::PhantomData;
use core::ops::Mul;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// `X_AB`: the pose of `B` in `A`. `p_A = R_AB p_B + p_AB_A`.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Pose<A: CoordinateFrame, B: CoordinateFrame> {
    /// Rotation from axes of `B` to axes of `A`.
    pub rotation: UnitQuaternion<f64>,
    /// Origin of `B` in `A` \[m\].
    pub translation: Vector3<f64>,
    #[serde(skip)]
    frames: PhantomData<(A, B)>,
}

// By hand: derives would ask the marker types for the same.
impl<A: CoordinateFrame, B: CoordinateFrame> Clone for Pose<A, B> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<A: CoordinateFrame, B: CoordinateFrame> Copy for Pose<A, B> {}
impl<A: CoordinateFrame, B: CoordinateFrame> PartialEq for Pose<A, B> {
    fn eq(&self, other: &Self) -> bool {
        self.rotation == other.rotation && self.translation == other.translation
    }
}

impl<A: CoordinateFrame, B: CoordinateFrame> Pose<A, B> {
    /// From its parts.
    pub fn new(translation: Vector3<f64>, rotation: UnitQuaternion<f64>) -> Self {
        Self { rotation, translation, frames: PhantomData }
    }

    /// `B` coincides with `A`.
    pub fn identity() -> Self {
        Self::new(Vector3::zeros(), UnitQuaternion::identity())
    }

    /// `X_BA`.
    pub fn inverse(&self) -> Pose<B, A> {
        let rotation = self.rotation.inverse();
        Pose::new(-(rotation * self.translation), rotation)
    }

    /// A point given in `B`, in `A`.
    pub fn transform_point(&self, p_B: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * p_B + self.translation
    }

    /// The same pose under other names, where a definition says that they coincide.
    pub fn relabel<C: CoordinateFrame, D: CoordinateFrame>(&self) -> Pose<C, D> {
        Pose::new(self.translation, self.rotation)
    }

    /// What leads from `self` to `other`, in axes of `A`: translation difference, and the rotation
    /// vector of `other.rotation · self.rotation⁻¹`. The inverse of [`Pose::displaced`].
    pub fn displacement_to(&self, other: &Self) -> Twist<A> {
        Twist::new(
            other.translation - self.translation,
            rotation::log(&(other.rotation * self.rotation.inverse())),
        )
    }

    /// Moved by a small displacement in axes of `A`: translation added, rotation vector applied on the
    /// left.
    pub fn displaced(&self, displacement: &Twist<A>) -> Self {
        let mut rotation = rotation::exp(&displacement.angular) * self.rotation;
        rotation.renormalize_fast();
        Self::new(self.translation + displacement.linear, rotation)
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        are_finite(&self.translation) & are_finite(&self.rotation.coords)
    }

    /// `[x, y, z, qw, qx, qy, qz]`.
    pub fn to_array(&self) -> [f64; 7] {
        let (p, q) = (&self.translation, self.rotation.quaternion());
        [p.x, p.y, p.z, q.w, q.i, q.j, q.k]
    }

    /// From `[x, y, z, qw, qx, qy, qz]`; `None` unless all are finite and the quaternion's norm is
    /// within 1e-6 of one. What [`Pose::to_array`] made of a pose comes back bit by bit.
    pub fn from_array(array: &[f64; 7]) -> Option<Self> {
        let [x, y, z, qw, qx, qy, qz] = *array;
        let quaternion = Quaternion::new(qw, qx, qy, qz);
        let excess = quaternion.norm() - 1.0;
        let is_valid = are_finite(array) & (excess.abs() < 1e-6);
        // Normalising what is normalised would change its last bits, and a pose that is stored and read
        // every tick would wander.
        let rotation = if excess.abs() <= 4.0 * f64::EPSILON {
            UnitQuaternion::new_unchecked(quaternion)
        } else {
            UnitQuaternion::new_normalize(quaternion)
        };
        is_valid.then(|| Self::new(Vector3::new(x, y, z), rotation))
    }
}

impl<A: CoordinateFrame, B: CoordinateFrame, C: CoordinateFrame> Mul<Pose<B, C>> for Pose<A, B> {
    type Output = Pose<A, C>;

    /// `X_AC = X_AB X_BC`.
    fn mul(self, X_BC: Pose<B, C>) -> Pose<A, C> {
        let mut rotation = self.rotation * X_BC.rotation;
        rotation.renormalize_fast();
        Pose::new(self.transform_point(&X_BC.translation), rotation)
    }
}
