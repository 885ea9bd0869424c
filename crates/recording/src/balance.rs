//! `/robot/NAME/balance`: how a robot stands.

use crate::convert::timestamp;
use crate::topic::Topic;
use foxglove::messages::{Timestamp, Vector2, Vector3};
use mikoshi_observation::{LogWriter, Observation, WriteLogError};

/// How a robot stands; what is measured is in its own odometry, what is true in the world.
#[derive(foxglove::Encode)]
pub struct Balance {
    timestamp: Timestamp,
    /// Zero moment point on the ground.
    zmp_m: Vector2,
    zmp_measured_m: Vector2,
    /// From it to the edge of the support polygon; negative outside.
    zmp_margin_m: f64,
    zmp_margin_measured_m: f64,
    capture_point_margin_m: f64,
    com_m: Vector3,
    com_measured_m: Vector3,
    tilt_rad: f64,
    steps: u64,
    joint_margin_min_rad: f64,
    /// Share of its speed that the object may keep without leaving this robot's feet behind.
    speed_share: f64,
    flags: u64,
    has_fallen: bool,
}

/// The balance of one robot.
pub struct Balances {
    robot: usize,
    topic: Topic<Balance>,
}

impl Balances {
    pub fn add(log: &mut LogWriter, robot: usize, name: &str) -> Result<Self, WriteLogError> {
        Ok(Self { robot, topic: Topic::add(log, &format!("/robot/{name}/balance"))? })
    }

    pub fn write(
        &self,
        log: &mut LogWriter,
        time_ns: u64,
        observation: &Observation,
    ) -> Result<(), WriteLogError> {
        let truth = &observation.robot_truth[self.robot].payload;
        let state = &observation.robot_state[self.robot].payload;
        let vector2 = |[x, y]: [f64; 2]| Vector2 { x, y };
        let vector3 = |[x, y, z]: [f64; 3]| Vector3 { x, y, z };
        let balance = Balance {
            timestamp: timestamp(time_ns),
            zmp_m: vector2(truth.zmp_position_m),
            zmp_measured_m: vector2(state.zmp_position_m),
            zmp_margin_m: truth.zmp_margin_m,
            zmp_margin_measured_m: state.zmp_margin_m,
            capture_point_margin_m: state.capture_point_margin_m,
            com_m: vector3(truth.com_position_m),
            com_measured_m: vector3(state.com_position_m),
            tilt_rad: truth.tilt_rad,
            steps: state.steps,
            joint_margin_min_rad: state.joint_margin_min_rad,
            speed_share: state.speed_share,
            flags: state.flags,
            has_fallen: truth.fallen != 0,
        };
        self.topic.write(log, observation.tick(), &balance)
    }
}
