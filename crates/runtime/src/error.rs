//! What can go wrong inside a tick.

use crate::Topic;
use core::fmt;
use mikoshi_ipc_types::ServiceId;

/// Why a tick could not be executed. In lockstep any of them ends the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TickError {
    /// Nobody published the input, and nobody will.
    #[error("no {topic} of tick {tick} arrived")]
    InputMissing {
        /// The input.
        topic: Topic,
        /// The tick it was expected for.
        tick: u64,
    },
    /// The frame's schema is not ours.
    #[error("{topic} has another schema")]
    WrongSchema {
        /// The input.
        topic: Topic,
    },
    /// The frame is about another robot.
    #[error("{topic} carries a frame of robot {found}")]
    WrongRobot {
        /// The input.
        topic: Topic,
        /// The robot that the frame names.
        found: u64,
    },
    /// The frame comes from an incarnation that has not been announced.
    #[error("{topic} carries epoch {found}, announced is {announced}")]
    WrongEpoch {
        /// The input.
        topic: Topic,
        /// The announced epoch of its publisher.
        announced: u64,
        /// The epoch that the frame names.
        found: u64,
    },
    /// A tick was skipped: the next frame is of a later one.
    #[error("{topic}: tick {expected} was skipped, {found} follows")]
    FutureTick {
        /// The input.
        topic: Topic,
        /// The tick that was waited for.
        expected: u64,
        /// The tick that came.
        found: u64,
    },
    /// A value of the frame is NaN or infinite.
    #[error("{topic} of tick {tick}: {field} is not finite")]
    NotFinite {
        /// The input.
        topic: Topic,
        /// The frame's tick.
        tick: u64,
        /// The first such field.
        field: &'static str,
    },
    /// The transport has no room for another frame: a receiver holds what it should have returned.
    #[error("{topic}: no room for the frame of tick {tick}")]
    PublisherFull {
        /// The output.
        topic: Topic,
        /// The tick to be published.
        tick: u64,
    },
    /// The transport itself failed.
    #[error("{topic}: the transport failed")]
    TransportFailed {
        /// The input or output.
        topic: Topic,
    },
    /// Shared memory has no room for what the run has mapped.
    #[error("shared memory is full")]
    SharedMemoryFull,
    /// A process of the run has died or has failed.
    #[error("{0} is gone")]
    PeerLost(ServiceId),
    /// The supervisor of the run is gone.
    #[error("the supervisor is gone")]
    SupervisorLost,
    /// The run was asked to stop.
    #[error("stopped")]
    Stopped,
    /// The service's own fault, in its own words.
    #[error("{0}")]
    Service(&'static str),
    /// The service was asked for a call that it does not have.
    #[error("a call that the service does not have")]
    UnknownCall,
    /// A successor is ready, and takes over.
    #[error("replaced by a successor")]
    Retired,
    /// A successor has taken over meanwhile.
    #[error("a successor is in charge")]
    Fenced,
    /// What is to be kept for a successor can't be written, or what a predecessor kept can't be read.
    #[error("checkpoint: {0}")]
    Checkpoint(&'static str),
    /// The process ended without saying why: a panic, for instance.
    #[error("aborted")]
    Aborted,
}

/// The kind of a [`TickError`], as boards and summaries name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u32)]
#[allow(missing_docs)]
pub enum FaultCode {
    InputMissing = 1,
    WrongSchema,
    WrongRobot,
    WrongEpoch,
    FutureTick,
    NotFinite,
    PublisherFull,
    TransportFailed,
    SharedMemoryFull,
    PeerLost,
    SupervisorLost,
    Stopped,
    Service,
    UnknownCall,
    Aborted,
    Retired,
    Fenced,
    Checkpoint,
}

impl FaultCode {
    const ALL: [(Self, &'static str); 18] = [
        (Self::InputMissing, "input-missing"),
        (Self::WrongSchema, "wrong-schema"),
        (Self::WrongRobot, "wrong-robot"),
        (Self::WrongEpoch, "wrong-epoch"),
        (Self::FutureTick, "future-tick"),
        (Self::NotFinite, "not-finite"),
        (Self::PublisherFull, "publisher-full"),
        (Self::TransportFailed, "transport-failed"),
        (Self::SharedMemoryFull, "shared-memory-full"),
        (Self::PeerLost, "peer-lost"),
        (Self::SupervisorLost, "supervisor-lost"),
        (Self::Stopped, "stopped"),
        (Self::Service, "service"),
        (Self::UnknownCall, "unknown-call"),
        (Self::Aborted, "aborted"),
        (Self::Retired, "retired"),
        (Self::Fenced, "fenced"),
        (Self::Checkpoint, "checkpoint"),
    ];

    /// The code with this number, if there is one.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.into_iter().map(|(code, _)| code).find(|code| *code as u32 == number)
    }
}

impl fmt::Display for FaultCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = Self::ALL.into_iter().find(|(code, _)| code == self).map_or("unknown", |(_, name)| name);
        f.write_str(name)
    }
}

impl TickError {
    /// Its kind.
    pub fn code(&self) -> FaultCode {
        match self {
            Self::InputMissing { .. } => FaultCode::InputMissing,
            Self::WrongSchema { .. } => FaultCode::WrongSchema,
            Self::WrongRobot { .. } => FaultCode::WrongRobot,
            Self::WrongEpoch { .. } => FaultCode::WrongEpoch,
            Self::FutureTick { .. } => FaultCode::FutureTick,
            Self::NotFinite { .. } => FaultCode::NotFinite,
            Self::PublisherFull { .. } => FaultCode::PublisherFull,
            Self::TransportFailed { .. } => FaultCode::TransportFailed,
            Self::SharedMemoryFull => FaultCode::SharedMemoryFull,
            Self::PeerLost(_) => FaultCode::PeerLost,
            Self::SupervisorLost => FaultCode::SupervisorLost,
            Self::Stopped => FaultCode::Stopped,
            Self::Service(_) => FaultCode::Service,
            Self::UnknownCall => FaultCode::UnknownCall,
            Self::Aborted => FaultCode::Aborted,
            Self::Retired => FaultCode::Retired,
            Self::Fenced => FaultCode::Fenced,
            Self::Checkpoint(_) => FaultCode::Checkpoint,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_code_survives_its_number() {
        for (code, name) in FaultCode::ALL {
            assert_eq!(FaultCode::from_number(code as u32), Some(code));
            assert_eq!(code.to_string(), name);
        }
        assert_eq!(FaultCode::from_number(0), None);
    }
}
