//! A robot of the run with every name of its configuration found in its description.

use mikoshi_config::RobotSpec;
use mikoshi_config::robot::DriveConfig;
use mikoshi_humanoid::estimate::ForceTorqueSensor;
use mikoshi_humanoid::model::{FrameId, Model};
use mikoshi_ipc_types::{MAX_HANDS, MAX_JOINTS};
use mikoshi_physics::BuildWorldError;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// A palm or a sole, and the force/torque sensor that carries it.
#[derive(Clone, Copy, Debug)]
pub struct Extremity {
    /// The palm's or the sole's frame.
    pub frame: FrameId,
    /// The sensor's frame.
    pub sensor: FrameId,
}

/// A robot, resolved.
pub struct Robot<'a> {
    pub spec: &'a RobotSpec,
    pub model: Model,
    /// One for each joint.
    pub drives: Vec<&'a DriveConfig>,
    /// Grasping hands, in the order of `spec.grasping_hands`.
    pub hands: Vec<Extremity>,
    pub feet: Vec<Extremity>,
    pub imu: FrameId,
}

impl<'a> Robot<'a> {
    pub fn resolve(spec: &'a RobotSpec) -> Result<Self, BuildWorldError> {
        let config = &spec.config;
        let inconsistent = |what: String| BuildWorldError::Inconsistent {
            place: format!("robot '{}'", spec.member.name),
            what,
        };
        let body = mikoshi_robot::Robot::new(config, &spec.urdf)
            .and_then(|robot| robot.with_hands(&spec.grasping_hands))
            .map_err(|source| BuildWorldError::Robot { robot: spec.member.name.clone(), source })?;
        let mikoshi_robot::Robot { model, palms, wrist_sensors, soles, ankle_sensors, imu, .. } = body;
        let extremity =
            |(frame, sensor): (FrameId, ForceTorqueSensor)| Extremity { frame, sensor: sensor.frame };
        let hands: Vec<_> = palms.into_iter().zip(wrist_sensors).map(extremity).collect();
        let feet = soles.into_array().into_iter().zip(ankle_sensors.into_array()).map(extremity).collect();
        let drives = model.joints().iter().map(|joint| {
            config.drive_of(&joint.name).ok_or_else(|| BuildWorldError::NoDrive {
                robot: spec.member.name.clone(),
                joint: joint.name.clone(),
            })
        });
        let drives = drives.collect::<Result<Vec<_>, _>>()?;

        let counts = [
            ("joint angles at tick 0", spec.initial_posture_rad.len(), model.joint_count()),
            ("hand poses in the object", spec.hand_in_object.len(), hands.len()),
        ];
        if let Some((name, found, expected)) =
            counts.into_iter().find(|(_, found, expected)| found != expected)
        {
            return Err(inconsistent(format!("{found} {name}, expected {expected}")));
        }
        let limits = [("joints", model.joint_count(), MAX_JOINTS), ("hands", hands.len(), MAX_HANDS)];
        if let Some((name, found, limit)) = limits.into_iter().find(|(_, found, limit)| found > limit) {
            return Err(inconsistent(format!("{found} {name}, expected at most {limit}")));
        }
        for pose in spec.hand_in_object.iter().chain([&spec.initial_base_pose]) {
            let norm: f64 = pose[3..].iter().map(|q| q * q).sum();
            if !((norm - 1.0).abs() < 1e-6 && pose.iter().all(|value| value.is_finite())) {
                return Err(inconsistent(format!(
                    "{pose:?} is not a pose: expected x y z and a unit quaternion"
                )));
            }
        }
        let robot = Self { spec, model, drives, hands, feet, imu };
        robot.check_sensors()?;
        Ok(robot)
    }

    fn check_sensors(&self) -> Result<(), BuildWorldError> {
        for (i, outer) in self.force_sensors().enumerate() {
            for (j, inner) in self.force_sensors().enumerate() {
                if i != j && self.model.is_carried_by(inner, outer) {
                    return Err(BuildWorldError::NestedSensors {
                        robot: self.name().to_owned(),
                        outer: self.model.frame(outer).name.clone(),
                        inner: self.model.frame(inner).name.clone(),
                    });
                }
            }
        }
        Ok(())
    }

    pub fn name(&self) -> &str {
        &self.spec.member.name
    }

    /// All frames.
    pub fn frames(&self) -> impl Iterator<Item = FrameId> {
        self.model.frames().iter().filter_map(|frame| self.model.find_frame(&frame.name).ok())
    }

    /// Whether something is measured at this frame.
    pub fn is_measured(&self, frame: FrameId) -> bool {
        let at_extremity = |extremity: &Extremity| frame == extremity.frame || frame == extremity.sensor;
        frame == self.imu || self.hands.iter().chain(&self.feet).any(at_extremity)
    }

    /// All force/torque sensors, wrists before ankles.
    pub fn force_sensors(&self) -> impl Iterator<Item = FrameId> {
        self.hands.iter().chain(&self.feet).map(|extremity| extremity.sensor)
    }

    /// The force sensor that carries this frame, if one does.
    pub fn carrier_of(&self, frame: FrameId) -> Option<FrameId> {
        self.force_sensors().find(|&sensor| self.model.is_carried_by(frame, sensor))
    }
}

/// From `[x, y, z, qw, qx, qy, qz]`.
pub fn isometry(pose: &[f64; 7]) -> Isometry3<f64> {
    let [x, y, z, qw, qx, qy, qz] = *pose;
    Isometry3::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::new_normalize(Quaternion::new(qw, qx, qy, qz)),
    )
}
