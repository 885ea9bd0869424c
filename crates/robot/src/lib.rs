//! A robot by its roles: its configuration matched to its URDF.
//!
//! Whoever needs a robot, to settle its posture, to control it or to simulate it, gets it here, and so
//! all agree on it. No control, no simulator; the file system is only asked whether a mesh is there.

use mikoshi_config::RobotConfig;
use mikoshi_config::robot::Meshes;
use mikoshi_humanoid::balance::{PerFoot, Side};
use mikoshi_humanoid::estimate::{ForceTorqueSensor, SoleRectangle};
use mikoshi_humanoid::ik::ConfigureIkError;
use mikoshi_humanoid::model::{FindElementError, PackageTable};
use mikoshi_humanoid::statics::{Bearing, Burden};
use mikoshi_humanoid::{FrameId, IkConfig, IkGains, Kinematics, Model, WholeBodyIk};
use nalgebra::Vector2;

/// A robot's body, and what its parts are for. Immutable.
#[derive(Clone, Debug)]
pub struct Robot {
    /// Joints and masses.
    pub model: Model,
    /// The posture to which the null space returns \[rad or m\], in the order of the model's joints.
    pub carry_posture_rad: Vec<f64>,
    /// Palms, in the order of the hands.
    pub palms: Vec<FrameId>,
    /// Wrist sensors, in the order of the hands.
    pub wrist_sensors: Vec<ForceTorqueSensor>,
    /// Soles.
    pub soles: PerFoot<FrameId>,
    /// Soles' shapes.
    pub sole_rectangles: PerFoot<SoleRectangle>,
    /// Ankle sensors.
    pub ankle_sensors: PerFoot<ForceTorqueSensor>,
    /// The link whose attitude eq. 41 controls.
    pub waist: FrameId,
    /// Gyroscope and accelerometer.
    pub imu: FrameId,
}

/// A configuration that does not fit its URDF, or has none that can be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key}: {problem}")]
pub struct MatchRobotError {
    /// Path of the key in the robot's configuration: `hands.0.palm_link`.
    pub key: String,
    /// What was found there, and what was expected.
    pub problem: String,
}

impl Robot {
    /// From its configuration, whose packages are absolute paths, and the text of its URDF; with all its
    /// hands.
    ///
    /// # Errors
    /// The URDF can't be used, the configuration names what it lacks, or the carry posture leaves a joint
    /// out or beyond its limits.
    pub fn new(config: &RobotConfig, urdf: &str) -> Result<Self, MatchRobotError> {
        let packages = config.packages.iter().map(|(name, path)| (name.clone(), path.into()));
        let packages = PackageTable(packages.collect());
        let model = match config.meshes {
            Meshes::Needed => Model::from_urdf(urdf, &|mesh| packages.find(mesh)),
            Meshes::LeftOut => Model::from_urdf(urdf, &|mesh| Some(mesh.into())).map(Model::without_meshes),
        };
        let model = model.map_err(|error| mismatch("urdf", format!("{}: {error}", config.urdf)))?;
        let frame = |key: &str, link: &str| {
            model.find_frame(link).map_err(|error| mismatch(key, lacks(config, &error)))
        };
        let sensor = |key: &str, link: &str| frame(key, link).map(|id| ForceTorqueSensor::new(&model, id));

        let (mut palms, mut wrist_sensors) = (vec![], vec![]);
        for (index, hand) in config.hands.iter().enumerate() {
            palms.push(frame(&format!("hands.{index}.palm_link"), &hand.palm_link)?);
            wrist_sensors.push(sensor(&format!("hands.{index}.sensor_link"), &hand.sensor_link)?);
        }
        let [right, left] = config.feet.as_slice() else {
            return Err(mismatch(
                "feet",
                format!("found {} feet, expected right and left", config.feet.len()),
            ));
        };
        let rectangle = |[x_min, x_max, y_min, y_max]: [f64; 4]| SoleRectangle { x_min, x_max, y_min, y_max };
        Ok(Self {
            carry_posture_rad: carry_posture(config, &model)?,
            palms,
            wrist_sensors,
            soles: PerFoot {
                right: frame("feet.0.sole_link", &right.sole_link)?,
                left: frame("feet.1.sole_link", &left.sole_link)?,
            },
            sole_rectangles: PerFoot { right: rectangle(right.sole_m), left: rectangle(left.sole_m) },
            ankle_sensors: PerFoot {
                right: sensor("feet.0.sensor_link", &right.sensor_link)?,
                left: sensor("feet.1.sensor_link", &left.sensor_link)?,
            },
            waist: frame("waist_link", &config.waist_link)?,
            imu: frame("imu_link", &config.imu_link)?,
            model,
        })
    }

