//! The mikoshi command: run, replay, swap, report, sweep, plan, status, doctor.
//!
//! Three programs share this library: `mikoshi`, which runs a scenario as one process per service,
//! `mikoshi-in-process`, which runs it in one thread and is what `mikoshi run --in-process`, `mikoshi replay`
//! and `mikoshi render` become, and `mikoshi-view`, which `mikoshi view` becomes and which is built apart.
//! Only the second links to the simulator: without its library `mikoshi` still starts, and says what is
//! missing.

pub mod arguments;
pub mod aside;
mod awake;
mod binaries;
mod burden;
mod children;
pub mod commands;
mod control;
mod drive;
pub mod failure;
pub mod feed;
mod fraction;
mod gain;
pub mod interrupts;
mod judge;
mod latency;
mod meals;
mod membership;
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
mod system;
mod table;
mod terminal;
mod top;
mod viewer;
mod wall_clock;
pub mod watched_run;
mod way;

use arguments::{Arguments, Command, RenderArguments, ReplayArguments, RunArguments, WatchArguments};
use clap::Parser;
use failure::{Failure, Status, as_lines};
use mikoshi_process::journal;
use std::env;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::ExitCode;

/// The whole `mikoshi` command.
pub fn main_of_command() -> ExitCode {
    start_logging();
    let command = Arguments::parse().command;
    let result = match &command {
        Command::Run(arguments) if arguments.in_process => become_in_process(),
        Command::Run(arguments) => commands::run::run(arguments, supervisor::supervise),
        Command::Adopt(arguments) => commands::adopt::adopt(arguments),
        Command::Record(arguments) => commands::record::record(arguments),
        Command::View(_) => become_viewer(),
        Command::Replay(_) | Command::Render(_) => become_in_process(),
        Command::Swap(arguments) => commands::swap::swap(arguments).map(|()| Status::Met),
        Command::Stop(arguments) => commands::operator::stop(arguments).map(|()| Status::Met),
        Command::Resume(arguments) => commands::operator::resume(arguments).map(|()| Status::Met),
        Command::Drive(arguments) => drive::drive(arguments),
        Command::Push(arguments) => commands::push::push(arguments).map(|()| Status::Met),
        Command::Leave(arguments) => commands::membership::leave(arguments).map(|()| Status::Met),
        Command::Join(arguments) => commands::membership::join(arguments).map(|()| Status::Met),
        Command::Set(arguments) => commands::set::set(arguments).map(|()| Status::Met),
        Command::Soak(arguments) => soak::soak(arguments),
        Command::Latency(arguments) => latency::latency(arguments),
        Command::Report(arguments) => commands::report::report(arguments).map(|()| Status::Met),
        Command::Sweep(arguments) => commands::sweep::sweep(arguments),
        Command::Plan(arguments) => commands::plan::plan(arguments).map(|()| Status::Met),
        Command::CheckRobot(arguments) => commands::check_robot::check_robot(arguments).map(|()| Status::Met),
        Command::Top(arguments) => top::top(arguments),
        Command::Status(arguments) => commands::status::status(arguments).map(|()| Status::Met),
        Command::Doctor(arguments) => commands::doctor::doctor(arguments),
        Command::Install(arguments) => system::install(arguments).map(|()| Status::Met),
        Command::Uninstall(arguments) => system::uninstall(arguments).map(|()| Status::Met),
        Command::Service(command) => system::service(command).map(|()| Status::Met),
        Command::Completions(arguments) => Ok(commands::shell::completions(arguments)),
        Command::Man(arguments) => commands::shell::man(arguments).map(|()| Status::Met),
    };
    conclude(result, command.wants_json())
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
    let command = Arguments::parse().command;
    let result = match &command {
        Command::Run(arguments) => run(arguments),
        Command::Replay(arguments) => replay(arguments),
        Command::Render(arguments) => render(arguments).map(|()| Status::Met),
        _ => Err(Failure {
            status: Status::Usage,
            message: "this program only runs, replays and renders in one thread: use `mikoshi`".to_owned(),
        }),
    };
    conclude(result, command.wants_json())
}

/// `mikoshi-view` reads the same command line, too; `view` carries out what it asks for.
pub fn main_of_viewer(view: impl FnOnce(&WatchArguments) -> Result<Status, Failure>) -> ExitCode {
    start_logging();
    let command = Arguments::parse().command;
    let result = match &command {
        Command::View(arguments) => view(arguments),
        _ => Err(Failure {
            status: Status::Usage,
            message: "this program only shows runs: use `mikoshi`".to_owned(),
        }),
    };
    conclude(result, command.wants_json())
}

fn become_in_process() -> Result<Status, Failure> {
    binaries::simulator_version()?;
    become_program(&binaries::find(binaries::IN_PROCESS)?)
}

fn become_viewer() -> Result<Status, Failure> {
    become_program(&binaries::find_viewer()?)
}

/// Replaces this process, so that signals and exit status need no passing on.
fn become_program(program: &Path) -> Result<Status, Failure> {
    let error = std::process::Command::new(program).args(env::args_os().skip(1)).exec();
    Err(Failure::fault(error).context(program.display()))
}

fn conclude(result: Result<Status, Failure>, wants_json: bool) -> ExitCode {
    let status = result.unwrap_or_else(|failure| {
        print::print_error(&match wants_json {
            true => failure.to_json() + "\n",
            false => as_lines("error", &failure.message),
        });
        failure.status
    });
    status.into()
}

/// Warnings of libraries go to standard error, or to the journal.
fn start_logging() {
    if journal::is_open() {
        return;
    }
    let colours = env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    // It fails where somebody logs already.
    let _ = tracing_subscriber::fmt()
        .with_env_filter(journal::filter())
        .with_writer(std::io::stderr)
        .with_ansi(colours && std::io::IsTerminal::is_terminal(&std::io::stderr()))
        .try_init();
}
