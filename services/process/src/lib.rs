//! What the main functions of all services share: arguments, the place in the run, rights, exit status.
//!
//! A service's own `main.rs` only says which service it is and how it is built.

use clap::{Args, Parser};
use core::fmt::Display;
use core::time::Duration;
use mikoshi_config::RunSpec;
use mikoshi_config::scenario::MissingRights;
use mikoshi_ipc_types::ServiceId;
use mikoshi_resolution::{read_run, read_spec, tick_schedule};
use mikoshi_runtime::{
    Clock, Entry, IceoryxTransport, Member, OnMissingRight, RealTime, Replaceable, Role, TickError,
    WaitPolicy, run_service,
};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Where a service takes part.
#[derive(Debug, Args)]
pub struct Place {
    /// Directory of the run, as its supervisor made it
    #[arg(long, value_name = "DIR")]
    run: PathBuf,
    /// Take over from the process that is in charge, once ready to
    #[arg(long)]
    replace: bool,
    /// Take over from the process that is in charge, once that is lost or falls behind
    #[arg(long, conflicts_with = "replace")]
    standby: bool,
    /// Description of the run, if it is to be another than the run began with
    #[arg(long, value_name = "FILE")]
    spec: Option<PathBuf>,
}

impl Place {
    /// The run's directory.
    pub fn run(&self) -> &Path {
        &self.run
    }
}

/// Arguments of a service of which a run has one.
#[derive(Debug, Parser)]
pub struct ServiceArguments {
    /// Where it takes part.
    #[command(flatten)]
    pub place: Place,
}

/// Arguments of a service of which every robot has one.
#[derive(Debug, Parser)]
pub struct RobotServiceArguments {
    /// Where it takes part.
    #[command(flatten)]
    pub place: Place,
    /// Name of the robot
    #[arg(long, value_name = "NAME")]
    pub robot: String,
}

/// Exit statuses, as the `mikoshi` command documents them.
const BAD_CONFIGURATION: u8 = 2;
const SYSTEM_FAULT: u8 = 3;

/// A service that can't take part, and the status that says so.
#[derive(Debug)]
pub struct ServeError {
    status: u8,
    message: String,
}

impl ServeError {
    /// What was asked for can't be.
    pub fn configuration(problem: impl Display) -> Self {
        Self { status: BAD_CONFIGURATION, message: problem.to_string() }
    }

    /// The system does not let it.
    pub fn fault(problem: impl Display) -> Self {
        Self { status: SYSTEM_FAULT, message: problem.to_string() }
    }
}

/// Runs a service in its place, from the first tick or from where its predecessor was to the last: `service`
/// finds out which it is, `build` builds it on its ports.
pub fn serve<P: Replaceable>(
    place: &Place,
    service: impl FnOnce(&RunSpec) -> Result<ServiceId, ServeError>,
    build: impl FnOnce(&RunSpec, &IceoryxTransport) -> Result<P, ServeError>,
) -> ExitCode {
    match try_serve(place, service, build) {
        Ok(()) => ExitCode::SUCCESS,
        Err(ServeError { status, message }) => {
            eprintln!("error: {message}");
            ExitCode::from(status)
        }
    }
}

fn try_serve<P: Replaceable>(
    place: &Place,
    service: impl FnOnce(&RunSpec) -> Result<ServiceId, ServeError>,
    build: impl FnOnce(&RunSpec, &IceoryxTransport) -> Result<P, ServeError>,
) -> Result<(), ServeError> {
    let directory = place.run();
    let run = match &place.spec {
        Some(file) => read_spec(file),
        None => read_run(directory),
    };
    let run = run.map_err(ServeError::fault)?;
    let schedule = tick_schedule(&run).map_err(ServeError::configuration)?;
    let service = service(&run)?;
    let placement = &run.scenario.placement;
    let policy = WaitPolicy {
        yield_for: Duration::from_micros(placement.yield_us.into()),
        up_early: Duration::from_micros(placement.early_us.into()),
    };
    let core = schedule.phases_of(service).find_map(|phase| phase.core);
    let real_time = RealTime {
        core,
        fifo_priority: placement.fifo_priority,
        lock_memory: matches!(schedule.clock(), Clock::Wall { .. }),
        on_missing_right: match placement.rt {
            MissingRights::Warn => OnMissingRight::Warn,
            MissingRights::Strict => OnMissingRight::Fail,
        },
    };
    for missing in real_time.apply().map_err(ServeError::fault)? {
        eprintln!("warning: {missing}");
    }
    let entry = match (place.replace, place.standby) {
        (true, _) => Entry::Replace,
        (_, true) => Entry::Standby,
        _ => Entry::Vacant,
    };
    let member = Member::join(directory, Role::Service(service), policy, entry);
    let member = member.map_err(ServeError::fault)?;
    let transport = IceoryxTransport::open(directory, member, &schedule).map_err(ServeError::fault)?;
    let mut participant = build(&run, &transport)?;
    match run_service(&schedule, &mut participant, &transport, run.ticks) {
        Ok(_) => Ok(()),
        // Neither is a fault of this service.
        Err(fault) if matches!(fault.error, TickError::Stopped | TickError::Retired | TickError::Fenced) => {
            Ok(())
        }
        Err(fault) => Err(ServeError::fault(fault)),
    }
}
