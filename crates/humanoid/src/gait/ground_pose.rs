//! Poses on the ground.

use core::f64::consts::{PI, TAU};
use mikoshi_spatial::{CoordinateFrame, Pose, World};
use nalgebra::{Rotation2, UnitQuaternion, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// The projection of a pose to the ground plane: position and heading. As a rigid motion of the
/// plane it composes like any pose: `X_AC = X_AB.then(X_BC)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GroundPose {
    /// \[m\].
    pub position: Vector2<f64>,
    /// Heading in (−π, π] \[rad\].
    pub yaw: f64,
}

impl GroundPose {
    /// From its parts; the heading is brought into (−π, π].
    pub fn new(x: f64, y: f64, yaw: f64) -> Self {
        Self { position: Vector2::new(x, y), yaw: wrap(yaw) }
    }

    /// The projection of a pose.
    pub fn of<F: CoordinateFrame>(X_WF: &Pose<World, F>) -> Self {
        Self { position: X_WF.translation.xy(), yaw: heading(&X_WF.rotation) }
    }

    /// Upright at `height` \[m\] over the plane.
    pub fn at_height<F: CoordinateFrame>(&self, height: f64) -> Pose<World, F> {
        Pose::new(
            Vector3::new(self.position.x, self.position.y, height),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw),
        )
    }

    /// `X_AC` of `self` = X_AB and `next` = X_BC.
    pub fn then(&self, next: &Self) -> Self {
        Self { position: self.point(&next.position), yaw: wrap(self.yaw + next.yaw) }
    }

    /// X_BA.
    pub fn inverse(&self) -> Self {
        Self { position: Rotation2::new(-self.yaw) * -self.position, yaw: wrap(-self.yaw) }
    }

    /// A point given in B, in A.
    pub fn point(&self, p_B: &Vector2<f64>) -> Vector2<f64> {
        self.position + Rotation2::new(self.yaw) * p_B
    }
}

/// The angle in (−π, π] \[rad\].
pub fn wrap(angle: f64) -> f64 {
    let remainder = (angle + PI).rem_euclid(TAU) - PI;
    if remainder <= -PI { PI } else { remainder }
}

/// Heading of a rotation \[rad\]: the twist about z of its swing-twist decomposition, which unlike an
/// Euler angle is defined at any pitch but upside down (there it is 0).
pub fn heading(rotation: &UnitQuaternion<f64>) -> f64 {
    let q = rotation.quaternion();
    wrap(2.0 * q.k.atan2(q.w))
}
