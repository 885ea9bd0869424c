//! `/log`: what the team does and why it stops, in words, when it changes.

use crate::convert::timestamp;
use crate::topic::Topic;
use foxglove::messages::Log;
use foxglove::messages::log::Level;
use mikoshi_observation::{LogWriter, Observation, WriteLogError};

/// What happens.
pub struct Events {
    topic: Topic<Log>,
    events: mikoshi_observation::Events,
}

impl Events {
    pub fn add(log: &mut LogWriter, robots: Vec<String>) -> Result<Self, WriteLogError> {
        let topic = Topic::add(log, "/log")?;
        Ok(Self { topic, events: mikoshi_observation::Events::of_team(robots) })
    }

    /// Ticks come in order, all of them.
    pub fn write(
        &mut self,
        log: &mut LogWriter,
        time_ns: u64,
        observation: &Observation,
    ) -> Result<(), WriteLogError> {
        for event in self.events.observe(observation) {
            let level = if event.is_warning { Level::Warning } else { Level::Info };
            let entry = Log {
                timestamp: Some(timestamp(time_ns)),
                level: level as i32,
                message: event.message,
                name: "coordinator".to_owned(),
                ..Log::default()
            };
            self.topic.write(log, observation.tick(), &entry)?;
        }
        Ok(())
    }
}
