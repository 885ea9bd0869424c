//! What the ground under a foot is tilted by, as a robot feels that stands on it.

use super::PerFoot;
use crate::estimate::SoleRectangle;
use mikoshi_spatial::{Base, Foot, Pose, World, Wrench};
use nalgebra::{Vector2, Vector3};

/// Tilts of soles to ground that is not level.
///
/// Drives are stiff: a sole that is commanded level and comes to lie flat on inclined ground takes the whole body with it.
/// How the base leans against its command is then how the ground is tilted, and a sole that is commanded to be so tilted has
/// the body upright again. A foot that tips over its edge leans the body as well, but bears at that edge. Where a foot
/// stands on the edge of something, the stabiliser tilts it until it bears where it should, and would forget that tilt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundTilt {
    /// Soles in their feet's frames.
    pub soles: PerFoot<SoleRectangle>,
    /// Lean within which the ground is level: drives and soles yield by so much \[rad\].
    pub tolerance_rad: f64,
    /// By how much a sole yields to ground that is level \[rad\].
    pub yield_rad: f64,
    /// Time constant in which a standing sole follows \[s\].
    pub follow_s: f64,
    /// Largest tilt \[rad\].
    pub max_rad: f64,
    /// Share of the way from a sole's middle to its edge within which it bears flat.
    pub flat_share: f64,
    /// Least force of a foot that bears \[N\].
    pub least_force_n: f64,
}

impl GroundTilt {
    /// For a robot of this weight on these soles.
    pub fn standard(soles: PerFoot<SoleRectangle>, weight_n: f64) -> Self {
        Self {
            soles,
            tolerance_rad: 0.012,
            yield_rad: 0.008,
            follow_s: 0.3,
            max_rad: 0.12,
            flat_share: 0.75,
            least_force_n: 0.3 * weight_n,
        }
    }

    /// How the base leans against its command, beyond what is tolerated: a rotation vector about horizontal axes.
    pub fn lean(&self, measured: &Pose<World, Base>, commanded: &Pose<World, Base>) -> Vector2<f64> {
        let lean = commanded.displacement_to(measured).angular.xy();
        let angle = lean.norm();
        if angle <= self.tolerance_rad { Vector2::zeros() } else { lean * (1.0 - self.tolerance_rad / angle) }
    }

    /// One tick of `dt` \[s\] of a foot that stands, of which `share` of the robot's stand depends.
    pub fn follow(
        &self,
        tilt: &mut Vector3<f64>,
        lean: &Vector2<f64>,
        sole: &SoleRectangle,
        foot: &Pose<World, Foot>,
        ground_wrench: &Wrench<World>,
        (share, dt): (f64, f64),
    ) {
        let force = ground_wrench.force.z;
        if *lean == Vector2::zeros() || force < self.least_force_n {
            return;
        }
        let moment = foot.rotation.inverse() * ground_wrench.moment;
        let pressure = Vector2::new(-moment.y, moment.x) / force;
        let is_within = |at: f64, min: f64, max: f64| {
            ((at - (min + max) / 2.0) / ((max - min) / 2.0)).abs() < self.flat_share
        };
        if is_within(pressure.x, sole.x_min, sole.x_max) && is_within(pressure.y, sole.y_min, sole.y_max) {
            *tilt += lean.push(0.0) * (share * dt / self.follow_s);
            *tilt = tilt.cap_magnitude(self.max_rad);
        }
    }

    /// One tick of a foot that stands, whose sole the stabiliser has tilted by so much about its own axes \[rad\]: what of it
    /// is more than level ground asks for is the ground's.
    pub fn learn(
        &self,
        tilt: &mut Vector3<f64>,
        sole_tilt: &Vector2<f64>,
        foot: &Pose<World, Foot>,
        dt: f64,
    ) {
        let beyond = sole_tilt.map(|angle| angle - angle.clamp(-self.yield_rad, self.yield_rad));
        if beyond != Vector2::zeros() {
            *tilt += foot.rotation * beyond.push(0.0) * (dt / self.follow_s);
            *tilt = tilt.cap_magnitude(self.max_rad);
        }
    }
}
