//! The mikoshi command: run, replay, swap, report, sweep, plan, status, doctor.
//!
//! Two programs share this library: `mikoshi`, which runs a scenario as one process per service, and
//! `mikoshi-in-process`, which runs it in one thread and is what `mikoshi run --in-process`, `mikoshi replay`
//! and `mikoshi render` become.
//! Only the latter links to the simulator: without its library `mikoshi` still starts, and says what is
//! missing.

pub mod arguments;
mod binaries;
mod children;
pub mod commands;
mod control;
pub mod failure;
mod feed;
mod fraction;
mod gain;
pub mod interrupts;
mod judge;
mod latency;
mod observed_run;
pub mod observer;
mod orphans;
pub mod outcome;
pub mod output_directory;
pub mod prepare;
pub mod print;
mod process_status;
mod progress;
mod pull;
pub mod replay;
mod report;
mod requests;
mod revise;
mod service_process;
mod soak;
mod socket;
mod stamps;
mod standstill;
mod succession;
mod supervisor;
mod sweep;
mod table;
mod wall_clock;

use arguments::{Arguments, Command, RenderArguments, ReplayArguments, RunArguments};
use clap::Parser;
use failure::{Failure, Status, as_lines};
use std::env;
use std::os::unix::process::CommandExt;
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

/// The whole `mikoshi` command.
pub fn main_of_command() -> ExitCode {
    start_logging();
    conclude(match &Arguments::parse().command {
        Command::Run(arguments) if arguments.in_process => become_in_process(),
        Command::Run(arguments) => commands::run::run(arguments, supervisor::supervise),
        Command::Adopt(arguments) => commands::adopt::adopt(arguments),
        Command::Record(arguments) => commands::record::record(arguments),
        Command::Replay(_) | Command::Render(_) => become_in_process(),
        Command::Swap(arguments) => commands::swap::swap(arguments).map(|()| Status::Met),
        Command::Stop(arguments) => commands::operator::stop(arguments).map(|()| Status::Met),
        Command::Resume(arguments) => commands::operator::resume(arguments).map(|()| Status::Met),
        Command::Soak(arguments) => soak::soak(arguments),
        Command::Latency(arguments) => latency::latency(arguments),
        Command::Report(arguments) => commands::report::report(arguments).map(|()| Status::Met),
        Command::Sweep(arguments) => commands::sweep::sweep(arguments),
        Command::Plan(arguments) => commands::plan::plan(arguments).map(|()| Status::Met),
        Command::CheckRobot(arguments) => commands::check_robot::check_robot(arguments).map(|()| Status::Met),
        Command::Status(arguments) => commands::status::status(arguments).map(|()| Status::Met),
        Command::Doctor(arguments) => commands::doctor::doctor(arguments),
    })
}

/// `mikoshi-in-process` reads the same command line; `run`, `replay` and `render` carry out what it asks for. Asked for its
/// version, it says which simulator it has.
pub fn main_of_in_process(
    simulator: &str,
    run: impl FnOnce(&RunArguments) -> Result<Status, Failure>,
    replay: impl FnOnce(&ReplayArguments) -> Result<Status, Failure>,
    render: impl FnOnce(&RenderArguments) -> Result<(), Failure>,
) -> ExitCode {
    if env::args_os().skip(1).eq(["--version"]) {
        print::print_out(&format!("{simulator}\n"));
        return Status::Met.into();
    }
    start_logging();
    conclude(match &Arguments::parse().command {
        Command::Run(arguments) => run(arguments),
        Command::Replay(arguments) => replay(arguments),
        Command::Render(arguments) => render(arguments).map(|()| Status::Met),
        _ => Err(Failure {
            status: Status::Usage,
            message: "this program only runs, replays and renders in one thread: use `mikoshi`".to_owned(),
        }),
    })
}

/// Replaces this process, so that signals and exit status need no passing on.
fn become_in_process() -> Result<Status, Failure> {
    binaries::simulator_version()?;
    let program = binaries::find(binaries::IN_PROCESS)?;
    let error = std::process::Command::new(&program).args(env::args_os().skip(1)).exec();
    Err(Failure::fault(error).context(program.display()))
}

fn conclude(result: Result<Status, Failure>) -> ExitCode {
    let status = result.unwrap_or_else(|failure| {
        print::print_error(&as_lines("error", &failure.message));
        failure.status
    });
    status.into()
}

/// Warnings of libraries go to standard error; `MIKOSHI_LOG` changes what is told.
fn start_logging() {
    let filter = EnvFilter::try_from_env("MIKOSHI_LOG").unwrap_or_else(|_| EnvFilter::new("warn"));
    let colours = env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    // It fails where somebody logs already.
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(colours && std::io::IsTerminal::is_terminal(&std::io::stderr()))
        .try_init();
}
