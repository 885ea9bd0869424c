//! `mikoshi-link`: carries the frames of a run between the hosts of a team.
//!
//! On every host it holds the places of the services that live elsewhere: services know nothing of it.

use clap::{Args, Parser, Subcommand};
use core::time::Duration;
use mikoshi_ipc_types::ServiceId;
use mikoshi_link::carry::Carrier;
use mikoshi_link::certify::{CertifyArguments, certify};
use mikoshi_link::expiry::Expiry;
use mikoshi_link::keys::Keys;
use mikoshi_link::measure::{MeasureArguments, measure};
use mikoshi_link::peers::Peers;
use mikoshi_link::report::{Reporter, Told};
use mikoshi_link::session::{self, Certificates, Parts};
use mikoshi_link::task::Task;
use mikoshi_process::journal::{About, Severity, say};
use mikoshi_process::{ServeError, notify, policy_of};
use mikoshi_resolution::{crossings, read_run, tick_schedule};
use mikoshi_runtime::{Board, OnMissingRight, RealTime, TickError, beats};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

#[derive(Parser)]
#[command(version, about = "Carries the frames of a run between the hosts of a team")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Carry the frames of the run in a directory, as one of its hosts
    Carry(CarryArguments),
    /// Make an authority, and a certificate by it for every host of a scenario
    Certify(CertifyArguments),
    /// Measure the way to another host and back
    Measure(MeasureArguments),
}

#[derive(Args)]
struct CarryArguments {
    /// Directory of the run, as `mikoshi service prepare` made it
    #[arg(long, value_name = "DIR")]
    run: PathBuf,
    /// Which of the scenario's hosts this one is [default: the one of this name]
    #[arg(long, value_name = "NAME")]
    host: Option<String>,
    /// Where `mikoshi-link certify` has put the certificates: ca.pem, NAME.pem, NAME-key.pem
    #[arg(long, value_name = "DIR")]
    certificates: PathBuf,
}

/// For how long others are told in the end that all is done here.
const FAREWELL: Duration = Duration::from_millis(500);

fn main() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Carry(arguments) => carry(&arguments),
        Command::Certify(arguments) => certify(&arguments),
        Command::Measure(arguments) => measure(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => error.report(),
    }
}

fn carry(arguments: &CarryArguments) -> Result<(), ServeError> {
    let run = read_run(&arguments.run).map_err(ServeError::fault)?;
    let schedule = tick_schedule(&run).map_err(ServeError::configuration)?;
    let names: Vec<_> = run.scenario.hosts.iter().map(|host| host.name.as_str()).collect();
    let own = || rustix::system::uname().nodename().to_string_lossy().into_owned();
    let name = arguments.host.clone().unwrap_or_else(own);
    let host = names.iter().position(|known| *known == name).ok_or_else(|| {
        let known = names.join(", ");
        ServeError::configuration(format!("there is no host `{name}` in this run; expected one of {known}"))
    })?;
    let certificates = Certificates::of(&arguments.certificates, &name).map_err(ServeError::configuration)?;
    let expiry = Expiry::of(&certificates).map_err(ServeError::configuration)?;
    let hash = *blake3::hash(&run.encode()).as_bytes();
    let peers = Arc::new(Peers::new(&run, hash, host, incarnation()));
    let keys = Keys::of(&run);
    let crossings = crossings(&run, &schedule);
    let task =
        Task { directory: &arguments.run, run: &run, schedule: &schedule, crossings: &crossings, host };
    let parts = Parts::of(&run, &keys, host, &task.pairs(), session::Carrier::Quic);
    let session = session::open(&parts, &certificates).map_err(ServeError::fault)?;
    let opened = Carrier::open(task, policy_of(&run), &session, &keys, Arc::clone(&peers));
    let mut carrier = opened.map_err(ServeError::fault)?;
    let told = Told { peers, sources: carrier.sources(), kept: carrier.kept(), expiry };
    let reporter = Reporter::start(&arguments.run, &run, host, &session, &keys, told);
    let reporter = reporter.map_err(ServeError::fault)?;
    notify::tell_ready("set up");
    let board = Board::open(&arguments.run).map_err(ServeError::fault)?;
    notify::keep_told(beats, move || {
        let tick = board.last_position(ServiceId::Bridge).unwrap_or_default().tick;
        format!("tick {tick}")
    });
    // This thread alone, after Zenoh has its own: a flood must not come before the services.
    let placement = &run.scenario.placement;
    let real_time = RealTime {
        core: None,
        fifo_priority: placement.fifo_priority,
        lock_memory: false,
        on_missing_right: OnMissingRight::Warn,
    };
    for missing in real_time.apply().map_err(ServeError::fault)? {
        say(Severity::Warning, About::default(), missing);
    }
    let carried = carrier.carry();
    reporter.end_after(FAREWELL);
    for line in reporter.lines() {
        say(Severity::Warning, About::default(), line);
    }
    match carried {
        Ok(()) | Err(TickError::Stopped) => Ok(()),
        Err(error) => Err(ServeError::fault(error)),
    }
}

/// A link that is started anew has a larger number than its predecessor, also on a machine that has taken its place.
#[expect(clippy::disallowed_methods, reason = "it names a link; no tick knows of it")]
fn incarnation() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos() as u64
}
