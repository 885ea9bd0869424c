//! From what a wrist or ankle sensor reads to what the hand or foot beyond it applies.

use crate::balance::GRAVITY_M_S2;
use crate::kinematics::Kinematics;
use crate::model::{FrameId, Inertial, Model};
use mikoshi_spatial::{Pose, Sensor, World, Wrench};
use nalgebra::{Vector2, Vector3};

/// A force/torque sensor, and what it carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceTorqueSensor {
    /// Where it sits.
    pub frame: FrameId,
    /// Mass distribution of what is outboard of it, in its frame.
    pub carried: Inertial,
}

/// How the carried part moves, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarriedMotion {
    /// Acceleration of its centre of mass \[m/s²\].
    pub acceleration: Vector3<f64>,
    /// Angular velocity \[rad/s\].
    pub angular_velocity: Vector3<f64>,
    /// Angular acceleration \[rad/s²\].
    pub angular_acceleration: Vector3<f64>,
}

impl ForceTorqueSensor {
    /// With what fixed joints hang on its link.
    pub fn new(model: &Model, frame: FrameId) -> Self {
        Self { frame, carried: model.carried_inertial(frame) }
    }

    /// Wrench that the carried part applies to what it touches, about the point `at` in the world, in
    /// world axes.
    ///
    /// `reading` is the wrench that the limb applies to the carried part, at the sensor and in its axes.
    /// By Newton and Euler, with m, c, I the carried mass, its centre from the sensor and its inertia
    /// about that centre:
    /// - f = R f_sensor + m (g − a)
    /// - n = R n_sensor + c × m (g − a) − (I α + ω × I ω), about the sensor; then shifted (eq. A1).
    ///
    /// Without `motion` the carried part is taken to be at rest.
    pub fn applied_wrench(
        &self,
        model: &Model,
        kinematics: &Kinematics,
        reading: &Wrench<Sensor>,
        motion: Option<&CarriedMotion>,
        at: &Vector3<f64>,
    ) -> Wrench<World> {
        let X_WS: Pose<World, Sensor> = kinematics.frame_pose(model, self.frame);
        let still = Vector3::zeros();
        let (a, w, alpha) = motion.map_or((still, still, still), |motion| {
            (motion.acceleration, motion.angular_velocity, motion.angular_acceleration)
        });
        let force = (Vector3::new(0.0, 0.0, -GRAVITY_M_S2) - a) * self.carried.mass_kg;
        let inertia =
            |v: &Vector3<f64>| X_WS.rotation * (self.carried.inertia * (X_WS.rotation.inverse() * v));
        let moment =
            (X_WS.rotation * self.carried.com).cross(&force) - (inertia(&alpha) + w.cross(&inertia(&w)));
        (reading.expressed_in(&X_WS) + Wrench::new(force, moment)).shifted(&(X_WS.translation - at))
    }
}

/// Zero moment point \[m\] on the ground at height `ground_z`, of the wrench that the ground applies
/// to the robot about the world's origin: where its moment is vertical.
///
/// `None` where the ground pushes with less than `least_force_n`: then there is no such point to speak
/// of.
pub fn zero_moment_point(ground: &Wrench<World>, ground_z: f64, least_force_n: f64) -> Option<Vector2<f64>> {
    let (f, n) = (&ground.force, &ground.moment);
    let bears = f.z >= least_force_n && f.z > 0.0;
    bears.then(|| Vector2::new((ground_z * f.x - n.y) / f.z, (ground_z * f.y + n.x) / f.z))
}
