//! `/timing`: where ticks spend their time, by the stamps that frames carry.

use crate::convert::timestamp;
use crate::topic::Topic;
use foxglove::messages::Timestamp;
use mikoshi_observation::{LogWriter, LongestTimes, Observation, ServoTimes, WriteLogError};

/// The longest of each since the message before.
#[derive(foxglove::Encode)]
pub struct Timing {
    timestamp: Timestamp,
    tick: u64,
    /// From a tick's sensors to the next one's.
    tick_max_s: f64,
    /// From when a tick was due to its sensors.
    late_max_s: f64,
    bridge_max_s: f64,
    coordinator_max_s: f64,
    servos: Vec<ServoTiming>,
}

/// The same of one servo.
#[derive(Clone, foxglove::Encode)]
pub struct ServoTiming {
    robot: String,
    sense_max_s: f64,
    act_max_s: f64,
}

/// Gathers times from message to message.
pub struct Timings {
    topic: Topic<Timing>,
    robots: Vec<String>,
    longest: LongestTimes,
}

impl Timings {
    pub fn add(log: &mut LogWriter, robots: Vec<String>) -> Result<Self, WriteLogError> {
        let longest = LongestTimes::for_team(robots.len());
        Ok(Self { topic: Topic::add(log, "/timing")?, robots, longest })
    }

    /// Takes in one tick.
    pub fn observe(&mut self, observation: &Observation) {
        self.longest.observe(observation);
    }

    /// Says what was longest, and begins anew.
    pub fn write(&mut self, log: &mut LogWriter, time_ns: u64, tick: u64) -> Result<(), WriteLogError> {
        let longest = self.longest.take();
        let servo = |(robot, times): (&String, &ServoTimes)| ServoTiming {
            robot: robot.clone(),
            sense_max_s: times.sense_s,
            act_max_s: times.act_s,
        };
        let timing = Timing {
            timestamp: timestamp(time_ns),
            tick,
            tick_max_s: longest.tick_s,
            late_max_s: longest.late_s,
            bridge_max_s: longest.bridge_s,
            coordinator_max_s: longest.coordinator_s,
            servos: self.robots.iter().zip(&longest.servos).map(servo).collect(),
        };
        self.topic.write(log, tick, &timing)
    }
}
