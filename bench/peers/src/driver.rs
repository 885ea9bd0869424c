//! What carries frames, as the harness sees it.

use clap::ValueEnum;
use core::fmt;
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{Topic, WaitPolicy};
use serde::Serialize;
use std::path::Path;
use std::time::Duration;

/// How a process waits for a frame. What waits differently is not compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Wait {
    /// It sleeps at once, and is woken.
    Blocking,
    /// It gives way to others and looks again, for ever.
    Yielding,
}

impl Wait {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Blocking, Self::Yielding];

    /// The same, for Mikoshi's transport.
    pub fn policy(self) -> WaitPolicy {
        const FOR_EVER: Duration = Duration::from_secs(3600);
        WaitPolicy {
            yield_for: if self == Self::Yielding { FOR_EVER } else { Duration::ZERO },
            ..WaitPolicy::default()
        }
    }

    /// Gives way until there is something.
    pub fn yield_until<T, E>(mut poll: impl FnMut() -> Result<Option<T>, E>) -> Result<T, E> {
        loop {
            if let Some(found) = poll()? {
                return Ok(found);
            }
            rustix::thread::sched_yield();
        }
    }
}

impl fmt::Display for Wait {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Blocking => "blocking",
            Self::Yielding => "yielding",
        })
    }
}

/// Why frames are not carried.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct DriverError(pub String);

impl DriverError {
    /// In the words of whoever failed.
    pub fn of(problem: impl fmt::Display) -> Self {
        Self(problem.to_string())
    }
}

/// One end of a topic.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// Which topic.
    pub topic: Topic,
    /// Bytes of its frames.
    pub frame_bytes: usize,
    /// Whether a service waits for it. What only observers see is sent all the same, to nobody.
    pub has_reader: bool,
}

impl End {
    /// A name that no other topic of the team has.
    pub fn name(&self) -> String {
        format!("{}-{}", self.topic.payload, self.topic.robot)
    }
}

/// The ends that one process has of all topics. The harness uses it in lockstep: before a frame of a topic is
/// sent, the one before has been received.
pub trait Driver: Sized {
    /// Sends the frames of one topic.
    type Sender: Sender + 'static;
    /// Receives the frames of one topic.
    type Receiver: Receiver + 'static;

    /// Of this service in the team whose place is this directory.
    fn open(place: &Path, service: ServiceId, wait: Wait) -> Result<Self, DriverError>;

    /// The sending end of a topic. Its receiver may come later: the first frame waits for it.
    fn sender(&self, end: End) -> Result<Self::Sender, DriverError>;

    /// The receiving end of a topic.
    fn receiver(&self, end: End) -> Result<Self::Receiver, DriverError>;
}

/// Sends the frames of one topic.
pub trait Sender {
    /// Sends a frame of the topic's size.
    fn send(&mut self, frame: &[u8]) -> Result<(), DriverError>;
}

/// Receives the frames of one topic.
pub trait Receiver {
    /// Waits for the next frame, and copies it out.
    fn receive(&mut self, frame: &mut [u8]) -> Result<(), DriverError>;
}
