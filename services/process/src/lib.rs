//! What the main functions of all services share: arguments, the place in the run, rights, exit status.
//!
//! A service's own `main.rs` only says which service it is and how it is built.

pub mod journal;
pub mod notify;

use clap::{Args, Parser};
use core::fmt::Display;
use core::time::Duration;
use journal::{About, Severity};
use mikoshi_config::RunSpec;
use mikoshi_config::scenario::MissingRights;
use mikoshi_ipc_types::ServiceId;
use mikoshi_resolution::{read_run, read_spec, tick_schedule};
use mikoshi_runtime::{
    Board, Clock, Entry, IceoryxTransport, Member, OnMissingRight, RealTime, Replaceable, Role, RunFault,
    State, TickError, WaitPolicy, beats, run_service,
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
    /// Take the place if nobody has it, else stand by: of two such processes either may be started anew at any time
    #[arg(long, conflicts_with_all = ["replace", "standby"])]
    enlist: bool,
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
/// Another process is in charge: who starts this one anew has a standby.
const TAKEN_OVER: u8 = 75;

/// A service that can't take part, and the status that says so.
#[derive(Debug)]
pub struct ServeError {
    status: u8,
    message: String,
    /// What is known of it, if it was in a tick.
    fault: Option<Box<TickFault>>,
}

#[derive(Debug)]
struct TickFault {
    tick: u64,
    robot: Option<String>,
    code: String,
}

impl ServeError {
    /// What was asked for can't be.
    pub fn configuration(problem: impl Display) -> Self {
        Self { status: BAD_CONFIGURATION, message: problem.to_string(), fault: None }
    }

    /// The system does not let it.
    pub fn fault(problem: impl Display) -> Self {
        Self { status: SYSTEM_FAULT, message: problem.to_string(), fault: None }
    }

    /// It ended in a tick, as the service of this robot.
    fn of_run(fault: RunFault, robot: Option<&str>) -> Self {
        let (tick, robot, code) = (fault.tick, robot.map(str::to_owned), fault.error.code().to_string());
        Self { fault: Some(Box::new(TickFault { tick, robot, code })), ..Self::fault(fault) }
    }

    /// Tells what it is, and returns the status that says so.
    pub fn report(&self) -> ExitCode {
        self.tell();
        ExitCode::from(self.status)
    }

    fn tell(&self) {
        let about = self.fault.as_ref().map_or_else(About::default, |fault| About {
            tick: Some(fault.tick),
            robot: fault.robot.as_deref(),
            fault: Some(&fault.code),
        });
        journal::say(Severity::Error, about, &self.message);
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
        Err(error) => error.report(),
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
    let robot = service.robot().and_then(|robot| run.robots.get(robot)).map(|robot| &*robot.member.name);
    let about = About { robot, ..About::default() };
    for missing in real_time.apply().map_err(ServeError::fault)? {
        journal::say(Severity::Warning, about, missing);
    }
    real_time.linger();
    let entry = match place {
        Place { replace: true, .. } => Entry::Replace,
        Place { standby: true, .. } => Entry::Standby,
        Place { enlist: true, .. } => Entry::Enlist,
        _ => Entry::Vacant,
    };
    let member = Member::join(directory, Role::Service(service), policy_of(&run), entry);
    let member = member.map_err(ServeError::fault)?;
    let transport = IceoryxTransport::open(directory, member, &schedule).map_err(ServeError::fault)?;
    let mut participant = build(&run, &transport)?;
    let board = Board::open(directory).map_err(ServeError::fault)?;
    real_time.rush_again();
    notify::tell_ready("set up");
    notify::keep_told(beats, move || status_of(&board, service));
    match run_service(&schedule, &mut participant, &transport, run.ticks) {
        Ok(_) => Ok(()),
        Err(fault) if place.enlist && matches!(fault.error, TickError::Retired | TickError::Fenced) => {
            let message = "another process has taken over".to_owned();
            Err(ServeError {
                status: TAKEN_OVER,
                ..ServeError { message, ..ServeError::of_run(fault, robot) }
            })
        }
        // Neither is a fault of this service.
        Err(fault) if matches!(fault.error, TickError::Stopped | TickError::Retired | TickError::Fenced) => {
            Ok(())
        }
        Err(fault) => Err(ServeError::of_run(fault, robot)),
    }
}

/// How processes of this run wait.
pub fn policy_of(run: &RunSpec) -> WaitPolicy {
    let placement = &run.scenario.placement;
    WaitPolicy {
        yield_for: Duration::from_micros(placement.yield_us.into()),
        up_early: Duration::from_micros(placement.early_us.into()),
    }
}

/// How far this process is, for people who ask the system.
fn status_of(board: &Board, service: ServiceId) -> String {
    let is_in_charge = board.process_of(service).is_some_and(|process| process.pid == std::process::id());
    let state = board.states().find_map(|(role, state)| (role == Role::Service(service)).then_some(state));
    let tick = board.last_position(service).unwrap_or_default().tick;
    let (epoch, _) = board.charge_of(service).unwrap_or_default();
    match (is_in_charge, state) {
        (false, _) => format!("stands by for epoch {epoch}, tick {tick}"),
        (true, Some(State::Running)) => format!("tick {tick}, epoch {epoch}"),
        (true, _) => "waits for the others".to_owned(),
    }
}
