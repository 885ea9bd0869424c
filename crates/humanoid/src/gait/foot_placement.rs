//! Where the feet belong under the hands (Fig. 6), and how far they are from there (eq. 40).

use super::ground_pose::{GroundPose, heading, wrap};
use crate::balance::PerFoot;
use mikoshi_spatial::{Hand, Pose, Twist, World};
use nalgebra::{UnitQuaternion, Vector2};
use serde::{Deserialize, Serialize};

/// Most hands of one robot.
pub const MAX_HANDS: usize = 4;

/// The hands' centre on the ground, and how it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HandCentre {
    /// Projection of the mean of the hands' positions; its heading is that of the grasp turned by the
    /// mean of what the hands have turned since.
    pub pose: GroundPose,
    /// \[m/s\].
    pub velocity: Vector2<f64>,
    /// \[rad/s\].
    pub yaw_rate: f64,
}

impl HandCentre {
    /// The centre in `seconds`, if it goes on as it does now.
    pub fn after(&self, seconds: f64) -> GroundPose {
        GroundPose {
            position: self.pose.position + self.velocity * seconds,
            yaw: wrap(self.pose.yaw + self.yaw_rate * seconds),
        }
    }
}

/// d₁, d₂ of Fig. 6, recorded at the grasp: each foot relative to the hands' centre, on the ground.
///
/// Heading comes from the hands' attitudes and not from the line between them: it is defined for one
/// hand, and internal forces that pull a hand by centimetres don't turn the feet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FootPlacement {
    pub(super) hand_rotation_at_grasp: [UnitQuaternion<f64>; MAX_HANDS],
    pub(super) hand_count: usize,
    pub(super) heading_at_grasp: f64,
    pub(super) foot_in_centre: PerFoot<GroundPose>,
}

impl FootPlacement {
    /// Records where `feet` stand under `hands`. `None` without hands, or with more than
    /// [`MAX_HANDS`].
    pub fn record(hands: &[Pose<World, Hand>], feet: &PerFoot<GroundPose>) -> Option<Self> {
        if hands.is_empty() || hands.len() > MAX_HANDS {
            return None;
        }
        let mut hand_rotation_at_grasp = [UnitQuaternion::identity(); MAX_HANDS];
        for (stored, hand) in hand_rotation_at_grasp.iter_mut().zip(hands) {
            *stored = hand.rotation;
        }
        // The centre looks where the feet look: d₁ and d₂ then read as a stance.
        let heading_at_grasp = wrap(feet.right.yaw + wrap(feet.left.yaw - feet.right.yaw) / 2.0);
        let centre = GroundPose { position: mean_position(hands), yaw: heading_at_grasp };
        Some(Self {
            hand_rotation_at_grasp,
            hand_count: hands.len(),
            heading_at_grasp,
            foot_in_centre: PerFoot::from_fn(|side| centre.inverse().then(&feet[side])),
        })
    }

    /// The centre of these hands, in the order of the grasp: of references for reference feet. Hands
    /// past the recorded ones are ignored; without any, the centre can't be known: `None`.
    pub fn centre(&self, hands: &[(Pose<World, Hand>, Twist<World>)]) -> Option<HandCentre> {
        let count = hands.len().min(self.hand_count);
        if count == 0 {
            return None;
        }
        let (mut position, mut velocity) = (Vector2::zeros(), Vector2::zeros());
        let (mut turned, mut yaw_rate) = (0.0, 0.0);
        let mut first_turned = None;
        for ((X_WH, twist), at_grasp) in hands.iter().zip(&self.hand_rotation_at_grasp).take(count) {
            position += X_WH.translation.xy();
            velocity += twist.linear.xy();
            yaw_rate += twist.angular.z;
            let hand_turned = heading(&(X_WH.rotation * at_grasp.inverse()));
            // Next to the first hand's angle, so that ±π doesn't average to nothing.
            let first_turned = *first_turned.get_or_insert(hand_turned);
            turned += first_turned + wrap(hand_turned - first_turned);
        }
        let share = 1.0 / count as f64;
        Some(HandCentre {
            pose: GroundPose {
                position: position * share,
                yaw: wrap(self.heading_at_grasp + turned * share),
            },
            velocity: velocity * share,
            yaw_rate: yaw_rate * share,
        })
    }

    /// Reference feet under a hands' centre.
    pub fn reference_feet(&self, centre: &GroundPose) -> PerFoot<GroundPose> {
        PerFoot::from_fn(|side| centre.then(&self.foot_in_centre[side]))
    }
}

fn mean_position(hands: &[Pose<World, Hand>]) -> Vector2<f64> {
    let sum: Vector2<f64> = hands.iter().map(|hand| hand.translation.xy()).sum();
    sum / hands.len() as f64
}

/// How far a foot is from its reference (eq. 40).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootError {
    /// e_p \[m\].
    pub position: f64,
    /// e_A \[rad\].
    pub yaw: f64,
}

impl FootError {
    /// `e_p = ‖d_r − d_c‖`, `e_A = |ψ_r − ψ_c|` (eq. 40), the angle the short way round.
    pub fn between(reference: &GroundPose, current: &GroundPose) -> Self {
        Self {
            position: (reference.position - current.position).norm(),
            yaw: wrap(reference.yaw - current.yaw).abs(),
        }
    }

    /// The larger of both, each as a multiple of its threshold.
    pub fn relative_to(&self, threshold: &FootError) -> f64 {
        (self.position / threshold.position).max(self.yaw / threshold.yaw)
    }
}
