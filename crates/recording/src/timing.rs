//! `/timing`: where ticks spend their time, by the stamps that frames carry.

use crate::convert::timestamp;
use crate::topic::Topic;
use foxglove::messages::Timestamp;
use mikoshi_ipc_types::Envelope;
use mikoshi_observation::{LogWriter, Observation, WriteLogError};

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
    longest: Timing,
    /// When the last tick began.
    began_ns: u64,
}

impl Timings {
    pub fn add(log: &mut LogWriter, robots: Vec<String>) -> Result<Self, WriteLogError> {
        let servos = robots.into_iter().map(|robot| ServoTiming { robot, sense_max_s: 0.0, act_max_s: 0.0 });
        let longest = Timing {
            timestamp: timestamp(0),
            tick: 0,
            tick_max_s: 0.0,
            late_max_s: 0.0,
            bridge_max_s: 0.0,
            coordinator_max_s: 0.0,
            servos: servos.collect(),
        };
        Ok(Self { topic: Topic::add(log, "/timing")?, longest, began_ns: 0 })
    }

    /// Takes in one tick.
    pub fn observe(&mut self, observation: &Observation) {
        let longest = &mut self.longest;
        let bridge = &observation.object_truth.envelope;
        raise(
            &mut longest.tick_max_s,
            core::mem::replace(&mut self.began_ns, bridge.stamp_ns),
            bridge.stamp_ns,
        );
        raise(&mut longest.late_max_s, bridge.due_ns, bridge.stamp_ns);
        raise_by(&mut longest.bridge_max_s, bridge);
        raise_by(&mut longest.coordinator_max_s, &observation.team_state.envelope);
        let servos = longest.servos.iter_mut();
        let frames = observation.robot_state.iter().zip(&observation.joint_command);
        for (servo, (state, command)) in servos.zip(frames) {
            raise_by(&mut servo.sense_max_s, &state.envelope);
            raise_by(&mut servo.act_max_s, &command.envelope);
        }
    }

    /// Says what was longest, and begins anew.
    pub fn write(&mut self, log: &mut LogWriter, time_ns: u64, tick: u64) -> Result<(), WriteLogError> {
        let longest = &mut self.longest;
        (longest.timestamp, longest.tick) = (timestamp(time_ns), tick);
        self.topic.write(log, tick, longest)?;
        let times = [
            &mut longest.tick_max_s,
            &mut longest.late_max_s,
            &mut longest.bridge_max_s,
            &mut longest.coordinator_max_s,
        ];
        times.into_iter().for_each(|time| *time = 0.0);
        for servo in &mut longest.servos {
            (servo.sense_max_s, servo.act_max_s) = (0.0, 0.0);
        }
        Ok(())
    }
}

fn raise_by(longest_s: &mut f64, phase: &Envelope) {
    raise(longest_s, phase.heard_ns, phase.kept_ns);
}

fn raise(longest_s: &mut f64, from_ns: u64, to_ns: u64) {
    if from_ns > 0 && to_ns >= from_ns {
        *longest_s = longest_s.max((to_ns - from_ns) as f64 * 1e-9);
    }
}
