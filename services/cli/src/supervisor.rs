//! Carries a run out with one process per service: starts them, records every tick, and sees to it that
//! all end when one does.

use crate::binaries;
use crate::children::{Children, Ended, ServiceProcess};
use crate::failure::{Failure, Status};
use crate::interrupts::Interrupts;
use crate::observer::RunObserver;
use crate::outcome::{Outcome, fault_of, label_of, robot_name};
use crate::output_directory::OutputDirectory;
use crate::prepare::Prepared;
use crate::wall_clock::{Stopwatch, pause};
use core::time::Duration;
use mikoshi_config::RunSpec;
use mikoshi_observation::{Fault, Observation, TeamTap};
use mikoshi_resolution::write_run;
use mikoshi_runtime::{
    Board, Domain, FaultCode, IceoryxTap, Member, Role, RunDirectory, SlotStatus, State, TickError,
    WaitPolicy, required_bytes,
};
use std::fs;
use std::path::Path;

/// How often the supervisor looks around. The tap's queues hold many times what a run makes of it.
const LOOK: Duration = Duration::from_millis(1);
/// A run that makes no tick for so long is stuck: a process is frozen, or waits for what never comes.
const STALL: Duration = Duration::from_secs(30);

/// Carries the run out.
///
/// # Errors
/// It could not even begin. What happens later is part of the [`Outcome`].
pub fn supervise(
    prepared: &Prepared,
    out: &OutputDirectory,
    observer: &mut RunObserver,
) -> Result<Outcome, Failure> {
    let interrupts = Interrupts::listen().map_err(Failure::fault)?;
    let base = RunDirectory::default_base();
    // What can't be removed is not in our way: every run has its own domain.
    let _ = RunDirectory::clean_dead(&base);
    Domain::check_space(required_bytes(&prepared.schedule)).map_err(Failure::fault)?;
    let directory = RunDirectory::create(&base).map_err(Failure::fault)?;
    let mut supervisor = Supervisor::start(prepared, directory.path(), &out.service_logs())?;
    let watched = supervisor.watch(prepared, observer, &interrupts);
    let outcome = supervisor.conclude(&prepared.run, watched);
    if matches!(outcome, Outcome::Completed) {
        remove_empty_logs(&out.service_logs());
    }
    Ok(outcome)
}

/// Why watching a run ended.
enum Watched {
    /// Every tick has been observed.
    All,
    /// A signal came.
    Signal(u8),
    /// A process has ended, or said that it failed.
    Lost,
    /// No tick came for [`STALL`].
    Stalled,
    /// The run can't be observed any more.
    Unobservable(Failure),
}

// In this order they are dropped: processes end before their place on the board does.
struct Supervisor {
    children: Children,
    tap: IceoryxTap,
    team_tap: TeamTap<IceoryxTap>,
    member: Member,
}

impl Supervisor {
    fn start(prepared: &Prepared, directory: &Path, logs: &Path) -> Result<Self, Failure> {
        let (run, schedule) = (&prepared.run, &prepared.schedule);
        write_run(directory, run).map_err(Failure::fault)?;
        fs::create_dir_all(logs).map_err(|error| Failure::fault(error).context(logs.display()))?;
        Board::create(directory, &schedule.services(), true).map_err(Failure::fault)?;
        let join = |role| Member::join(directory, role, WaitPolicy::default()).map_err(Failure::fault);
        let member = join(Role::Supervisor)?;
        let tap = IceoryxTap::open(directory, join(Role::Tap)?, schedule).map_err(Failure::fault)?;
        let mut children = Children::default();
        for service in schedule.services() {
            children.spawn(service, label_of(run, service), robot_name(run, service), directory, logs)?;
        }
        // While services set themselves up.
        let team_tap = TeamTap::new(&tap, run.robots.len()).map_err(Failure::fault)?;
        Ok(Self { children, tap, team_tap, member })
    }

    fn watch(&mut self, prepared: &Prepared, observer: &mut RunObserver, interrupts: &Interrupts) -> Watched {
        let mut since_progress = Stopwatch::start();
        let mut observation = Observation::for_team(prepared.run.robots.len());
        let mut is_started = false;
        loop {
            if is_started {
                loop {
                    match self.team_tap.try_take_tick(&mut observation) {
                        Ok(true) => {}
                        Ok(false) => break,
                        Err(error) => return Watched::Unobservable(Failure::fault(error)),
                    }
                    if let Err(error) = observer.observe(&observation) {
                        return Watched::Unobservable(Failure::fault(error));
                    }
                    self.tap.set_consumed(observer.ticks());
                    since_progress = Stopwatch::start();
                    if observer.ticks() == prepared.run.ticks {
                        return Watched::All;
                    }
                }
            } else if self.all_services_are(State::Wired) {
                match self.tap.start() {
                    Ok(()) => is_started = true,
                    Err(TickError::SharedMemoryFull) => {
                        return Watched::Unobservable(Failure::fault(TickError::SharedMemoryFull));
                    }
                    Err(_) => return Watched::Lost,
                }
            }
            if let Some(signal) = interrupts.received() {
                return Watched::Signal(signal);
            }
            if self.children.look() || self.any_service_is(State::Failed) {
                return Watched::Lost;
            }
            if since_progress.elapsed() > STALL {
                return Watched::Stalled;
            }
            pause(LOOK);
        }
    }

