//! How carrying out a run ended.

use crate::failure::Failure;
use mikoshi_observation::Fault;

/// How carrying out a run ended.
#[derive(Debug)]
pub enum Outcome {
    /// All ticks were executed and observed.
    Completed,
    /// This signal asked for an end.
    Interrupted(u8),
    /// Something failed.
    Fault {
        /// For people.
        failure: Failure,
        /// For scripts.
        faults: Vec<Fault>,
    },
}
