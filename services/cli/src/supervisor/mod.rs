//! Carries a run out with one process per service: starts or adopts them, records every tick, and sees to it that
//! all end when one does. Where somebody else starts them it only attends: it records, and hears the operator.

mod successors;
mod verdict;

use crate::awake::Awake;
use crate::binaries;
use crate::children::Children;
use crate::failure::{Failure, as_lines};
use crate::interrupts::Interrupts;
use crate::meals::Meals;
use crate::observer::RunObserver;
use crate::outcome::{Outcome, label_of, robot_name};
use crate::output_directory::OutputDirectory;
use crate::prepare::Prepared;
use crate::print::print_error;
use crate::requests::Requests;
use crate::service_process::{ServiceProcess, Variant};
use crate::standstill::Standstill;
use crate::succession::Succession;
use crate::wall_clock::{Stopwatch, pause};
use core::time::Duration;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_observation::{Observation, TeamTap};
use mikoshi_process::notify;
use mikoshi_resolution::{world_file, write_run};
use mikoshi_runtime::{
    Board, Clock, Domain, Entry, IceoryxTap, Member, Position, Role, RunDirectory, State, TickError,
    WaitPolicy, required_bytes,
};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use verdict::{Stall, stalled};

/// How often the supervisor looks around. The tap's queues hold many times what a run makes of it.
const LOOK: Duration = Duration::from_millis(1);
/// A run in which no service gets on for so long is stuck. A tick takes milliseconds, and its longest
/// phase, the physics of sixteen robots, tens of them; a busy machine stalls for up to a second.
const STALL: Duration = Duration::from_secs(3);
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
    observer.open_feed(directory.path(), &prepared.run).map_err(Failure::fault)?;
    let supervisor = Supervisor::start(prepared, directory.path(), &out.service_logs())?;
    observer.open_viewer(directory.path())?;
    Ok(supervisor.see_through(prepared, directory.path(), out, observer, &interrupts))
}

