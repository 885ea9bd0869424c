//! The object that all hold as a landmark, by which robots' odometries are kept together. Beyond the paper,
//! whose robots share Σo.
//!
//! A robot knows where it is in Σo by the feet it stands on, and errs a little with every step: its own Σo,
//! frame O, drifts in the true one. Gravity and flat ground keep its axis and height; what drifts are x, y and
//! yaw. Nothing that a team feels tells how far all have drifted together, but its hands tell how far they have
//! drifted apart, for the object is rigid. With a_i the displacement from the team's mean object (eq. 27) to
//! where the tip of arm i has it, less what its grasp yields, robot r's hands see the object displaced by
//!
//! ```text
//! a_r = mean of a_i over its arms,   ε_r = a_r − Σ w_s a_s
//! ```
//!
//! where w_s is the weight of its arms in that mean. Of ε_r only x, y and yaw are taken, and frame O is moved
//! against them at the rate 1/τ, turning about the robot's tips:
//!
//! ```text
//! t_r = −(T/τ) ε_r (x, y),   ψ_r = −(T/τ) ε_r (yaw)
//! ```
//!
//! Σ w_r t_r = 0 and Σ w_r ψ_r = 0, and shortened by one factor for all robots they stay so: the mean of the
//! tips is where it was, and nobody's error becomes the object's.

use mikoshi_spatial::{Pose, Twist, World};
use nalgebra::{UnitQuaternion, Vector3};

/// How fast frames are brought together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandmarkParameters {
    /// Control period T \[s\].
    pub period_s: f64,
    /// Time constant τ \[s\]: long beside the hybrid law and a step, over which a robot sways.
    pub time_constant_s: f64,
    /// Fastest motion of a frame at its robot's tips \[m/s\].
    pub limit_m_s: f64,
    /// Fastest turn of a frame \[rad/s\].
    pub limit_rad_s: f64,
}

/// Why a landmark can't be used as asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BuildLandmarkError {
    /// The time constant is not longer than the period, or one of both is not positive.
    #[error("the time constant must be longer than the control period, and both positive")]
    TimeConstant,
    /// A limit is not positive.
    #[error("limits of a frame's motion must be positive")]
    Limit,
}

/// The object as the hands of one robot see it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sighting {
    /// w_r: weight of its arms in the team's mean of the tips.
    pub weight: f64,
    /// Mean of its tips \[m\]: where its frame turns.
    pub tips: Vector3<f64>,
    /// a_r: from the team's object to this robot's, without what its grasps yield.
    pub deviation: Twist<World>,
}

/// Brings robots' frames together by what their hands see of the object. Immutable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landmark {
    /// T/τ.
    share: f64,
    step_m: f64,
    step_rad: f64,
}

impl Landmark {
    /// Checks the parameters.
    ///
    /// # Errors
    /// A parameter is out of range.
    pub fn new(parameters: &LandmarkParameters) -> Result<Self, BuildLandmarkError> {
        let LandmarkParameters { period_s, time_constant_s, limit_m_s, limit_rad_s } = *parameters;
        if !(period_s > 0.0 && time_constant_s > period_s && time_constant_s.is_finite()) {
            return Err(BuildLandmarkError::TimeConstant);
        }
        if !(limit_m_s > 0.0 && limit_rad_s > 0.0) {
            return Err(BuildLandmarkError::Limit);
        }
        let share = period_s / time_constant_s;
        Ok(Self { share, step_m: limit_m_s * period_s, step_rad: limit_rad_s * period_s })
    }

    /// By what each robot's frame O moves in Σo in this tick, in the order of `sightings`:
    /// `X_WO ← correction · X_WO`. No allocation, no panic; O(m).
    pub fn corrections<'a>(
        &self,
        sightings: &'a [Sighting],
    ) -> impl Iterator<Item = FrameCorrection> + use<'a> {
        let mean = sightings.iter().fold(Twist::zero(), |sum, seen| sum + seen.deviation * seen.weight);
        let share = self.share;
        let step = move |seen: &Sighting| (seen.deviation - mean) * -share;
        let (mut longest, mut widest) = (0.0_f64, 0.0_f64);
        for step in sightings.iter().map(step) {
            longest = longest.max(step.linear.xy().norm());
            widest = widest.max(step.angular.z.abs());
        }
        // The same for all, or the mean would move.
        let slower = 1.0_f64.min(self.step_m / longest).min(self.step_rad / widest);
        sightings.iter().map(move |seen| {
            let step = step(seen) * slower;
            FrameCorrection { about: seen.tips, linear: step.linear.xy().push(0.0), yaw: step.angular.z }
        })
    }
}

/// A small motion of a frame on level ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameCorrection {
    /// The vertical through this point is what it turns about \[m\].
    pub about: Vector3<f64>,
    /// What it moves by, level \[m\].
    pub linear: Vector3<f64>,
    /// What it turns by \[rad\].
    pub yaw: f64,
}

impl FrameCorrection {
    /// As a motion of Σo's points: `p ↦ R (p − about) + about + linear`.
    pub fn motion(&self) -> Pose<World, World> {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw);
        Pose::new(self.about - rotation * self.about + self.linear, rotation)
    }
}
