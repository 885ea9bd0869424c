//! `/log`: what the team does and why it stops, in words, when it changes.

use crate::convert::timestamp;
use crate::topic::Topic;
use foxglove::messages::Log;
use foxglove::messages::log::Level;
use mikoshi_ipc_types::{TeamState, mode, stop_cause};
use mikoshi_observation::{LogWriter, Observation, WriteLogError};

/// What was last said.
pub struct Events {
    topic: Topic<Log>,
    robots: Vec<String>,
    mode: u64,
    stop_cause: u64,
    absent_hands: u64,
}

impl Events {
    pub fn add(log: &mut LogWriter, robots: Vec<String>) -> Result<Self, WriteLogError> {
        let topic = Topic::add(log, "/log")?;
        Ok(Self { topic, robots, mode: 0, stop_cause: 0, absent_hands: 0 })
    }

    /// Ticks come in order, all of them.
    pub fn write(
        &mut self,
        log: &mut LogWriter,
        time_ns: u64,
        observation: &Observation,
    ) -> Result<(), WriteLogError> {
        let team = &observation.team_state.payload;
        let mut said = vec![];
        if core::mem::replace(&mut self.mode, team.team_mode) != team.team_mode {
            said.push((Level::Info, mode::name(team.team_mode).to_owned()));
        }
        if core::mem::replace(&mut self.stop_cause, team.stop_cause) != team.stop_cause
            && team.stop_cause != 0
        {
            said.push((Level::Warning, self.stop(team)));
        }
        let lost = team.absent_hands & !core::mem::replace(&mut self.absent_hands, team.absent_hands);
        let hands = (0..u64::BITS).filter(|hand| lost >> hand & 1 != 0);
        let cause = stop_cause::name(team.loss_cause);
        said.extend(
            hands.map(|hand| (Level::Warning, format!("hand {hand} of the team lost the object: {cause}"))),
        );
        for (level, message) in said {
            let entry = Log {
                timestamp: Some(timestamp(time_ns)),
                level: level as i32,
                message,
                name: "coordinator".to_owned(),
                ..Log::default()
            };
            self.topic.write(log, observation.tick(), &entry)?;
        }
        Ok(())
    }

    fn stop(&self, team: &TeamState) -> String {
        let robot = (team.stop_robot as usize).checked_sub(1).and_then(|index| self.robots.get(index));
        let of_robot = robot.map_or_else(String::new, |robot| format!(", robot {robot}"));
        format!("safe stop: {}{of_robot}", stop_cause::name(team.stop_cause))
    }
}
