//! What observers must know of a run.

use crate::failure::Failure;
use mikoshi_config::{RobotSpec, RunSpec};
use mikoshi_cooperation::InternalForces;
use mikoshi_observation::{ObservedJoint, ObservedRobot, ObservedRun};
use mikoshi_robot::Robot;
use mikoshi_spatial::{Object, Pose, Twist, World};
use nalgebra::{UnitQuaternion, Vector3};

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
        is_controlled: run.scenario.is_controlled(),
        X_WBody_goal: run.scenario.job.as_ref().map(|_| goal(run)),
        robots: run.robots.iter().map(observed_robot).collect::<Result<_, _>>()?,
        internal_rows: names.zip(c.row_iter().map(|row| row.iter().copied().collect())).collect(),
    })
}

/// Where the operator's velocities lead the object, from where it is in the beginning; a job sets it down as
/// far as it lifted it.
fn goal(run: &RunSpec) -> Pose<World, Object> {
    let object = &run.scenario.object;
    let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), object.yaw_deg.to_radians());
    let start = Pose::new(Vector3::from(object.position_m), heading);
    run.motion.iter().fold(start, |pose, segment| {
        let velocity = Twist::new(segment.velocity_m_s.into(), segment.angular_velocity_rad_s.into());
        pose.displaced(&(velocity * segment.duration_s))
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
