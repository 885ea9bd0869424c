//! A hand's hold of the object.

use crate::articulation::Articulation;
use crate::convert::{force_and_torque, from_isometry, from_vector, pose, vector};
use mikoshi_config::Scenario;
use mikoshi_humanoid::model::FrameId;
use mikoshi_physics::{BuildWorldError, Grip, Spring, is_in_reach};
use mikoshi_spatial::{Hand as HandFrame, Object, Pose, Twist, World, Wrench};
use nalgebra::Isometry3;
use rapier3d_f64::prelude::*;

/// As stiff as a weld of the other engine.
const WELD_N_M: f64 = 25_000.0;
/// The same about an axis.
const WELD_NM_RAD: f64 = 1_000.0;
/// Of the object in all its grasps.
const WELD_DAMPING_RATIO: f64 = 0.5;

/// The grasp of the scenario as a spring.
///
/// # Errors
/// The scenario's own spring would diverge.
pub fn spring(scenario: &Scenario, hands: usize) -> Result<Spring, BuildWorldError> {
    if let Some(spring) = Spring::of(scenario, hands)? {
        return Ok(spring);
    }
    let (object, hands) = (&scenario.object, hands.max(1) as f64);
    let [x, y, z] = object.size_m.map(|edge| edge * edge);
    let inertia = object.mass_kg / 12.0 * (y + z).min(x + z).min(x + y);
    let damping =
        |stiffness: f64, inertia: f64| 2.0 * WELD_DAMPING_RATIO * (stiffness * inertia / hands).sqrt();
    Ok(Spring {
        stiffness_n_m: WELD_N_M,
        damping_ns_m: damping(WELD_N_M, object.mass_kg),
        stiffness_nm_rad: WELD_NM_RAD,
        damping_nms_rad: damping(WELD_NM_RAD, inertia),
    })
}

/// A grasping hand.
pub struct Hand {
    pub palm: FrameId,
    /// Where on the object it is pulled to, and where it was to hold: the same without the grasp offset.
    pub pulled_to: Isometry3<f64>,
    pub place: Pose<Object, HandFrame>,
    /// What it does to the object, at the palm's origin in world axes.
    pub wrench: Wrench<World>,
}

impl Hand {
    /// Pulls palm and object towards each other for the step to come, if the hand holds.
    pub fn pull(
        &mut self,
        world: &mut PhysicsWorld,
        robot: &Articulation,
        object: RigidBodyHandle,
        spring: &Spring,
        holds: bool,
    ) {
        self.wrench = Wrench::zero();
        let Some(body) = world.bodies.get(object).filter(|_| holds) else { return };
        let X_WG = from_isometry(body.position()) * self.pulled_to;
        let at = vector(&X_WG.translation.vector);
        let place = Twist::new(from_vector(body.velocity_at_point(at)), from_vector(body.angvel()));
        let palm: Pose<World, HandFrame> = robot.frame_pose(world, self.palm);
        let palm_twist = robot.frame_twist(world, self.palm);
        self.wrench = spring.wrench_on_object((&palm, palm_twist), (&pose(&X_WG), place));
        let (force, torque) = force_and_torque(&self.wrench);
        if let Some(body) = world.bodies.get_mut(object) {
            body.add_force_at_point(force, vector(&palm.translation), false);
            body.add_torque(torque, false);
        }
        robot.apply(world, self.palm, &-self.wrench);
    }

    /// Does it, if it can: an object that hangs in other robots' hands is taken where the palm is.
    pub fn change(
        &mut self,
        world: &PhysicsWorld,
        robot: &Articulation,
        object: RigidBodyHandle,
        grip: Grip,
    ) -> bool {
        let Some(body) = world.bodies.get(object) else { return false };
        let X_WO = pose::<World, Object>(&from_isometry(body.position()));
        let X_OH = X_WO.inverse() * robot.frame_pose::<HandFrame>(world, self.palm);
        match grip {
            Grip::Open => true,
            Grip::Close => is_in_reach(&self.place, &X_OH),
            Grip::CloseBesideOthers if is_in_reach(&pose(&self.pulled_to), &X_OH) => {
                self.pulled_to = Isometry3::from_parts(X_OH.translation.into(), X_OH.rotation);
                true
            }
            Grip::CloseBesideOthers => false,
        }
    }
}
