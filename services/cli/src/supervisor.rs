//! Carries a run out with one process per service: starts them, records every tick, and sees to it that
//! all end when one does.

use crate::binaries;
use crate::children::{Children, Ended, ServiceProcess};
use crate::failure::{Failure, Status, as_lines};
use crate::interrupts::Interrupts;
use crate::observer::RunObserver;
use crate::outcome::{Outcome, fault_of, label_of, robot_name, swap_of};
use crate::output_directory::OutputDirectory;
use crate::prepare::Prepared;
use crate::print::print_error;
use crate::requests::Requests;
use crate::standstill::Standstill;
use crate::succession::{Succession, Vacancy};
use crate::wall_clock::{Stopwatch, pause};
use core::time::Duration;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_observation::{Fault, Observation, TeamTap};
use mikoshi_resolution::{world_file, write_run};
use mikoshi_runtime::{
    Board, Clock, Domain, Entry, FaultCode, IceoryxTap, Member, Position, Role, RunDirectory, SlotStatus,
    State, TickError, WaitPolicy, required_bytes,
};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// How often the supervisor looks around. The tap's queues hold many times what a run makes of it.
const LOOK: Duration = Duration::from_millis(1);
/// A run in which no service gets on for so long is stuck. A tick takes milliseconds, and its longest
/// phase, the physics of sixteen robots, tens of them; a busy machine stalls for up to a second.
const STALL: Duration = Duration::from_secs(3);
/// A service without a standby that is so far behind the clock is taken to be frozen: what queues up for its
/// successor is four times as much in most runs.
const PATIENCE: Duration = Duration::from_millis(40);
/// The same while services set themselves up: worlds are built and memory is touched.
const START_STALL: Duration = Duration::from_secs(30);

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
    observer.note_lost_frames(supervisor.team_tap.frames_lost());
    let outcome = supervisor.conclude(&prepared.run, watched);
    let world = world_file(directory.path());
    if world.exists()
        && let Err(error) = fs::copy(&world, out.world())
    {
        // The run's results are worth more than this one.
        print_error(&as_lines("warning", &format!("{}: {error}", out.world().display())));
    }
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
    /// These services keep all others waiting.
    Stalled(Stall),
    /// The run can't be observed any more.
    Unobservable(Failure),
}

/// A run in which nothing moves any more.
struct Stall {
    lasted: Duration,
    culprits: Vec<ServiceId>,
}

// In this order they are dropped: processes end before their place on the board does.
struct Supervisor {
    children: Children,
    tap: IceoryxTap,
    team_tap: TeamTap<IceoryxTap>,
    member: Member,
    succession: Succession,
    requests: Requests,
    /// Services that a run by the clock goes on without.
    lost: BTreeSet<ServiceId>,
    /// Whether standbys have been started.
    stands_by: bool,
}

impl Supervisor {
    fn start(prepared: &Prepared, directory: &Path, logs: &Path) -> Result<Self, Failure> {
        let (run, schedule) = (&prepared.run, &prepared.schedule);
        write_run(directory, run).map_err(Failure::fault)?;
        fs::create_dir_all(logs).map_err(|error| Failure::fault(error).context(logs.display()))?;
        let board = Board::create(directory, &schedule.services(), true).map_err(Failure::fault)?;
        let succession = Succession::with_limit(run.scenario.supervision.restart_limit);
        board.set_succession(succession.is_promised());
        if is_paced(prepared) {
            board.set_paced();
        }
        let join = |role| {
            Member::join(directory, role, WaitPolicy::default(), Entry::Vacant).map_err(Failure::fault)
        };
        let member = join(Role::Supervisor)?;
        let tap = IceoryxTap::open(directory, join(Role::Tap)?, schedule).map_err(Failure::fault)?;
        let requests = Requests::listen(directory).map_err(Failure::fault)?;
        let mut children = Children::of(directory, logs);
        for service in schedule.services() {
            children.spawn(service, label_of(run, service), robot_name(run, service))?;
        }
        // While services set themselves up.
        let team_tap = TeamTap::new(&tap, run.robots.len(), schedule.clock()).map_err(Failure::fault)?;
        let lost = BTreeSet::new();
        Ok(Self { children, tap, team_tap, member, succession, requests, lost, stands_by: false })
    }