    /// The same robot with those hands only: `hands` are indices into the configuration's.
    ///
    /// # Errors
    /// It has no such hand.
    pub fn with_hands(mut self, hands: &[usize]) -> Result<Self, MatchRobotError> {
        let count = self.palms.len();
        if let Some(hand) = hands.iter().find(|&&hand| hand >= count) {
            return Err(mismatch("hands", format!("found {count} hands, expected a hand {hand}")));
        }
        self.palms = hands.iter().map(|&hand| self.palms[hand]).collect();
        self.wrist_sensors = hands.iter().map(|&hand| self.wrist_sensors[hand]).collect();
        Ok(self)
    }

    /// What it would bear in the posture of `kinematics`, with hands that lift with `force_n` together, on one foot, this
    /// one or whichever.
    pub fn burden(&self, kinematics: &Kinematics, force_n: f64, on: Option<Side>) -> Burden {
        let under = |side: Side| {
            let sole = &self.sole_rectangles[side];
            Vector2::new((sole.x_min + sole.x_max) / 2.0, 0.0)
        };
        let foot = |side: Side| on.is_none_or(|on| on == side).then(|| self.soles[side]);
        let feet = PerFoot::from_fn(foot);
        let bearing = Bearing { hands: &self.palms, feet, zmp_in_foot: PerFoot::from_fn(under) };
        bearing.burden(&self.model, kinematics, force_n)
    }

    /// Eq. 41 for its hands, feet and waist, about its carry posture.
    ///
    /// # Errors
    /// See [`ConfigureIkError`].
    pub fn whole_body_ik(&self, period_s: f64) -> Result<WholeBodyIk, ConfigureIkError> {
        let config = IkConfig {
            hands: self.palms.clone(),
            feet: self.soles,
            waist: self.waist,
            posture: self.carry_posture_rad.clone(),
            period_s,
            gains: IkGains::default(),
        };
        WholeBodyIk::new(&self.model, config)
    }
}

/// The configured posture, in the order of the model's joints.
fn carry_posture(config: &RobotConfig, model: &Model) -> Result<Vec<f64>, MatchRobotError> {
    for name in config.carry_posture_deg.keys() {
        let key = format!("carry_posture_deg.{name}");
        model.find_joint(name).map_err(|error| mismatch(&key, lacks(config, &error)))?;
    }
    let angle = |joint: &mikoshi_humanoid::model::Joint| {
        let key = format!("carry_posture_deg.{}", joint.name);
        let Some(&angle_deg) = config.carry_posture_deg.get(&joint.name) else {
            return Err(mismatch(
                &key,
                format!("found nothing, expected an angle for every joint of {}", config.urdf),
            ));
        };
        let angle_rad = angle_deg.to_radians();
        if !(joint.lower..=joint.upper).contains(&angle_rad) {
            let (lower, upper) = (joint.lower.to_degrees(), joint.upper.to_degrees());
            let limits = format!("expected {lower:.1} to {upper:.1}, the joint's limits");
            return Err(mismatch(&key, format!("found {angle_deg}, {limits}")));
        }
        Ok(angle_rad)
    };
    model.joints().iter().map(angle).collect()
}

fn mismatch(key: &str, problem: String) -> MatchRobotError {
    MatchRobotError { key: key.to_owned(), problem }
}

fn lacks(config: &RobotConfig, error: &FindElementError) -> String {
    let FindElementError { element, name, known, .. } = error;
    format!("found {name:?}, expected a {element} of {}: {known}", config.urdf)
}
