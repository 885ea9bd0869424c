//! A robot's body with what computes on it: base estimate and inverse kinematics.

use core::ops::Deref;
use mikoshi_config::RobotSpec;
use mikoshi_humanoid::estimate::{BaseEstimator, BaseEstimatorGains};
use mikoshi_humanoid::gait::SolvePreviewError;
use mikoshi_humanoid::ik::ConfigureIkError;
use mikoshi_humanoid::{Kinematics, WholeBodyIk};
use mikoshi_robot::MatchRobotError;

/// A robot's body, with its grasping hands only. Immutable.
#[derive(Clone, Debug)]
pub struct Robot {
    body: mikoshi_robot::Robot,
    /// Where the base is, by feet and IMU.
    pub base_estimator: BaseEstimator,
    /// Whole-body inverse kinematics.
    pub ik: WholeBodyIk,
}

/// Why a configuration describes no robot.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum BuildRobotError {
    #[error("{0}")]
    Match(#[from] MatchRobotError),
    #[error("{0}")]
    Ik(#[from] ConfigureIkError),
    #[error("gait: {0}")]
    Gait(#[from] SolvePreviewError),
}

impl Robot {
    /// A robot of a run.
    ///
    /// # Errors
    /// The URDF can't be used, or the configuration does not fit it.
    pub fn new(spec: &RobotSpec, period_s: f64) -> Result<Self, BuildRobotError> {
        let body = mikoshi_robot::Robot::new(&spec.config, &spec.urdf)?.with_hands(&spec.grasping_hands)?;
        let base_estimator =
            BaseEstimator { imu: body.imu, feet: body.soles, period_s, gains: BaseEstimatorGains::default() };
        Ok(Self { base_estimator, ik: body.whole_body_ik(period_s)?, body })
    }

    /// Workspace for kinematics.
    pub fn kinematics(&self) -> Kinematics {
        Kinematics::new(&self.model)
    }
}

impl Deref for Robot {
    type Target = mikoshi_robot::Robot;

    fn deref(&self) -> &Self::Target {
        &self.body
    }
}
