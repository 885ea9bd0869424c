//! What tests across processes share: the programs, runs of them, and the logs that runs leave.
//!
//! Tests here see what a user sees: a command line, an exit status, files, and what is left behind.

pub mod log;
pub mod programs;
pub mod run;
pub mod scenarios;
pub mod screen;
