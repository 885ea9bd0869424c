//! What a run looked like: its frames in canonical order, their hash, its figures, its summary.
//!
//! Observers only: nothing here is ever read by a service. Figures are computed from ground truth.

#![allow(non_snake_case)]

mod bytes;
mod canonical;
mod course;
mod events;
mod figures;
mod freshness;
mod internal;
mod latency;
mod load;
mod log;
mod longest;
mod members;
mod reader;
mod summary;
mod support;
mod tap;
mod truth;

pub use canonical::{LogHash, Observation, Observed, PayloadRef};
pub use events::{Event, Events, lost_hands, safe_stop_text};
pub use figures::{Figures, JudgedFigures, ObservedJoint, ObservedRobot, ObservedRun};
pub use freshness::Freshness;
pub use latency::{LateTick, LatencyFigures, PhaseTimes, Span, SpanSummary, WorstTick, times_ns};
pub use log::{ChannelSchema, LogWriter, WriteLogError};
pub use longest::{LongestTimes, ServoTimes};
pub use reader::{LogReader, ReadLogError, Revision, read_revisions};
pub use summary::{
    Fault, InternalSummary, LoadSummary, MemberSummary, MinuteSummary, ModeSummary, ObjectSummary,
    RobotSummary, Summary, Swap, Timing,
};
pub use support::true_support;
pub use tap::TeamTap;
pub use truth::{FootTracker, ObjectTracker, TrackedObject, is_loaded};
