//! How frames travel: one contract, [in memory](memory) in one thread and over [iceoryx2](iceoryx)
//! between processes.
//!
//! A service can subscribe to its inputs only. Ground truth is for observers, and this does not
//! compile:
//!
//! ```compile_fail,E0277
//! use mikoshi_ipc_types::{ObjectTruth, ServiceId};
//! use mikoshi_runtime::{InMemoryHub, Placement, TickSchedule, Transport};
//!
//! let hub = InMemoryHub::new(TickSchedule::of_team(4, 0, &Placement::default()).unwrap());
//! let transport = hub.transport(ServiceId::Coordinator);
//! let truth = transport.subscriber::<ObjectTruth>(0);
//! ```
//!
//! The same with an input does:
//!
//! ```
//! use mikoshi_ipc_types::{RobotState, ServiceId};
//! use mikoshi_runtime::{InMemoryHub, Placement, TickSchedule, Transport};
//!
//! let hub = InMemoryHub::new(TickSchedule::of_team(4, 0, &Placement::default()).unwrap());
//! let transport = hub.transport(ServiceId::Coordinator);
//! let state = transport.subscriber::<RobotState>(0).unwrap();
//! ```

mod accept;
#[cfg(test)]
mod conformance;
pub mod iceoryx;
mod in_order;
pub mod memory;

pub use in_order::InOrder;

use crate::{Clock, TickError, TickSchedule, Topic};
use mikoshi_ipc_types::{Frame, OperatorInput, Payload, ServiceId, ServicePayload};

/// Ticks that an observer may fall behind before it loses frames.
pub const OBSERVER_DEPTH: usize = 64;

/// Ticks that go by in wall-clock time until a successor is there, and which it then makes up for.
const BACKLOG: usize = 32;

/// Frames that a consumer's queue holds: one of each tick up to the age that it uses, the next, and two
/// by a successor that repeats what its predecessor may have said.
fn consumer_depth(schedule: &TickSchedule, topic: Topic) -> usize {
    let oldest = schedule.consumers_of(topic).map(|(_, input)| input.age_ticks).max().unwrap_or(0);
    let backlog = match schedule.clock() {
        Clock::Lockstep => 0,
        Clock::Wall { .. } => BACKLOG,
    };
    oldest as usize + 4 + backlog
}

/// The ports of one service.
pub trait Transport {
    /// Publishes `P`.
    type Publisher<P: Payload>: Publisher<P>;
    /// Receives `P`.
    type Subscriber<P: ServicePayload>: Subscriber<P>;

    /// A publisher of `P` about this robot (0 for payloads of the team).
    ///
    /// # Errors
    /// The schedule does not name it as an output of the service; the transport has no room for it.
    fn publisher<P: Payload>(&self, robot: usize) -> Result<Self::Publisher<P>, ConnectError>;

    /// A subscriber to `P` about this robot (0 for payloads of the team).
    ///
    /// # Errors
    /// The schedule does not name it as an input of the service; the transport has no room for it.
    fn subscriber<P: ServicePayload>(&self, robot: usize) -> Result<Self::Subscriber<P>, ConnectError>;

    /// Where the operator is heard.
    fn operator(&self) -> OperatorPort;
}

/// Hears the operator, who speaks at any time: whoever hears it says in which tick, so that a replay can hear it in
/// the same.
pub struct OperatorPort(pub(crate) Box<dyn Fn(&OperatorInput) -> OperatorInput>);

impl OperatorPort {
    /// Where nobody speaks.
    pub fn silent() -> Self {
        Self(Box::new(|last| *last))
    }

    /// What the operator says now, after it was heard to say `last`; that again, where nothing can be made out.
    pub fn hear(&self, last: &OperatorInput) -> OperatorInput {
        (self.0)(last)
    }
}

/// The ports of an observer: any payload, ground truth included; it publishes nothing.
pub trait Tap {
    /// Observes `P`.
    type Observer<P: Payload>: Observer<P>;

    /// An observer of `P` about this robot (0 for payloads of the team).
    ///
    /// # Errors
    /// Nobody publishes it; the transport has no room for it.
    fn observer<P: Payload>(&self, robot: usize) -> Result<Self::Observer<P>, ConnectError>;
}

/// Publishes one frame a tick.
pub trait Publisher<P: Payload> {
    /// A frame on its way.
    type Loan<'a>: Loan<P>
    where
        Self: 'a;

    /// A zeroed frame for this tick, to be filled in place.
    ///
    /// # Errors
    /// [`TickError::PublisherFull`].
    fn loan(&mut self, tick: u64) -> Result<Self::Loan<'_>, TickError>;

    /// Publishes a payload that was made elsewhere.
    ///
    /// # Errors
    /// As [`Publisher::loan`] and [`Loan::send`].
    fn send(&mut self, tick: u64, payload: &P) -> Result<(), TickError> {
        let mut loan = self.loan(tick)?;
        *loan.payload_mut() = *payload;
        loan.send()
    }
}

/// A frame that has been loaned, and is to be filled and sent. What is dropped is not sent.
pub trait Loan<P: Payload> {
    /// The payload, zeroed at first.
    fn payload_mut(&mut self) -> &mut P;

    /// Publishes the frame.
    ///
    /// # Errors
    /// [`TickError::TransportFailed`].
    fn send(self) -> Result<(), TickError>;
}

/// Receives the frames of one topic, tick by tick.
pub trait Subscriber<P: Payload> {
    /// Waits for the frame of exactly this tick and copies it to `frame`. Frames of earlier ticks and
    /// of earlier epochs are dropped.
    ///
    /// # Errors
    /// The frame does not come, or is not of this schema, robot, epoch and tick, or holds a value that
    /// is not finite. Then `frame` is as it was.
    fn receive(&mut self, tick: u64, frame: &mut Frame<P>) -> Result<(), TickError>;
}

/// Whether a frame of the tick has come, though it may hold what can't be used.
pub fn has_arrived(received: &Result<(), TickError>) -> bool {
    matches!(received, Ok(()) | Err(TickError::NotFinite { .. }))
}

/// Sees every frame of one topic, as it is: nothing is checked but that it can be read.
pub trait Observer<P: Payload> {
    /// The next frame in order, if there is one.
    ///
    /// # Errors
    /// [`TickError::WrongSchema`], [`TickError::TransportFailed`].
    fn try_receive(&mut self, frame: &mut Frame<P>) -> Result<bool, TickError>;

    /// Waits for the next frame in order. There is none once all services have ended, or where nobody
    /// could publish it meanwhile: in one thread.
    ///
    /// # Errors
    /// As [`Observer::try_receive`]; a process is lost or the run is to stop, and no frame is left.
    fn receive(&mut self, frame: &mut Frame<P>) -> Result<bool, TickError>;
}

/// Why a port could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ConnectError {
    /// The schedule has no such output.
    #[error("{service} does not publish {topic} by the schedule")]
    NotAnOutput {
        /// Who asked.
        service: ServiceId,
        /// For what.
        topic: Topic,
    },
    /// The schedule has no such input.
    #[error("{service} does not wait for {topic} by the schedule")]
    NotAnInput {
        /// Who asked.
        service: ServiceId,
        /// For what.
        topic: Topic,
    },
    /// Nobody publishes what is to be observed.
    #[error("nobody publishes {topic} by the schedule")]
    NotPublished {
        /// What.
        topic: Topic,
    },
    /// The transport has no room for it, or another build publishes another layout under this name.
    #[error("{topic} can't be connected: {reason}")]
    Failed {
        /// What.
        topic: Topic,
        /// What the transport says.
        reason: String,
    },
}
