//! The exchange of frames in a tick over Mikoshi's transport, and over what people would use instead: the same six
//! processes on the same two cores, the same schedule, the same sizes of frames.

mod carrier;
mod check;
mod compare;
mod driver;
mod drivers;
mod ports;
mod serve;
mod tap;
mod team;
mod witness;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

#[derive(Debug, Parser)]
#[command(about, version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Measure all of them in one run
    Compare(compare::Measurement),
    /// Whether one of them delivers every frame
    Check(check::Check),
    /// One process of a team
    #[command(hide = true)]
    Serve(serve::Service),
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Compare(measurement) => compare::compare(&measurement),
        Command::Check(check) => check::check(&check),
        Command::Serve(service) => serve::serve(&service),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