    fn watch(&mut self, prepared: &Prepared, observer: &mut RunObserver, interrupts: &Interrupts) -> Watched {
        let (mut clock, mut standstill) = (Stopwatch::start(), Standstill::default());
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
                    if observer.ticks() >= prepared.run.ticks {
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
            if !self.look_after(prepared, observer) || self.is_given_up(prepared) {
                return Watched::Lost;
            }
            if is_paced(prepared) && self.nobody_speaks() {
                self.team_tap.give_up_waiting();
            }
            let is_set_up = self.all_services_are(State::Ready);
            let lasted = standstill.look(self.progress(), clock.lap());
            if lasted > if is_set_up { STALL } else { START_STALL } {
                let culprits = if is_set_up { self.unhindered(prepared) } else { self.least_advanced() };
                if !is_set_up || !self.replace_frozen(&culprits) {
                    return Watched::Stalled(Stall { lasted, culprits });
                }
                standstill = Standstill::default();
            }
            pause(LOOK);
        }
    }

    /// Sees to successors of processes that were killed; `false` if somebody is lost for good.
    fn look_after(&mut self, prepared: &Prepared, observer: &mut RunObserver) -> bool {
        let run = &prepared.run;
        self.children.look();
        self.requests.look(run, self.member.board(), &mut self.children, observer);
        self.see_to_standbys(prepared, observer);
        self.see_to_frozen(prepared, observer);
        let fallen = self.children.processes().iter().filter(|process| {
            let service = process.service;
            let has_failed = process.ended.is_some_and(|ended| !ended.status.success());
            // Whose successor waits already needs no other.
            let is_succeeded = self.succession.is_due(service)
                || self.requests.is_pending(service)
                || self.children.has_standby(service);
            has_failed && !is_succeeded && !self.lost.contains(&service)
        });
        let fallen: Vec<_> = fallen.map(|process| (process.service, process.signal())).collect();
        for (service, signal) in fallen {
            let (at, has_said_why) = self.last_position(service);
            let cause = signal.filter(|_| !has_said_why).map(|signal| format!("killed by signal {signal}"));
            let may_go_on = cause.is_some_and(|cause| self.succession.take_note(service, at, cause));
            if !may_go_on && !self.give_up(prepared, service, at.tick, observer) {
                return false;
            }
        }
        while let Some(Vacancy { service, at, cause }) = self.succession.next() {
            // Where one took over by itself, what is missing is the next that can.
            let is_served =
                self.children.processes().iter().any(|p| p.service == service && p.ended.is_none());
            if is_served {
                if self.children.stand_by(service).is_err() {
                    return false;
                }
                continue;
            }
            if self.children.succeed(service).is_err() {
                return false;
            }
            observer.note_swap(service, swap_of(run, service, at.tick, cause));
        }
        true
    }

    /// Goes on without a service, if a run can: by the clock, and if it is not the world.
    fn give_up(
        &mut self,
        prepared: &Prepared,
        service: ServiceId,
        tick: u64,
        observer: &mut RunObserver,
    ) -> bool {
        let may_go_on = is_paced(prepared) && service != ServiceId::Bridge;
        if may_go_on && self.lost.insert(service) {
            let run = &prepared.run;
            let label = label_of(run, service);
            print_error(&as_lines("warning", &format!("{label} is lost in tick {tick}; the team stops")));
            observer.note_fault(fault_of(run, service, tick, "lost".to_owned()));
        }
        may_go_on
    }

