//! Pose and twist of the base from encoders, the feet that stand, and the IMU.

use crate::balance::{GRAVITY_M_S2, PerFoot, Side};
use crate::kinematics::Kinematics;
use crate::model::{FrameId, Model};
use mikoshi_spatial::{Base, Foot, Pose, Sensor, Twist, World, exp, log};
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Estimator of the base's pose: a complementary filter for the attitude, and the stance feet for the
/// position.
///
/// The gyroscope carries the attitude from tick to tick, and the accelerometer, turned by it, the IMU's
/// velocity. Where that leaves the velocity that the stance feet see, gravity was taken for acceleration:
/// the attitude is tilted. With the difference e, and z up,
/// - `dv/dt = R f − g z + 4 k e`
/// - `ω_correction = (4 k² / g) z × e`, a critically damped loop of rate 2 k.
///
/// The feet pull the yaw to theirs. What they pull against persistently is the gyroscope's bias. (Velocity-
/// aided attitude: Hua, "Attitude estimation for accelerated vehicles using GPS/INS measurements", 2010;
/// Mahony et al., "Nonlinear complementary filters on the special orthogonal group", 2008. No reading is
/// differentiated, and none is dropped: noise averages out.)
///
/// Soles rest on the ground through soft contact, so they say where the base is, but not how it is
/// tilted: encoders alone would take the sole's tilt for the base's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseEstimator {
    /// IMU.
    pub imu: FrameId,
    /// Soles.
    pub feet: PerFoot<FrameId>,
    /// Control period \[s\].
    pub period_s: f64,
    /// How fast it corrects.
    pub gains: BaseEstimatorGains,
}

/// Gains of [`BaseEstimator`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseEstimatorGains {
    /// k: half the rate at which the tilt follows the accelerometer \[1/s\].
    pub tilt_1_s: f64,
    /// Rate at which the yaw follows the feet \[1/s\].
    pub yaw_1_s: f64,
    /// Rate at which corrections become bias of the gyroscope \[1/s\].
    pub bias_1_s: f64,
}

impl Default for BaseEstimatorGains {
    fn default() -> Self {
        Self { tilt_1_s: 1.0, yaw_1_s: 5.0, bias_1_s: 0.1 }
    }
}

/// What the estimator remembers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaseEstimatorState {
    /// Attitude of the IMU in the world.
    pub imu_attitude: UnitQuaternion<f64>,
    /// Bias of the gyroscope, in the IMU's axes \[rad/s\].
    pub gyro_bias: Vector3<f64>,
    /// Origin of the root link in the world \[m\], for when no foot stands.
    pub base_position: Vector3<f64>,
    /// Velocity of the IMU in the world by its accelerometer \[m/s\]; `None` before feet have told it once.
    pub imu_velocity: Option<Vector3<f64>>,
}

/// What sensors read in a tick.
#[derive(Clone, Copy, Debug)]
pub struct Readings<'a> {
    /// Encoder angles in the order of the model.
    pub joint_position: &'a [f64],
    /// Encoder rates.
    pub joint_velocity: &'a [f64],
    /// Gyroscope, in the IMU's axes \[rad/s\].
    pub angular_velocity: Vector3<f64>,
    /// Accelerometer, in the IMU's axes \[m/s²\]: it reads gravity upwards at rest.
    pub specific_force: Vector3<f64>,
}

/// A foot that may stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootContact {
    /// Where its sole stands in the world.
    pub pose: Pose<World, Foot>,
    /// How much of the estimate rests on it: 0 for a foot in the air. By the phase of the gait, not by
    /// its force: at touch-down a foot bears before it has come to rest.
    pub weight: f64,
}

/// The base at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseEstimate {
    /// Pose of the root link.
    pub pose: Pose<World, Base>,
    /// Twist of the root link's origin, in world axes.
    pub twist: Twist<World>,
}

impl BaseEstimator {
    /// What to begin with where the base's pose is known.
    pub fn start(
        &self,
        model: &Model,
        X_WB: &Pose<World, Base>,
        joint_position: &[f64],
    ) -> BaseEstimatorState {
        let X_BI: Pose<Base, Sensor> = model.pose_in_base(self.imu, joint_position);
        BaseEstimatorState {
            imu_attitude: X_WB.rotation * X_BI.rotation,
            gyro_bias: Vector3::zeros(),
            base_position: X_WB.translation,
            imu_velocity: None,
        }
    }

    /// One tick. `kinematics` is updated to the estimated state.
    pub fn update(
        &self,
        model: &Model,
        state: &mut BaseEstimatorState,
        kinematics: &mut Kinematics,
        readings: &Readings<'_>,
        feet: &PerFoot<FootContact>,
    ) -> BaseEstimate {
        let gains = &self.gains;
        let q = readings.joint_position;
        let X_BI: Pose<Base, Sensor> = model.pose_in_base(self.imu, q);
        let X_BS = PerFoot::<Pose<Base, Foot>>::from_fn(|side| model.pose_in_base(self.feet[side], q));
        let total_weight = feet.right.weight + feet.left.weight;
        let weight = |side: Side| if total_weight > 0.0 { feet[side].weight / total_weight } else { 0.0 };

        let rate = readings.angular_velocity - state.gyro_bias;
        state.imu_attitude *= exp(&(rate * self.period_s));
        let attitude = state.imu_attitude * X_BI.rotation.inverse();
        if total_weight > 0.0 {
            let by_foot = Side::BOTH
                .map(|side| (feet[side].pose.translation - attitude * X_BS[side].translation) * weight(side));
            state.base_position = by_foot[0] + by_foot[1];
        }
        let pose = Pose::new(state.base_position, attitude);
        kinematics.update(model, &pose, q);

        // The IMU turns as the gyroscope says, and a foot that stands does not move.
        let by_joints = |frame| kinematics.frame_twist(model, frame, &Twist::zero(), readings.joint_velocity);
        let angular = state.imu_attitude * rate - by_joints(self.imu).angular;
        let linear = Side::BOTH.map(|side| {
            let lever = kinematics.frame_position(model, self.feet[side]) - state.base_position;
            (by_joints(self.feet[side]).linear + angular.cross(&lever)) * -weight(side)
        });
        let twist = Twist::new(linear[0] + linear[1], angular);

        // What the next tick begins with.
        let up = Vector3::z();
        let by_feet = kinematics.frame_twist(model, self.imu, &twist, readings.joint_velocity).linear;
        let velocity = state.imu_velocity.unwrap_or(by_feet);
        let lag = if total_weight > 0.0 { by_feet - velocity } else { Vector3::zeros() };
        let acceleration = state.imu_attitude * readings.specific_force - up * GRAVITY_M_S2;
        state.imu_velocity = Some(velocity + (acceleration + lag * (4.0 * gains.tilt_1_s)) * self.period_s);
        let tilt_error = up.cross(&lag) * (4.0 * gains.tilt_1_s / GRAVITY_M_S2);
        let yaw_error = Side::BOTH.map(|side| {
            let by_foot = feet[side].pose.rotation * X_BS[side].rotation.inverse();
            weight(side) * log(&(by_foot * attitude.inverse())).z
        });
        let yaw_error = Vector3::z() * (yaw_error[0] + yaw_error[1]);
        let correction = (tilt_error * gains.tilt_1_s + yaw_error * gains.yaw_1_s) * self.period_s;
        state.gyro_bias -= state.imu_attitude.inverse() * correction * gains.bias_1_s;
        state.imu_attitude = exp(&correction) * state.imu_attitude;
        state.imu_attitude.renormalize();
        BaseEstimate { pose, twist }
    }
}
