//! A robot's body as its configuration describes it: model, frames by their roles, inverse kinematics.

use mikoshi_config::RobotConfig;
use mikoshi_humanoid::balance::{PerFoot, Side};
use mikoshi_humanoid::estimate::{BaseEstimator, BaseEstimatorGains, ForceTorqueSensor, SoleRectangle};
use mikoshi_humanoid::ik::ConfigureIkError;
use mikoshi_humanoid::model::{FindElementError, LoadModelError};
use mikoshi_humanoid::{FrameId, IkConfig, IkGains, Kinematics, Model, WholeBodyIk};
use std::path::PathBuf;

/// A robot's body. Immutable.
#[derive(Clone, Debug)]
pub struct Robot {
    /// Joints and masses.
    pub model: Model,
    /// Palms of the grasping hands.
    pub palms: Vec<FrameId>,
    /// Wrist sensors of the grasping hands.
    pub wrist_sensors: Vec<ForceTorqueSensor>,
    /// Soles.
    pub soles: PerFoot<FrameId>,
    /// Ankle sensors.
    pub ankle_sensors: PerFoot<ForceTorqueSensor>,
    /// Soles' shapes.
    pub sole_rectangles: PerFoot<SoleRectangle>,
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
    Model(#[from] LoadModelError),
    #[error("{key}: {source}")]
    Element { key: String, source: FindElementError },
    #[error("{0}")]
    Ik(#[from] ConfigureIkError),
    #[error("carry_posture_deg: joint `{0}` is missing; expected an angle for every joint of the model")]
    MissingPosture(String),
    #[error("feet: expected right and left, found {0}")]
    FootCount(usize),
}

impl Robot {
    /// From its configuration and the text of its URDF, with the hands of `grasping_hands` (indices into
    /// `config.hands`). `find_mesh` as in [`Model::from_urdf`].
    ///
    /// # Errors
    /// The URDF can't be loaded, or the configuration names what it doesn't have.
    pub fn new(
        config: &RobotConfig,
        urdf: &str,
        grasping_hands: &[usize],
        period_s: f64,
        find_mesh: &dyn Fn(&str) -> Option<PathBuf>,
    ) -> Result<Self, BuildRobotError> {
        let model = Model::from_urdf(urdf, find_mesh)?;
        let frame = |key: String, link: &str| {
            model.find_frame(link).map_err(|source| BuildRobotError::Element { key, source })
        };
        let [right, left] = config.feet.as_slice() else {
            return Err(BuildRobotError::FootCount(config.feet.len()));
        };
        let foot = |side| match side {
            Side::Right => right,
            Side::Left => left,
        };
        let (mut palms, mut wrist_sensors) = (Vec::new(), Vec::new());
        for &hand in grasping_hands {
            let hand_config = &config.hands[hand];
            palms.push(frame(format!("hands.{hand}.palm_link"), &hand_config.palm_link)?);
            let sensor = frame(format!("hands.{hand}.sensor_link"), &hand_config.sensor_link)?;
            wrist_sensors.push(ForceTorqueSensor::new(&model, sensor));
        }
        let feet_frames = |key: &str, link: &dyn Fn(Side) -> String| -> Result<PerFoot<FrameId>, _> {
            Ok::<_, BuildRobotError>(PerFoot {
                right: frame(format!("feet.0.{key}"), &link(Side::Right))?,
                left: frame(format!("feet.1.{key}"), &link(Side::Left))?,
            })
        };
        let soles = feet_frames("sole_link", &|side| foot(side).sole_link.clone())?;
        let ik_config = IkConfig {
            hands: palms.clone(),
            feet: soles,
            waist: frame("waist_link".to_owned(), &config.waist_link)?,
            posture: carry_posture(config, &model)?,
            period_s,
            gains: IkGains::default(),
        };
        let ankle_frames = feet_frames("sensor_link", &|side| foot(side).sensor_link.clone())?;
        let base_estimator = BaseEstimator {
            imu: frame("imu_link".to_owned(), &config.imu_link)?,
            feet: soles,
            period_s,
            gains: BaseEstimatorGains::default(),
        };
        Ok(Self {
            ankle_sensors: PerFoot::from_fn(|side| ForceTorqueSensor::new(&model, ankle_frames[side])),
            sole_rectangles: PerFoot::from_fn(|side| {
                let [x_min, x_max, y_min, y_max] = foot(side).sole_m;
                SoleRectangle { x_min, x_max, y_min, y_max }
            }),
            base_estimator,
            ik: WholeBodyIk::new(&model, ik_config)?,
            palms,
            wrist_sensors,
            soles,
            model,
        })
    }

    /// Workspace for kinematics.
    pub fn kinematics(&self) -> Kinematics {
        Kinematics::new(&self.model)
    }
}

/// The posture of the configuration, in the order of the model's joints.
fn carry_posture(config: &RobotConfig, model: &Model) -> Result<Vec<f64>, BuildRobotError> {
    for name in config.carry_posture_deg.keys() {
        let key = format!("carry_posture_deg.{name}");
        model.find_joint(name).map_err(|source| BuildRobotError::Element { key, source })?;
    }
    let angle = |joint: &mikoshi_humanoid::model::Joint| {
        let angle_deg = config.carry_posture_deg.get(&joint.name);
        angle_deg
            .map(|deg| deg.to_radians())
            .ok_or_else(|| BuildRobotError::MissingPosture(joint.name.clone()))
    };
    model.joints().iter().map(angle).collect()
}
