//! The object that all hold as a landmark, by which robots' odometries are kept together. Beyond the paper,
//! whose robots share Σo.
//!
//! A robot knows where it is in Σo by the feet it stands on, and errs a little with every step: its own Σo,
//! frame O, drifts in the true one. Gravity keeps its axis, and flat ground its height; what drifts are x, y and
//! yaw, and on ground that is not flat the height. Nothing that a team feels tells how far all have drifted
//! together, but its hands tell how far they have drifted apart, for the object is rigid. With a_i the displacement
//! from the team's mean object (eq. 27) to where the tip of arm i has it, less what its grasp yields, robot r's
//! hands see the object displaced by
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
//! Heights within ±b of the mean are those of robots that stand on one plane, as each believes it does. With β the part
//! of a height that is beyond, `β(z) = z − clamp(z, −b, b)`, frame O is raised or lowered at the rate 1/τ_z:
//!
//! ```text
//! h_r = −(T/τ_z) (β(ε_r (z)) − Σ w_s β(ε_s (z)))
//! ```
//!
//! Σ w_r t_r = 0, Σ w_r h_r = 0 and Σ w_r ψ_r = 0, and shortened by one factor for all robots they stay so: the mean of the
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
    /// Time constant τ_z of heights \[s\].
    pub height_time_constant_s: f64,
    /// b: within this of the mean no height is corrected \[m\].
    pub height_tolerance_m: f64,
    /// Fastest motion of a frame at its robot's tips, level and upright \[m/s\].
    pub limit_m_s: f64,
    /// Fastest turn of a frame \[rad/s\].
    pub limit_rad_s: f64,
}

/// Why a landmark can't be used as asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BuildLandmarkError {
    /// A time constant is not longer than the period, or one of them is not positive.
    #[error("time constants must be longer than the control period, and all positive")]
    TimeConstant,
    /// The tolerance of heights is negative or no number.
    #[error("the tolerance of heights must be a length")]
    HeightTolerance,
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
    /// T/τ_z.
    height_share: f64,
    height_tolerance_m: f64,
    step_m: f64,
    step_rad: f64,
}

impl Landmark {
    /// Checks the parameters.
    ///
    /// # Errors
    /// A parameter is out of range.
    pub fn new(parameters: &LandmarkParameters) -> Result<Self, BuildLandmarkError> {
        let LandmarkParameters {
            period_s,
            time_constant_s,
            height_time_constant_s,
            height_tolerance_m,
            limit_m_s,
            limit_rad_s,
        } = *parameters;
        let is_longer = |seconds: f64| seconds > period_s && seconds.is_finite();
        if !(period_s > 0.0 && is_longer(time_constant_s) && is_longer(height_time_constant_s)) {
            return Err(BuildLandmarkError::TimeConstant);
        }
        if height_tolerance_m.is_nan() || height_tolerance_m < 0.0 {
            return Err(BuildLandmarkError::HeightTolerance);
        }
        if !(limit_m_s > 0.0 && limit_rad_s > 0.0) {
            return Err(BuildLandmarkError::Limit);
        }
        Ok(Self {
            share: period_s / time_constant_s,
            height_share: period_s / height_time_constant_s,
            height_tolerance_m,
            step_m: limit_m_s * period_s,
            step_rad: limit_rad_s * period_s,
        })
    }

    /// By what each robot's frame O moves in Σo in this tick, in the order of `sightings`:
    /// `X_WO ← correction · X_WO`. No allocation, no panic; O(m).
    pub fn corrections<'a>(
        &self,
        sightings: &'a [Sighting],
    ) -> impl Iterator<Item = FrameCorrection> + use<'a> {
        let mean = sightings.iter().fold(Twist::zero(), |sum, seen| sum + seen.deviation * seen.weight);
        let tolerance_m = self.height_tolerance_m;
        let beyond = move |seen: &Sighting| {
            let height = seen.deviation.linear.z - mean.linear.z;
            height - height.clamp(-tolerance_m, tolerance_m)
        };
        let mean_beyond = sightings.iter().fold(0.0, |sum, seen| sum + beyond(seen) * seen.weight);
        let (share, height_share) = (self.share, self.height_share);
        let step = move |seen: &Sighting| {
            let level = (seen.deviation - mean) * -share;
            let height = (beyond(seen) - mean_beyond) * -height_share;
            Twist::<World>::new(level.linear.xy().push(height), level.angular)
        };
        let (mut longest, mut highest, mut widest) = (0.0_f64, 0.0_f64, 0.0_f64);
        for step in sightings.iter().map(step) {
            longest = longest.max(step.linear.xy().norm());
            highest = highest.max(step.linear.z.abs());
            widest = widest.max(step.angular.z.abs());
        }
        // The same for all, or the mean would move.
        let slower = 1.0_f64.min(self.step_m / longest).min(self.step_rad / widest);
        let slower_up = 1.0_f64.min(self.step_m / highest);
        sightings.iter().map(move |seen| {
            let step = step(seen);
            let linear = (step.linear.xy() * slower).push(step.linear.z * slower_up);
            FrameCorrection { about: seen.tips, linear, yaw: step.angular.z * slower }
        })
    }
}

/// A small motion of a frame that stays level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameCorrection {
    /// The vertical through this point is what it turns about \[m\].
    pub about: Vector3<f64>,
    /// What it moves by \[m\].
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
