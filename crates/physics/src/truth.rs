//! How a robot stands, as it truly is, for observers only.

use mikoshi_humanoid::balance::PerFoot;
use mikoshi_humanoid::estimate::{self, SoleRectangle, SupportPolygon};
use mikoshi_ipc_types::RobotTruth;
use mikoshi_spatial::{Base, Foot, Pose, World, Wrench};
use nalgebra::{Vector2, Vector3};

/// Share of its weight that a foot must bear to count as a support.
const BEARING_SHARE: f64 = 0.05;
/// Margin of a robot that nothing supports: finite, as everything that travels.
const NO_SUPPORT_M: f64 = -1.0;
/// A robot whose base is tilted further has fallen.
const FALLEN_TILT_RAD: f64 = 0.6;
/// A robot whose base is lower than this share of its height at tick 0 has fallen.
const FALLEN_HEIGHT_SHARE: f64 = 0.5;

/// What of a robot matters for how it stands.
#[derive(Clone, Debug)]
pub struct Standing {
    /// Where its soles touch.
    pub soles: PerFoot<SoleRectangle>,
    /// Its weight.
    pub weight_n: f64,
    /// Height of its base at tick 0.
    pub initial_base_height_m: f64,
}

/// Where it is, and what the ground did to it in the last tick.
pub struct Stance {
    /// Its base.
    pub base: Pose<World, Base>,
    /// Its soles.
    pub soles: PerFoot<Pose<World, Foot>>,
    /// Wrench of the ground on each foot about the world's origin, averaged over the tick.
    pub ground: PerFoot<Wrench<World>>,
    /// Its centre of mass.
    pub com_m: Vector3<f64>,
    /// Something else than a foot has touched the floor.
    pub is_on_the_floor: bool,
}

impl Standing {
    /// Writes where the robot is and how it stands. `truth.fallen` stays set.
    pub fn judge(&self, stance: &Stance, truth: &mut RobotTruth) {
        truth.base_pose = stance.base.to_array();
        truth.com_position_m = stance.com_m.into();
        truth.sole_pose = [stance.soles.right, stance.soles.left].map(|pose| pose.to_array());
        truth.ground_wrench = [stance.ground.right, stance.ground.left].map(|wrench| wrench.to_array());
        let (zmp, margin_m) = self.zero_moment_point(stance);
        truth.zmp_position_m = zmp.into();
        truth.zmp_margin_m = margin_m;
        truth.tilt_rad = (stance.base.rotation * Vector3::z()).angle(&Vector3::z());
        let has_fallen = truth.tilt_rad > FALLEN_TILT_RAD
            || stance.base.translation.z < FALLEN_HEIGHT_SHARE * self.initial_base_height_m
            || stance.is_on_the_floor;
        truth.fallen |= u64::from(has_fallen);
    }

    /// Centre of pressure of all ground contact on z = 0, and its distance from the edge of the hull of the
    /// feet that bear. Where none bears, the ground point below the centre of mass, and −1 m.
    fn zero_moment_point(&self, stance: &Stance) -> (Vector2<f64>, f64) {
        let least_force_n = BEARING_SHARE * self.weight_n;
        let ground = stance.ground.right + stance.ground.left;
        let point =
            estimate::zero_moment_point(&ground, 0.0, least_force_n).unwrap_or_else(|| stance.com_m.xy());
        let bearing = PerFoot::from_fn(|side| {
            (stance.ground[side].force.z > least_force_n).then_some(stance.soles[side])
        });
        let support = SupportPolygon::of_feet(&self.soles, &bearing);
        (point, support.signed_distance(&point).max(NO_SUPPORT_M))
    }
}