    /// Starts standbys, and sees which have taken over.
    fn see_to_standbys(&mut self, prepared: &Prepared, observer: &mut RunObserver) {
        let run = &prepared.run;
        if !is_paced(prepared) || !run.scenario.supervision.standby {
            return;
        }
        if !self.stands_by && self.all_services_are(State::Running) {
            self.stands_by = true;
            for service in prepared.schedule.services() {
                // Without the world there is nobody to keep up with.
                if service != ServiceId::Bridge && self.children.stand_by(service).is_err() {
                    print_error(&as_lines("warning", &format!("{} has no standby", label_of(run, service))));
                }
            }
        }
        let board = self.member.board();
        let in_charge = |service| board.process_of(service).map(|process| process.pid);
        for (service, cause) in self.children.note_promotions(in_charge) {
            let since = self.member.board().charge_of(service).map_or(0, |(_, since)| since.tick);
            observer.note_swap(service, swap_of(run, service, since + 1, cause.clone()));
            self.ask_for_standby(service, cause);
        }
        for service in self.children.lost_standbys() {
            if !self.service_states().any(|(other, state)| other == service && state.has_ended()) {
                self.ask_for_standby(service, "the standby ended".to_owned());
            }
        }
    }

    /// Has those replaced that are behind the clock and have no standby, while their successors can still make up
    /// for it. Where nobody is replaced they may still come back.
    fn see_to_frozen(&mut self, prepared: &Prepared, observer: &mut RunObserver) {
        let Clock::Wall { period_ns } = prepared.schedule.clock() else { return };
        if !self.succession.is_promised() {
            return;
        }
        let patience_ticks = PATIENCE.as_nanos() as u64 / period_ns.max(1) + 2;
        let world = self.last_position(ServiceId::Bridge).0.tick;
        let is_behind = |at: Position| at.tick.saturating_add(patience_ticks) < world;
        let behind = self.member.board().positions().filter(|(_, at)| is_behind(*at));
        for (service, at) in behind.collect::<Vec<_>>() {
            let process = self.children.processes().iter().find(|process| process.service == service);
            let is_seen_to = process.is_none_or(|process| process.ended.is_some())
                || self.succession.is_due(service)
                || self.requests.is_pending(service)
                || self.children.has_standby(service)
                || self.lost.contains(&service)
                || self.is_starting(service);
            if is_seen_to {
                continue;
            }
            self.children.kill_frozen(&[service]);
            if !self.succession.take_note(service, at, "fell behind".to_owned()) {
                self.give_up(prepared, service, at.tick, observer);
            }
        }
    }

    /// Whether a process has this place that does not execute ticks yet.
    fn is_starting(&self, service: ServiceId) -> bool {
        self.service_states().any(|(other, state)| other == service && state < State::Running)
            || self.children.processes().iter().any(|process| {
                process.service == service
                    && self.member.board().process_of(service).map(|owner| owner.pid) != Some(process.id())
            })
    }

    fn ask_for_standby(&mut self, service: ServiceId, cause: String) {
        let (at, _) = self.last_position(service);
        // One too many: the last that is in charge has none behind it.
        let _ = self.succession.take_note(service, at, cause);
    }

    /// Whether somebody has failed without whom the run can't go on.
    fn is_given_up(&self, prepared: &Prepared) -> bool {
        self.service_states().any(|(service, state)| {
            state == State::Failed && (!is_paced(prepared) || service == ServiceId::Bridge)
        })
    }

    /// Kills those that are frozen, for their successors' sake; `false` if they may have none.
    fn replace_frozen(&mut self, culprits: &[ServiceId]) -> bool {
        let may_all = culprits.iter().all(|&service| {
            let (at, _) = self.last_position(service);
            self.succession.take_note(service, at, "frozen".to_owned())
        });
        if may_all {
            self.children.kill_frozen(culprits);
        }
        may_all
    }

    /// Where this service is or was last, and whether it has said why it ended.
    fn last_position(&self, service: ServiceId) -> (Position, bool) {
        let board = self.member.board();
        let at = board.last_position(service).unwrap_or_default();
        let states = self.service_states();
        (at, states.into_iter().any(|(other, state)| other == service && state == State::Failed))
    }

