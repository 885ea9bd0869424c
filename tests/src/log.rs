//! `run.mcap` as a list of messages, and where two of them part.

use mcap::MessageStream;
use mikoshi_ipc_types::{
    JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Sensors, TeamCommand, TeamState,
};
use std::fs;
use std::path::Path;

/// Every payload of a run, in the order in which it was recorded.
#[derive(Clone, Debug)]
pub struct Log {
    /// The payloads.
    pub messages: Vec<Message>,
}

/// One payload.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// `payload/robot`.
    pub topic: String,
    /// Its tick.
    pub tick: u32,
    /// Itself.
    pub payload: Vec<u8>,
}

impl Log {
    /// Reads a whole log.
    pub fn read(path: &Path) -> Self {
        let bytes = fs::read(path).expect("the run left a log");
        let messages = MessageStream::new(&bytes).expect("it is an MCAP file").map(|message| {
            let message = message.expect("it is whole");
            Message {
                topic: message.channel.topic.clone(),
                tick: message.sequence,
                payload: message.data.into_owned(),
            }
        });
        Self { messages: messages.collect() }
    }

    /// Where two runs part: topic, tick and field. None if they are the same to the last bit.
    pub fn first_difference(&self, other: &Self) -> Option<String> {
        if self.messages.len() != other.messages.len() {
            return Some(format!("{} messages, {}", self.messages.len(), other.messages.len()));
        }
        let mut pairs = self.messages.iter().zip(&other.messages);
        let (ours, theirs) = pairs.find(|(ours, theirs)| ours != theirs)?;
        if (&ours.topic, ours.tick) != (&theirs.topic, theirs.tick) {
            return Some(format!(
                "{} of tick {} where {} of tick {} is expected",
                theirs.topic, theirs.tick, ours.topic, ours.tick
            ));
        }
        let offset = ours.payload.iter().zip(&theirs.payload).position(|(a, b)| a != b);
        let field = offset.and_then(|offset| field_at(&ours.topic, offset)).unwrap_or("its size");
        Some(format!("{} of tick {}: {field}", ours.topic, ours.tick))
    }
}

/// The field of a topic's payload that holds this byte.
fn field_at(topic: &str, offset: usize) -> Option<&'static str> {
    fn of<P: Payload>(offset: usize) -> Option<&'static str> {
        P::field_at(offset).map(|field| field.name)
    }
    match topic.split_once('/')?.0 {
        Sensors::NAME => of::<Sensors>(offset),
        ObjectTruth::NAME => of::<ObjectTruth>(offset),
        RobotTruth::NAME => of::<RobotTruth>(offset),
        RobotState::NAME => of::<RobotState>(offset),
        TeamCommand::NAME => of::<TeamCommand>(offset),
        TeamState::NAME => of::<TeamState>(offset),
        JointCommand::NAME => of::<JointCommand>(offset),
        _ => None,
    }
}
