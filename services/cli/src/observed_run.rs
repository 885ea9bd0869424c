//! What observers must know of a run.

use crate::failure::Failure;
use mikoshi_config::{RobotSpec, RunSpec};
use mikoshi_cooperation::InternalForces;
use mikoshi_observation::{ObservedJoint, ObservedRobot, ObservedRun};
use mikoshi_robot::Robot;

/// What observers must know of this run.
///
/// # Errors
/// A robot's URDF can't be read. It was read before, so this is a fault.
pub fn observed_run(run: &RunSpec, internal_forces: &InternalForces) -> Result<ObservedRun, Failure> {
    let c = internal_forces.c();
    let names = internal_forces.names().iter().skip(1).cloned();
    Ok(ObservedRun {
        control_period_s: run.scenario.control_period_s,
        ticks: run.ticks,
        hybrid_start_tick: run.scenario.hybrid_start_tick(),
        robots: run.robots.iter().map(observed_robot).collect::<Result<_, _>>()?,
        internal_rows: names.zip(c.row_iter().map(|row| row.iter().copied().collect())).collect(),
    })
}

fn observed_robot(robot: &RobotSpec) -> Result<ObservedRobot, Failure> {
    let model = Robot::new(&robot.config, &robot.urdf)
        .map_err(|error| Failure::fault(error).context(&robot.member.name))?
        .model;
    let joints = model.joints().iter().map(|joint| ObservedJoint {
        name: joint.name.clone(),
        lower_rad: joint.lower,
        upper_rad: joint.upper,
        torque_limit_nm: joint.effort,
    });
    Ok(ObservedRobot {
        name: robot.member.name.clone(),
        mass_kg: model.total_mass_kg(),
        hands: robot.grasping_hands.len(),
        joints: joints.collect(),
    })
}