/// Carries out the rest of a run that has lost its supervisor.
///
/// # Errors
/// It could not be taken over, and goes on as before.
pub fn adopt(
    run: &Path,
    prepared: &Prepared,
    out: &OutputDirectory,
    observer: &mut RunObserver,
) -> Result<Outcome, Failure> {
    let interrupts = Interrupts::listen().map_err(Failure::fault)?;
    let directory = RunDirectory::adopt(run).map_err(Failure::fault)?;
    let (path, logs) = (directory.path(), out.service_logs());
    let is_kept = RunDirectory::is_kept(path);
    let opened = observer.open_feed(path, &prepared.run).map_err(Failure::fault);
    let supervisor = opened.and_then(|()| match is_kept {
        true => Supervisor::attend(prepared, path, &logs),
        false => Supervisor::adopt(prepared, path, &logs),
    });
    let outcome =
        supervisor.map(|supervisor| supervisor.see_through(prepared, path, out, observer, &interrupts));
    if is_kept || outcome.is_err() {
        directory.leave_as_it_is();
    }
    outcome
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
    /// Whether standbys have been seen to.
    stands_by: bool,
    /// Where somebody else starts processes: which incarnations it knows of.
    attended: Option<BTreeMap<ServiceId, u64>>,
    /// While services run.
    _awake: Option<Awake>,
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
        let (member, tap) = take_places(prepared, directory)?;
        let requests = Requests::listen(directory).map_err(Failure::fault)?;
        let mut children = Children::of(directory, logs);
        for (service, label, robot) in services_of(prepared) {
            children.spawn(service, label, robot, variant_of(prepared, service)?)?;
        }
        // While services set themselves up.
        let team_tap = TeamTap::new(&tap, run.robots.len(), schedule.clock()).map_err(Failure::fault)?;
        Self::of((prepared, directory), (member, tap), team_tap, requests, children, succession)
    }

    /// Processes are adopted last: until then nothing happens to them.
    fn adopt(prepared: &Prepared, directory: &Path, logs: &Path) -> Result<Self, Failure> {
        let (run, schedule) = (&prepared.run, &prepared.schedule);
        fs::create_dir_all(logs).map_err(|error| Failure::fault(error).context(logs.display()))?;
        let succession = Succession::with_limit(run.scenario.supervision.restart_limit);
        let (member, tap) = take_places(prepared, directory)?;
        let team_tap = TeamTap::new(&tap, run.robots.len(), schedule.clock()).map_err(Failure::fault)?;
        let requests = Requests::listen(directory).map_err(Failure::fault)?;
        let children = Children::adopt(directory, logs, services_of(prepared))?;
        Self::of((prepared, directory), (member, tap), team_tap, requests, children, succession)
    }

    /// Its processes are somebody else's: they are neither started nor ended, and nobody is given up.
    fn attend(prepared: &Prepared, directory: &Path, logs: &Path) -> Result<Self, Failure> {
        let (member, tap) = take_places(prepared, directory)?;
        let team_tap = TeamTap::new(&tap, prepared.run.robots.len(), prepared.schedule.clock());
        let team_tap = team_tap.map_err(Failure::fault)?;
        let requests = Requests::listen(directory).map_err(Failure::fault)?;
        notify::tell_ready("waits for the services");
        let (children, succession) = (Children::of(directory, logs), Succession::with_limit(0));
        let supervisor =
            Self::of((prepared, directory), (member, tap), team_tap, requests, children, succession)?;
        Ok(Self { attended: Some(BTreeMap::new()), ..supervisor })
    }

    /// With all that it takes, and nothing has happened yet.
    fn of(
        (prepared, directory): (&Prepared, &Path),
        (member, tap): (Member, IceoryxTap),
        team_tap: TeamTap<IceoryxTap>,
        requests: Requests,
        children: Children,
        succession: Succession,
    ) -> Result<Self, Failure> {
        Ok(Self {
            children,
            tap,
            team_tap,
            member,
            succession,
            requests,
            lost: BTreeSet::new(),
            stands_by: false,
            attended: None,
            _awake: Awake::keep(prepared, directory)?,
        })
    }

    /// Watches the run to its end, and sees to what it leaves.
    fn see_through(
        mut self,
        prepared: &Prepared,
        directory: &Path,
        out: &OutputDirectory,
        observer: &mut RunObserver,
        interrupts: &Interrupts,
    ) -> Outcome {
        let watched = self.watch(prepared, observer, interrupts);
        observer.note_lost_frames(self.team_tap.frames_lost());
        let outcome = self.conclude(&prepared.run, watched);
        let world = world_file(directory);
        if world.exists()
            && let Err(error) = fs::copy(&world, out.world())
        {
            // The run's results are worth more than this one.
            print_error(&as_lines("warning", &format!("{}: {error}", out.world().display())));
        }
        if matches!(outcome, Outcome::Completed) {
            remove_empty_logs(&out.service_logs());
        }
        outcome
    }

    fn watch(&mut self, prepared: &Prepared, observer: &mut RunObserver, interrupts: &Interrupts) -> Watched {
        let (mut clock, mut standstill) = (Stopwatch::start(), Standstill::default());
        let mut observation = Observation::for_team(prepared.run.robots.len());
        let (mut is_started, mut has_begun) = (false, false);
        let mut meals = Meals::default();
        loop {
            if is_started && !has_begun {
                if let Some(tick) = self.tap.first_tick() {
                    self.team_tap.begin_at(tick);
                    self.tap.set_consumed(tick);
                    has_begun = true;
                }
            } else if is_started {
                // In lockstep what is not taken keeps the run waiting.
                while !observer.serve_listeners() || is_paced(prepared) {
                    match self.team_tap.try_take_tick(&mut observation) {
                        Ok(true) => {}
                        Ok(false) => break,
                        Err(error) => return Watched::Unobservable(Failure::fault(error)),
                    }
                    observer.observe(&observation);
                    self.tap.set_consumed(observer.ticks());
                    observer.count_costs(self.member.board());
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
                    Err(error) if self.attended.is_some() => {
                        return Watched::Unobservable(Failure::fault(error));
                    }
                    Err(_) => return Watched::Lost,
                }
            }
            if let Some(signal) = interrupts.received() {
                return Watched::Signal(signal);
            }
            if self.attended.is_some() {
                self.look_on(prepared, observer);
                meals.serve(|| format!("{} ticks seen", observer.ticks()));
            } else if !self.look_after(prepared, observer) || self.is_given_up(prepared) {
                return Watched::Lost;
            }
            if is_paced(prepared) && self.nobody_speaks() {
                self.team_tap.give_up_waiting();
            }
            if self.attended.is_some() {
                pause(LOOK);
                continue;
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

    /// Whether somebody has failed without whom the run can't go on.
    fn is_given_up(&self, prepared: &Prepared) -> bool {
        self.service_states().any(|(service, state)| {
            state == State::Failed && (!is_paced(prepared) || service == ServiceId::Bridge)
        })
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
        if !matches!(watched, Watched::All) && self.attended.is_none() {
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

    /// Whether all services have ended, or are lost.
    fn nobody_speaks(&self) -> bool {
        self.service_states().all(|(service, state)| state.has_ended() || self.lost.contains(&service))
    }

    /// Whether nobody has failed but those that the run went on without.
    fn all_have_served(&mut self) -> bool {
        self.children.look();
        let others = self.children.processes().iter().filter(|process| !self.lost.contains(&process.service));
        !others.into_iter().any(ServiceProcess::has_failed)
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

/// The places of a supervisor and its tap, which nobody has.
fn take_places(prepared: &Prepared, directory: &Path) -> Result<(Member, IceoryxTap), Failure> {
    let join =
        |role| Member::join(directory, role, WaitPolicy::default(), Entry::Vacant).map_err(Failure::fault);
    let member = join(Role::Supervisor)?;
    let tap = IceoryxTap::open(directory, join(Role::Tap)?, &prepared.schedule).map_err(Failure::fault)?;
    Ok((member, tap))
}

/// All services of a run: which, what people call it, and the robot that it controls.
fn services_of(prepared: &Prepared) -> impl Iterator<Item = (ServiceId, String, Option<&str>)> {
    let run = &prepared.run;
    let named = |service| (service, label_of(run, service), robot_name(run, service));
    prepared.schedule.services().into_iter().map(named)
}

/// Which program a service is.
fn variant_of(prepared: &Prepared, service: ServiceId) -> Result<Variant, Failure> {
    if !prepared.is_empty {
        let program = prepared.bridge.clone().filter(|_| service == ServiceId::Bridge);
        return Ok(Variant { program, ..Variant::default() });
    }
    let arguments = match service {
        ServiceId::Servo(_) => vec![],
        ServiceId::Bridge | ServiceId::Coordinator => vec!["--service".to_owned(), service.to_string()],
    };
    Ok(Variant { program: Some(binaries::find(binaries::EMPTY)?), arguments, ..Variant::default() })
}

/// Whether ticks are paced by the clock.
fn is_paced(prepared: &Prepared) -> bool {
    matches!(prepared.schedule.clock(), Clock::Wall { .. })
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
