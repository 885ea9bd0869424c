//! What every robot is about to bear, and whether it can.

use crate::failure::Failure;
use mikoshi_config::{RobotSpec, RunSpec};
use mikoshi_humanoid::Kinematics;
use mikoshi_humanoid::balance::GRAVITY_M_S2;
use mikoshi_humanoid::statics::BEARABLE_SHARE;
use mikoshi_robot::Robot;
use mikoshi_spatial::Pose;
use serde::Serialize;

/// One robot with its share of the object, at rest in the posture in which it begins.
#[derive(Clone, Debug, Serialize)]
pub struct RobotBurden {
    /// Its name.
    pub robot: String,
    /// Its share of the object's weight.
    pub force_n: f64,
    /// Largest torque that a joint needs, as a share of its limit.
    pub torque_share: f64,
    /// That joint.
    pub joint: String,
    /// What its hands could bear together before a joint had no more than it needs for moving.
    pub bearable_n: f64,
}

impl RobotBurden {
    /// Why this is too much; `None` if it is not.
    pub fn warning(&self) -> Option<String> {
        let Self { robot, force_n, torque_share, joint, .. } = self;
        (*torque_share > BEARABLE_SHARE).then(|| {
            format!(
                "robot {robot} can hardly bear {force_n:.0} N: at rest {joint} needs {:.0} % of its torque, expected at \
                 most {:.0} %",
                100.0 * torque_share,
                100.0 * BEARABLE_SHARE
            )
        })
    }
}

/// Of every robot of a run.
///
/// # Errors
/// A robot's description can't be used.
pub fn burdens(run: &RunSpec) -> Result<Vec<RobotBurden>, Failure> {
    let shares = &run.scenario.load.shares;
    let sum: f64 = shares.iter().sum();
    let of = |(index, spec): (usize, &RobotSpec)| {
        let share = shares.get(index).map_or(1.0 / run.robots.len() as f64, |share| share / sum);
        burden(spec, run.scenario.object.mass_kg * GRAVITY_M_S2 * share)
    };
    run.robots.iter().enumerate().map(of).collect()
}

fn burden(spec: &RobotSpec, force_n: f64) -> Result<RobotBurden, Failure> {
    let robot = Robot::new(&spec.config, &spec.urdf)
        .and_then(|robot| robot.with_hands(&spec.grasping_hands))
        .map_err(Failure::usage)?;
    let base_pose = Pose::from_array(&spec.initial_base_pose).unwrap_or_else(Pose::identity);
    let mut kinematics = Kinematics::new(&robot.model);
    kinematics.update(&robot.model, &base_pose, &spec.initial_posture_rad);
    let burden = robot.burden(&kinematics, force_n, None);
    let joint = robot.model.joints().get(burden.joint as usize).map_or("", |joint| joint.name.as_str());
    Ok(RobotBurden {
        robot: spec.member.name.clone(),
        force_n,
        torque_share: burden.torque_share,
        joint: joint.to_owned(),
        bearable_n: burden.bearable_n,
    })
}
