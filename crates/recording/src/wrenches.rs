//! `/robot/NAME/wrench/…`: what hands apply to the object, and what feet feel.

use crate::convert::{half, timestamp};
use crate::frames::{WORLD, of_link};
use crate::topic::Topic;
use foxglove::messages::{Timestamp, Vector3};
use mikoshi_config::RobotSpec;
use mikoshi_observation::{LogWriter, Observation, WriteLogError};

/// A wrench at the origin of what it is named after, in the axes of a coordinate frame.
#[derive(foxglove::Encode)]
pub struct Wrench {
    timestamp: Timestamp,
    /// Whose axes.
    frame_id: String,
    force_n: Vector3,
    torque_nm: Vector3,
}

impl Wrench {
    fn new(time_ns: u64, frame_id: &str, wrench: &[f64; 6]) -> Self {
        Self {
            timestamp: timestamp(time_ns),
            frame_id: frame_id.to_owned(),
            force_n: half(wrench, 0),
            torque_nm: half(wrench, 3),
        }
    }
}

/// All wrenches of one robot.
pub struct Wrenches {
    robot: usize,
    odometry: String,
    /// Of each grasping hand on the object, at the palm: as the servo has it, and as it truly is.
    hands: Vec<(Topic<Wrench>, Topic<Wrench>)>,
    /// Of each leg on its foot, at the ankle sensor, and that sensor.
    feet: Vec<(Topic<Wrench>, String)>,
}

impl Wrenches {
    pub fn add(log: &mut LogWriter, robot: usize, spec: &RobotSpec) -> Result<Self, WriteLogError> {
        let name = &spec.member.name;
        let (mut hands, mut feet) = (vec![], vec![]);
        for &hand in &spec.grasping_hands {
            let topic = format!("/robot/{name}/wrench/hand/{}", spec.config.hands[hand].name);
            hands.push((Topic::add(log, &topic)?, Topic::add(log, &format!("{topic}/true"))?));
        }
        for foot in &spec.config.feet {
            let topic = Topic::add(log, &format!("/robot/{name}/wrench/foot/{}", foot.name))?;
            feet.push((topic, of_link(name, &foot.sensor_link)));
        }
        Ok(Self { robot, odometry: of_link(name, "odometry"), hands, feet })
    }

    pub fn write(
        &self,
        log: &mut LogWriter,
        time_ns: u64,
        observation: &Observation,
    ) -> Result<(), WriteLogError> {
        let tick = observation.tick();
        let measured = observation.robot_state[self.robot].payload.hand_wrench;
        let actual = observation.robot_truth[self.robot].payload.hand_wrench;
        for ((topics, measured), actual) in self.hands.iter().zip(measured).zip(actual) {
            topics.0.write(log, tick, &Wrench::new(time_ns, &self.odometry, &measured))?;
            topics.1.write(log, tick, &Wrench::new(time_ns, WORLD, &actual))?;
        }
        let ankles = observation.sensors[self.robot].payload.ankle_wrench;
        for ((topic, sensor), wrench) in self.feet.iter().zip(ankles) {
            topic.write(log, tick, &Wrench::new(time_ns, sensor, &wrench))?;
        }
        Ok(())
    }
}