    /// Ends what still runs, and says what came of it.
    fn conclude(mut self, run: &RunSpec, watched: Watched) -> Outcome {
        let before: Vec<_> = self.member.board().statuses();
        if !matches!(watched, Watched::All) {
            self.member.board().request_stop();
        }
        self.tap.detach();
        if let Watched::Stalled(stall) = &watched {
            self.children.kill_frozen(&stall.culprits);
        }
        self.children.end();
        let outcome = match watched {
            Watched::All if self.all_have_served() => match self.lost.first() {
                None => Outcome::Completed,
                Some(&service) => {
                    let message = format!("{} was lost, and nobody took its place", label_of(run, service));
                    Outcome::Fault { failure: Failure::fault(message), faults: vec![] }
                }
            },
            Watched::All | Watched::Lost => self.diagnose(run),
            Watched::Signal(signal) => Outcome::Interrupted(signal),
            Watched::Stalled(stall) => stalled(run, &stall, &before),
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

    /// Whether all services have ended, or are lost.
    fn nobody_speaks(&self) -> bool {
        self.service_states().all(|(service, state)| state.has_ended() || self.lost.contains(&service))
    }

    /// Whether nobody has failed but those that the run went on without.
    fn all_have_served(&mut self) -> bool {
        self.children.look();
        let has_failed =
            |process: &ServiceProcess| process.ended.is_some_and(|ended| !ended.status.success());
        let others = self.children.processes().iter().filter(|process| !self.lost.contains(&process.service));
        !others.into_iter().any(has_failed)
    }

    fn all_services_are(&self, state: State) -> bool {
        self.service_states().all(|(_, found)| found >= state)
    }

    fn service_states(&self) -> impl Iterator<Item = (ServiceId, State)> {
        self.member.board().states().filter_map(|(role, state)| match role {
            Role::Service(service) => Some((service, state)),
            _ => None,
        })
    }

    /// A number that changes whenever a service gets on.
    fn progress(&self) -> u64 {
        let states = self.service_states().map(|(_, state)| state as u64);
        let positions = self.member.board().positions();
        // Each of its terms only ever grows, except in the end, when all of them do at once.
        let terms = positions.map(|(_, at)| at.tick.wrapping_mul(1 << 8).wrapping_add(at.phase as u64));
        states.chain(terms).fold(0, u64::wrapping_add)
    }

    fn unhindered(&self, prepared: &Prepared) -> Vec<ServiceId> {
        let positions: Vec<_> = self.member.board().positions().collect();
        let position_of = |service| {
            positions.iter().find(|(other, _)| *other == service).map_or(Position::END, |(_, at)| *at)
        };
        prepared.schedule.unhindered(position_of)
    }

    fn least_advanced(&self) -> Vec<ServiceId> {
        let least = self.service_states().map(|(_, state)| state).min();
        self.service_states().filter(|(_, state)| Some(*state) == least).map(|(service, _)| service).collect()
    }
}

/// Whether ticks are paced by the clock.
fn is_paced(prepared: &Prepared) -> bool {
    matches!(prepared.schedule.clock(), Clock::Wall { .. })
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
        // It says itself what failed.
        None if code == Some(3) => message += " failed",
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

/// `board` is what it said before anybody was asked to stop.
fn stalled(run: &RunSpec, stall: &Stall, board: &[SlotStatus]) -> Outcome {
    let is_culprit = |status: &&SlotStatus| match status.role {
        Role::Service(service) => stall.culprits.contains(&service),
        _ => false,
    };
    let told = |status: &SlotStatus| {
        let Role::Service(service) = status.role else { return String::new() };
        match status.state {
            State::Running => format!("{} in tick {}", label_of(run, service), status.tick),
            state => format!("{}, {state}", label_of(run, service)),
        }
    };
    let culprits: Vec<_> = board.iter().filter(is_culprit).map(told).collect();
    let message = format!(
        "nothing moved for {:.1} s; all wait for {}: frozen, or too slow",
        stall.lasted.as_secs_f64(),
        culprits.join(" and ")
    );
    let faults = board.iter().filter(is_culprit).filter_map(|status| match status.role {
        Role::Service(service) => Some(fault_of(run, service, status.tick, "stalled".to_owned())),
        _ => None,
    });
    Outcome::Fault { failure: Failure { status: Status::Fault, message }, faults: faults.collect() }
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
