//! Virtual sticks: from a hand to the object's reference point (fig. 2, appendix A).

use mikoshi_spatial::{Hand, Object, Pose, Tip, Twist, World, Wrench};
use nalgebra::Vector3;

/// The stick that the grasp fixes to a hand. Its tip B coincides with the object's frame A at the grasp
/// and then moves with the hand: when the object deforms or a grasp gives way, tips part from A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualStick {
    /// Pose of the tip in the hand.
    pub X_HB: Pose<Hand, Tip>,
}

impl VirtualStick {
    /// Recorded when hand H grasps object A.
    pub fn at_grasp(X_WH: &Pose<World, Hand>, X_WA: &Pose<World, Object>) -> Self {
        Self::from_hand_in_object(&(X_WA.inverse() * *X_WH))
    }

    /// From the pose of the hand in the object at the grasp.
    pub fn from_hand_in_object(X_AH: &Pose<Object, Hand>) -> Self {
        // At the grasp B coincides with A, so X_HB = X_HA.
        Self { X_HB: X_AH.inverse().relabel() }
    }

    /// Pose of the tip, `X_WB = X_WH X_HB`.
    pub fn tip_pose(&self, X_WH: &Pose<World, Hand>) -> Pose<World, Tip> {
        *X_WH * self.X_HB
    }

    /// The paper's ᵒl: from the hand's origin to the tip, in world axes \[m\].
    pub fn vector(&self, X_WH: &Pose<World, Hand>) -> Vector3<f64> {
        X_WH.rotation * self.X_HB.translation
    }

    /// Wrench at the tip of the wrench that the hand applies to the object at its origin (eq. A1):
    /// `f_b = f_h`, `n_b = n_h − l × f_h`, in world axes.
    pub fn tip_wrench(&self, X_WH: &Pose<World, Hand>, f_H_W: &Wrench<World>) -> Wrench<World> {
        f_H_W.shifted(&-self.vector(X_WH))
    }

    /// The inverse of [`VirtualStick::tip_wrench`].
    pub fn hand_wrench(&self, X_WH: &Pose<World, Hand>, f_B_W: &Wrench<World>) -> Wrench<World> {
        f_B_W.shifted(&self.vector(X_WH))
    }

    /// Small displacement of the hand that displaces the tip as given: `δx_h = δx_b − δφ × l`,
    /// `δφ_h = δφ`, in world axes. The dual of eq. A1: both do the same work.
    pub fn hand_displacement(&self, X_WH: &Pose<World, Hand>, tip: &Twist<World>) -> Twist<World> {
        tip.shifted(&-self.vector(X_WH))
    }
}
