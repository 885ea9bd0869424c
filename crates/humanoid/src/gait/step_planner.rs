//! From where the feet are and where they belong to the next foothold.

use super::ground_pose::{GroundPose, wrap};
use crate::balance::{PerFoot, Side};
use crate::estimate::SoleRectangle;
use nalgebra::Vector2;

/// How far one step may go, relative to the stance foot, and the soles that must not meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLimits {
    /// Ahead and back \[m\].
    pub reach_m: f64,
    /// Least lateral distance of the feet's origins while parallel \[m\].
    pub lateral_min_m: f64,
    /// Greatest lateral distance of the feet's origins \[m\].
    pub lateral_max_m: f64,
    /// Heading against the stance foot, either way \[rad\].
    pub yaw_rad: f64,
    /// Soles in their feet's frames.
    pub soles: PerFoot<SoleRectangle>,
}

impl StepLimits {
    /// .22 m ahead and back, .145 to .28 m aside, .25 rad.
    pub fn standard(soles: PerFoot<SoleRectangle>) -> Self {
        Self { reach_m: 0.22, lateral_min_m: 0.145, lateral_max_m: 0.28, yaw_rad: 0.25, soles }
    }

    /// The foothold of foot `swing` nearest to `desired` within reach of `stance`: heading first, then
    /// length, then width.
    ///
    /// Never crosses: the nearest corner of the turned sole stays as far outside the stance foot's inner
    /// edge as it does for parallel feet at `lateral_min_m`.
    pub fn foothold(&self, swing: Side, stance: &GroundPose, desired: &GroundPose) -> GroundPose {
        let wished = stance.inverse().then(desired);
        let yaw = wished.yaw.clamp(-self.yaw_rad, self.yaw_rad);
        let x = wished.position.x.clamp(-self.reach_m, self.reach_m);
        let lateral_min = self.lateral_min_m + self.inward(swing, yaw) - self.inward(swing, 0.0);
        let outwards = wished.position.y * swing.sign();
        let lateral = outwards.max(lateral_min).min(self.lateral_max_m.max(lateral_min));
        stance.then(&GroundPose { position: Vector2::new(x, lateral * swing.sign()), yaw })
    }

    /// How far the sole of foot `side` reaches inwards of its origin when turned by `yaw` \[m\].
    fn inward(&self, side: Side, yaw: f64) -> f64 {
        let SoleRectangle { x_min, x_max, y_min, y_max } = self.soles[side];
        let (sin, cos) = yaw.sin_cos();
        let inner = if side == Side::Left { y_min } else { y_max };
        [x_min, x_max].map(|x| -side.sign() * (x * sin + inner * cos)).into_iter().fold(f64::MIN, f64::max)
    }

    /// The foot that had better swing first: the one after whose step, within the limits, both feet
    /// would be nearer to `reference`; of equals, right.
    ///
    /// So the foot on the side of a lateral motion or turn leads, where the other one would be stopped
    /// by it.
    pub fn first_swing(&self, feet: &PerFoot<GroundPose>, reference: &PerFoot<GroundPose>) -> Side {
        let remaining = |swing: Side| {
            let stance = swing.opposite();
            let foothold = self.foothold(swing, &feet[stance], &reference[swing]);
            self.distance(&foothold, &reference[swing]) + self.distance(&feet[stance], &reference[stance])
        };
        if remaining(Side::Left) + 1e-9 < remaining(Side::Right) { Side::Left } else { Side::Right }
    }

    /// One number for position and heading, which a sole's half length makes comparable \[m\].
    fn distance(&self, a: &GroundPose, b: &GroundPose) -> f64 {
        let half_length = (self.soles.right.x_max - self.soles.right.x_min) / 2.0;
        (a.position - b.position).norm() + wrap(a.yaw - b.yaw).abs() * half_length
    }
}
