//! How far and how fast standing robots could be pulled by a leader (eq. 42).

use crate::failure::Failure;
use mikoshi_config::{RobotSpec, RunSpec};
use mikoshi_humanoid::Kinematics;
use mikoshi_humanoid::balance::{Pendulum, PulledRobot, Side};
use mikoshi_robot::Robot;
use mikoshi_spatial::{Foot, Hand, Pose};
use serde::Serialize;

/// One robot that stands while another one of its kind pulls at the object.
#[derive(Clone, Debug, Serialize)]
pub struct Pull {
    /// Its name.
    pub robot: String,
    /// Of both robots' hands in series.
    pub stiffness_n_m: f64,
    /// From where its zero moment point rests under its load to its toes.
    pub zmp_way_m: f64,
    /// Of its hands over the ground.
    pub hand_height_m: f64,
    /// The motion's highest speed along the ground.
    pub velocity_m_s: f64,
    /// The pull at which its zero moment point is at its toes.
    pub displacement_m: f64,
    /// When that is, at that speed.
    pub time_s: Option<f64>,
}

/// Of every robot of a run.
///
/// # Errors
/// A robot's description can't be used.
pub fn pulls(run: &RunSpec) -> Result<Vec<Pull>, Failure> {
    run.robots.iter().map(|spec| pull(run, spec)).collect()
}

fn pull(run: &RunSpec, spec: &RobotSpec) -> Result<Pull, Failure> {
    let robot = Robot::new(&spec.config, &spec.urdf)
        .and_then(|robot| robot.with_hands(&spec.grasping_hands))
        .map_err(Failure::usage)?;
    let base_pose = Pose::from_array(&spec.initial_base_pose).unwrap_or_else(Pose::identity);
    let mut kinematics = Kinematics::new(&robot.model);
    kinematics.update(&robot.model, &base_pose, &spec.initial_posture_rad);
    let foot = kinematics.frame_pose::<Foot>(&robot.model, robot.soles[Side::Right]);
    let ahead = |point: &nalgebra::Vector3<f64>| foot.inverse().transform_point(point);

    let hands = robot.palms.len() as f64;
    let palm = |&palm: &_| ahead(&kinematics.frame_pose::<Hand>(&robot.model, palm).translation);
    let palms: nalgebra::Vector3<f64> = robot.palms.iter().map(palm).sum::<nalgebra::Vector3<f64>>() / hands;
    let mass_kg = robot.model.total_mass_kg();
    let load_kg = run.scenario.object.mass_kg / run.robots.len() as f64;
    let com = ahead(&kinematics.com());
    let rest_m = (com.x * mass_kg + palms.x * load_kg) / (mass_kg + load_kg);
    let pulled = PulledRobot {
        pendulum: Pendulum { mass_kg, com_height_m: com.z },
        zmp_way_m: robot.sole_rectangles[Side::Right].x_max - rest_m,
        hand_height_m: palms.z,
        stiffness_n_m: run.scenario.hybrid.hand_stiffness_n_m * hands / 2.0,
    };
    let speeds = run.motion.iter().map(|segment| segment.velocity_m_s[0].hypot(segment.velocity_m_s[1]));
    let fastest_m_s = speeds.fold(0.0, f64::max);
    let motion = run.scenario.motion.as_ref().filter(|_| fastest_m_s > 0.0);
    Ok(Pull {
        robot: spec.member.name.clone(),
        stiffness_n_m: pulled.stiffness_n_m,
        zmp_way_m: pulled.zmp_way_m,
        hand_height_m: pulled.hand_height_m,
        velocity_m_s: fastest_m_s,
        displacement_m: pulled.displacement_to_edge_m(),
        time_s: motion.map(|motion| pulled.time_to_edge_s(fastest_m_s, motion.acceleration_m_s2)),
    })
}
