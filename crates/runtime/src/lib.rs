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

mod allocations;
mod awake;
mod board;
mod checkpoint;
mod domain;
mod double;
mod driver;
mod error;
mod mailbox;
mod member;
mod pace;
mod process;
mod pulse;
mod real_time;
mod run_directory;
mod runner;
mod schedule;
mod shared_memory;
mod snapshot;
mod suspicion;
mod topic;
pub mod transport;
mod wait;
mod watch;

pub use allocations::CountingAllocator;
pub use awake::{AwakeError, cores_to_keep_awake, run_when_idle};
pub use board::{Board, BoardError, Role, SlotStatus, State};
pub use checkpoint::{Checkpoint, CheckpointCopy, kept_by};
pub use domain::{Domain, DomainError};
pub use double::Double;
pub use driver::{Driver, TakeWheelError};
pub use error::{FaultCode, TickError};
pub use member::{Entry, JoinError, Member, TAP_LEAD_TICKS};
pub use pace::{now_ns, sleep_until};
pub use process::{ProcessIdentity, ProcessWatch};
pub use pulse::beats;
pub use real_time::{MissingRight, OnMissingRight, RealTime};
pub use run_directory::{FoundRun, RunDirectory, RunDirectoryError};
pub use runner::{Participant, Replaceable, RunFault, Session, run_in_one_thread, run_service};
pub use schedule::{Call, Clock, Input, Output, Phase, Placement, Position, ScheduleError, TickSchedule};
pub use snapshot::{read_parts, read_state, state_schema, write_parts, write_state};
pub use topic::Topic;
pub use transport::iceoryx::{
    IceoryxLink, IceoryxTap, IceoryxTransport, LinkBell, LinkError, OpenError, Outlet, StandIn,
    required_bytes,
};
pub use transport::memory::{InMemoryHub, InMemoryTap, InMemoryTransport};
pub use transport::{
    ConnectError, InOrder, Loan, OBSERVER_DEPTH, Observer, OperatorPort, Publisher, Subscriber, Tap,
    Transport, has_arrived,
};
pub use wait::WaitPolicy;
