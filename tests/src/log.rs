//! `run.mcap` as a list of messages, and where two of them part.

use mikoshi_ipc_types::Payload;
use mikoshi_observation::{LogReader, PayloadRef};
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
    /// Its name.
    pub name: &'static str,
    /// Index of the robot, or 0.
    pub robot: usize,
    /// Its tick.
    pub tick: u64,
    /// Itself.
    pub payload: Vec<u8>,
}

impl Log {
    /// Reads a whole log.
    pub fn read(path: &Path) -> Self {
        let mut reader = LogReader::open(path).expect("the run left a log");
        let mut messages = Vec::new();
        while let Some(payload) = reader.next_payload().expect("it is of this build") {
            let PayloadRef { name, robot, tick, bytes } = payload;
            messages.push(Message { name, robot, tick, payload: bytes.to_owned() });
        }
        assert!(reader.damage().is_none(), "it is whole");
        Self { messages }
    }

    /// Every payload of a kind, as it was recorded: of robots, all of a tick before those of the next.
    pub fn payloads<P: Payload>(&self) -> Vec<P> {
        let of_kind = self.messages.iter().filter(|message| message.name == P::NAME);
        let payload = |message: &Message| {
            let mut payload = P::zeroed();
            bytemuck::bytes_of_mut(&mut payload).copy_from_slice(&message.payload);
            payload
        };
        of_kind.map(payload).collect()
    }

    /// Where two runs part: payload, robot, tick and field. None if they are the same to the last bit.
    pub fn first_difference(&self, other: &Self) -> Option<String> {
        if self.messages.len() != other.messages.len() {
            return Some(format!("{} messages, {}", self.messages.len(), other.messages.len()));
        }
        let mut pairs = self.messages.iter().zip(&other.messages);
        let (ours, theirs) = pairs.find(|(ours, theirs)| ours != theirs)?;
        if ours.place() != theirs.place() {
            return Some(format!("{} where {} is expected", theirs.place(), ours.place()));
        }
        let offset = ours.payload.iter().zip(&theirs.payload).position(|(a, b)| a != b);
        let field = offset.and_then(|offset| ours.as_ref().field_at(offset));
        Some(format!("{}: {}", ours.place(), field.map_or("its size", |field| field.name)))
    }
}

impl Message {
    fn as_ref(&self) -> PayloadRef<'_> {
        PayloadRef { name: self.name, robot: self.robot, tick: self.tick, bytes: &self.payload }
    }

    fn place(&self) -> String {
        format!("{}[{}] of tick {}", self.name, self.robot, self.tick)
    }
}
