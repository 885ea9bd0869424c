//! From one zero moment point to a load for each foot.

use super::nearest::nearest_in_sole;
use super::{PerFoot, Side};
use crate::estimate::SoleRectangle;
use mikoshi_spatial::{Foot, Pose, World};
use nalgebra::{Vector2, Vector3};

/// What one foot shall bear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootLoad {
    /// Vertical force \[N\].
    pub force: f64,
    /// Its centre of pressure \[m, world\]. Where a foot bears nothing, its rest point.
    pub zmp: Vector2<f64>,
}

impl FootLoad {
    /// Moment about horizontal axes through `origin` on the sole \[Nm, world\]:
    /// `(z − p) × f = (Δy fz, −Δx fz)`.
    pub fn moment_about(&self, origin: &Vector2<f64>) -> Vector2<f64> {
        let arm = self.zmp - origin;
        Vector2::new(arm.y, -arm.x) * self.force
    }
}

/// Distributes the vertical force `force` \[N\] at `zmp` (world) to the feet that stand.
///
/// Both centres of pressure move off their rest points (`zmp_in_foot`) by the same vector where they can,
/// and the forces follow by the lever rule along the line between them; where a sole ends, its centre of
/// pressure stays on its edge and the other one takes the rest. For a zero moment point within both
/// soles' hull the loads add up to it, at the hull's very edge to within 5 mm; for one outside, to what
/// comes nearest.
///
/// Source: Kajita et al., "Biped walking stabilization based on linear inverted pendulum tracking",
/// IROS 2010, section III-D; the soles' limits as in Caron et al., ICRA 2019.
pub fn distribute(
    force: f64,
    zmp: &Vector2<f64>,
    soles: &PerFoot<SoleRectangle>,
    zmp_in_foot: &PerFoot<Vector2<f64>>,
    standing: &PerFoot<Option<Pose<World, Foot>>>,
) -> PerFoot<FootLoad> {
    let rest = |side: Side| standing[side].map_or(*zmp, |foot| point_in_world(&foot, &zmp_in_foot[side]));
    match (&standing.right, &standing.left) {
        (Some(right), Some(left)) => {
            let mut points = PerFoot::from_fn(rest);
            let mut share = 0.0;
            // Each round moves both points by what is missing: one is enough but where an edge cuts off.
            for _ in 0..30 {
                let along = points.left - points.right;
                let lever = (zmp - points.right).dot(&along) / along.norm_squared().max(1e-9);
                share = lever.clamp(0.0, 1.0);
                let missing = zmp - points.right - along * share;
                if missing.norm_squared() < 1e-12 {
                    break;
                }
                for (side, foot) in [(Side::Right, right), (Side::Left, left)] {
                    points[side] = nearest_under(foot, &soles[side], &(points[side] + missing));
                }
            }
            PerFoot {
                right: FootLoad { force: force * (1.0 - share), zmp: points.right },
                left: FootLoad { force: force * share, zmp: points.left },
            }
        }
        _ => PerFoot::from_fn(|side| match &standing[side] {
            Some(foot) => FootLoad { force, zmp: nearest_under(foot, &soles[side], zmp) },
            None => FootLoad { force: 0.0, zmp: rest(side) },
        }),
    }
}

fn point_in_world(foot: &Pose<World, Foot>, point: &Vector2<f64>) -> Vector2<f64> {
    foot.transform_point(&Vector3::new(point.x, point.y, 0.0)).xy()
}

/// The point under a sole nearest to `point`, both in the world.
fn nearest_under(foot: &Pose<World, Foot>, sole: &SoleRectangle, point: &Vector2<f64>) -> Vector2<f64> {
    let local = foot.inverse().transform_point(&point.push(foot.translation.z));
    point_in_world(foot, &nearest_in_sole(sole, &local.xy()))
}
