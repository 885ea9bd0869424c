//! Where one looks from.

use crate::snapshot::Snapshot;
use mikoshi_config::RunSpec;
use mujoco_rs::prelude::MjvCamera;
use nalgebra::Vector3;

/// Where one looks from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// From above, all of the way.
    Top,
    /// From aside, all of the way.
    Side,
    /// From ahead and above, along with the object.
    Follow,
}

/// A robot reaches so far beyond where it stands.
const REACH_M: f64 = 0.6;
/// How high robots are in the middle.
const MIDDLE_M: f64 = 0.75;
/// So much of its distance a camera sees to both sides: the simulator's cameras open by 45° in height.
const SEEN_SHARE: f64 = 0.41;

/// A view of a run.
pub struct Camera {
    view: View,
    /// In the middle of all that is to be seen.
    middle: Vector3<f64>,
    distance_m: f64,
}

impl Camera {
    /// Far enough to see the team; of a fixed view, all of its way.
    pub fn of(run: &RunSpec, course: &[Snapshot], view: View) -> Self {
        let object = Vector3::from(run.scenario.object.position_m);
        let apart = run.robots.iter().map(|robot| {
            let member = &robot.member;
            Vector3::new(member.x_m - object.x, member.y_m - object.y, 0.0).norm()
        });
        let team_m = apart.fold(0.0, f64::max) + REACH_M;
        let (mut low, mut high) = (object, object);
        for moment in course {
            let place = place_of(moment);
            low = low.inf(&place);
            high = high.sup(&place);
        }
        let way_m = if view == View::Follow { 0.0 } else { 0.5 * (high - low).xy().norm() };
        let middle = 0.5 * (low + high);
        Self {
            view,
            middle: Vector3::new(middle.x, middle.y, MIDDLE_M),
            distance_m: (team_m + way_m) / SEEN_SHARE,
        }
    }

    /// In a moment.
    pub fn at(&self, moment: &Snapshot) -> MjvCamera {
        let place = place_of(moment);
        let (lookat, azimuth, elevation) = match self.view {
            View::Top => (self.middle, 90.0, -90.0),
            View::Side => (self.middle, 90.0, -10.0),
            View::Follow => (Vector3::new(place.x, place.y, MIDDLE_M), 135.0, -20.0),
        };
        MjvCamera {
            lookat: lookat.into(),
            distance: self.distance_m,
            azimuth,
            elevation,
            ..MjvCamera::default()
        }
    }
}

/// Where the object is.
fn place_of(moment: &Snapshot) -> Vector3<f64> {
    let [x, y, z, ..] = moment.object;
    Vector3::new(x, y, z)
}
