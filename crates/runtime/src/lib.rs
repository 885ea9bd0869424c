//! Tick schedules, runners, transports, waiting, domains, affinity: everything about *when* and
//! *where*, and nothing about *what*.
//!
//! This crate knows no control, no robot and no physics. It is the only one that knows iceoryx2,
//! shared memory, futexes and process ids.
//!
//! # Glossary
//! - **tick**: one period of control; time is the integer number of ticks.
//! - **phase**: one call of one service in a tick. The [`TickSchedule`] lists them.
//! - **lockstep**: every service waits for its inputs, however long they take; nothing reads a clock.
//! - **topic**: one payload about one robot, published once a tick.

mod error;
mod runner;
mod schedule;
mod topic;
pub mod transport;

pub use error::{FaultCode, TickError};
pub use runner::{Participant, RunFault, run_in_one_thread};
pub use schedule::{Call, Input, MAX_AGE_TICKS, Output, Phase, Placement, ScheduleError, TickSchedule};
pub use topic::Topic;
pub use transport::memory::{InMemoryHub, InMemoryTap, InMemoryTransport};
pub use transport::{ConnectError, Loan, Observer, Publisher, Subscriber, Tap, Transport};
