//! What robots truly stand on.

use crate::truth::is_loaded;
use mikoshi_humanoid::balance::PerFoot;
use mikoshi_humanoid::estimate::{SoleRectangle, SupportPolygon};
use mikoshi_ipc_types::RobotTruth;
use mikoshi_spatial::Pose;

/// The hull of the feet that are set down.
pub fn true_support(soles: &PerFoot<SoleRectangle>, truth: &RobotTruth, weight_n: f64) -> SupportPolygon {
    let standing = PerFoot::from_fn(|side| {
        let foot = side as usize;
        Pose::from_array(truth.sole_pose.get(foot)?).filter(|_| is_loaded(truth, foot, weight_n))
    });
    SupportPolygon::of_feet(soles, &standing)
}
