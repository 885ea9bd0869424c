//! The mikoshi command: run, plan, status, doctor.

pub mod arguments;
pub mod failure;
mod fraction;
mod print;

use clap::Parser;
use std::process::ExitCode;

/// The whole command: parses what was typed, does it, says what went wrong.
pub fn main_of_command() -> ExitCode {
    let _ = arguments::Arguments::parse();
    ExitCode::SUCCESS
}