    /// Ends what still runs, and says what came of it.
    fn conclude(mut self, run: &RunSpec, watched: Watched) -> Outcome {
        let before: Vec<_> = self.member.board().statuses();
        if !matches!(watched, Watched::All) {
            self.member.board().request_stop();
        }
        self.tap.detach();
        self.children.end();
        let outcome = match watched {
            Watched::All if !self.children.look() => Outcome::Completed,
            Watched::All | Watched::Lost => self.diagnose(run),
            Watched::Signal(signal) => Outcome::Interrupted(signal),
            Watched::Stalled => stalled(run, &before),
            Watched::Unobservable(failure) => Outcome::Fault { failure, faults: vec![] },
        };
        self.member.conclude();
        outcome
    }

    /// What was lost first, and why. One that died without a word is the cause of what others report.
    fn diagnose(&self, run: &RunSpec) -> Outcome {
        let board = self.member.board().statuses();
        let status_of = |process: &ServiceProcess| {
            board.iter().find(|status| status.role == Role::Service(process.service))
        };
        let rank = |process: &&ServiceProcess| {
            let said = status_of(process).and_then(|status| status.fault.as_ref()).map(|(code, _)| *code);
            let is_consequence =
                matches!(said, Some(FaultCode::PeerLost | FaultCode::Stopped | FaultCode::SupervisorLost));
            let by_us = process.ended.is_some_and(|ended| ended.by_us);
            (by_us, is_consequence, said.is_some())
        };
        let has_failed =
            |process: &&ServiceProcess| process.ended.is_none_or(|ended| !ended.status.success());
        let Some(cause) = self.children.processes().iter().filter(has_failed).min_by_key(rank) else {
            let failure =
                Failure { status: Status::Fault, message: "a service failed and ended well".to_owned() };
            return Outcome::Fault { failure, faults: vec![] };
        };
        // The cause first.
        let others = self.children.processes().iter().filter(has_failed);
        let others = others.filter(|process| process.service != cause.service);
        let failed = core::iter::once(cause).chain(others).filter_map(status_of);
        let faults = failed.filter_map(|status| fault_in(run, status)).collect();
        let failure = describe(cause, status_of(cause));
        Outcome::Fault { failure, faults }
    }

    fn all_services_are(&self, state: State) -> bool {
        self.service_states().all(|found| found >= state)
    }

    fn any_service_is(&self, state: State) -> bool {
        self.service_states().any(|found| found == state)
    }

    fn service_states(&self) -> impl Iterator<Item = State> {
        let statuses = self.member.board().statuses();
        statuses
            .into_iter()
            .filter(|status| matches!(status.role, Role::Service(_)))
            .map(|status| status.state)
    }
}

/// One failed process in words.
fn describe(process: &ServiceProcess, status: Option<&SlotStatus>) -> Failure {
    let exit = process.ended.map(|Ended { status, .. }| status);
    let code = exit.and_then(|exit| exit.code());
    let (mut exit_status, mut message) = (Status::Fault, process.label.clone());
    // Who ends without a reason says so to the others, but not why: its last words do.
    let reason = status.and_then(|status| {
        let reason = status.fault.as_ref().filter(|(code, _)| *code != FaultCode::Aborted);
        reason.map(|(_, text)| (status.tick, text))
    });
    match reason {
        Some((tick, text)) => message += &format!(" failed in tick {tick}: {text}"),
        // It refused the run before it took its place.
        None if code == Some(2) => {
            exit_status = Status::Usage;
            message += " can't run this scenario";
        }
        None => {
            if let Some(simulator) = binaries::simulator_version().err().filter(|_| code == Some(127)) {
                return simulator.context(message);
            }
            message += " died";
            if let Some(status) = status.filter(|status| status.state >= State::Running) {
                message += &format!(" in tick {}", status.tick);
            }
            if let Some(exit) = exit {
                message += &format!(": {exit}");
            }
        }
    }
    message += &process.last_words();
    Failure { status: exit_status, message }
}

fn stalled(run: &RunSpec, board: &[SlotStatus]) -> Outcome {
    let mut message = format!("no tick for {} s: a process is frozen, or too slow", STALL.as_secs());
    for status in board {
        if let Role::Service(service) = status.role {
            let name = label_of(run, service);
            message += &format!("\n  {name}: {} in tick {}", status.state, status.tick);
        }
    }
    Outcome::Fault { failure: Failure { status: Status::Fault, message }, faults: vec![] }
}

fn fault_in(run: &RunSpec, status: &SlotStatus) -> Option<Fault> {
    let Role::Service(service) = status.role else { return None };
    let code = status.fault.as_ref().map_or("died".to_owned(), |(code, _)| code.to_string());
    Some(fault_of(run, service, status.tick, code))
}

/// A run that went well leaves no empty files.
fn remove_empty_logs(logs: &Path) {
    let files = fs::read_dir(logs).into_iter().flatten().flatten();
    for file in files.filter(|file| file.metadata().is_ok_and(|metadata| metadata.len() == 0)) {
        let _ = fs::remove_file(file.path());
    }
    // It stays where something was said.
    let _ = fs::remove_dir(logs);
}
