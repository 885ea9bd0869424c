//! Watches a run: its frames, its board, its processes.

use super::cpu::CpuShares;
use super::snapshot::{Happening, ProcessRow, RobotRow, Snapshot, Team};
use super::window::Window;
use crate::commands::status::ProcessStatus;
use crate::failure::Failure;
use crate::feed::{Listener, Wish, listen_to};
use crate::observed_run::observed_run;
use crate::outcome::label_of;
use crate::wall_clock::Stopwatch;
use core::time::Duration;
use mikoshi_config::RunSpec;
use mikoshi_config::scenario::Clock;
use mikoshi_coordinator::build_hybrid_law;
use mikoshi_ipc_types::{ServiceId, TeamState, stop_cause};
use mikoshi_observation::{Freshness, Observation, ObservedRun, lost_hands, safe_stop_text};
use mikoshi_resolution::tick_schedule;
use mikoshi_runtime::{Board, Role, SlotStatus, State};
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};

/// What happened that is remembered.
const HAPPENINGS: usize = 8;
/// A tick that begins so much of a period after it was due is late.
const LATE: f64 = 0.1;

/// What is known of a run that goes on.
pub struct Watch {
    directory: PathBuf,
    run: RunSpec,
    board: Board,
    observed: ObservedRun,
    window: Window,
    freshness: Freshness,
    cpu: CpuShares,
    since: Stopwatch,
    last: Option<Observation>,
    ticks_late: u64,
    ticks_unseen: u64,
    /// By service: the incarnation that was seen last.
    epochs: BTreeMap<Role, u64>,
    /// The newest first.
    happenings: VecDeque<Happening>,
}

impl Watch {
    /// Begins to watch the run in this directory.
    ///
    /// # Errors
    /// It has just ended, or is of another build: a fault.
    pub fn begin(directory: &Path, run: RunSpec) -> Result<Self, Failure> {
        let law = build_hybrid_law(&run).map_err(Failure::fault)?;
        let observed = observed_run(&run, law.internal_forces())?;
        let schedule = tick_schedule(&run).map_err(Failure::fault)?;
        Ok(Self {
            directory: directory.to_owned(),
            board: Board::open(directory).map_err(Failure::fault)?,
            window: Window::new(&schedule, &observed),
            freshness: Freshness::with_delay(run.scenario.coordination_delay_ticks),
            observed,
            run,
            cpu: CpuShares::new(),
            since: Stopwatch::start(),
            last: None,
            ticks_late: 0,
            ticks_unseen: 0,
            epochs: BTreeMap::new(),
            happenings: VecDeque::new(),
        })
    }

    /// For how long it has watched.
    pub fn time(&self) -> Duration {
        self.since.elapsed()
    }

    /// Takes in a tick.
    pub fn take(&mut self, observation: &Observation) {
        self.window.take(self.since.elapsed().as_secs_f64(), observation);
        self.freshness.observe(observation);
        let began = &observation.object_truth.envelope;
        let late_ns = LATE * self.run.scenario.wall_period_s() * 1e9;
        let is_late = began.due_ns > 0 && began.stamp_ns.saturating_sub(began.due_ns) as f64 > late_ns;
        self.ticks_late += u64::from(is_late);
        let next = self.last.as_ref().map_or(observation.tick(), |last| last.tick() + 1);
        self.ticks_unseen += observation.tick().saturating_sub(next);
        let team = &observation.team_state.payload;
        let before = self
            .last
            .as_ref()
            .map(|last| (last.team_state.payload.stop_cause, lost_hands(&last.team_state.payload)));
        let (cause, lost_before) = before.unwrap_or_default();
        if team.stop_cause != cause {
            let what = match team.stop_cause {
                0 => "the team goes on".to_owned(),
                _ => self.stop_text(team),
            };
            self.note(observation.tick(), what);
        }
        let lost = lost_hands(team) & !lost_before;
        if lost != 0 {
            let lost = lost.count_ones();
            self.note(
                observation.tick(),
                format!("hands lost: {lost}, {}", stop_cause::name(team.loss_cause)),
            );
        }
        match &mut self.last {
            Some(last) => last.clone_from(observation),
            None => self.last = Some(observation.clone()),
        }
    }

    /// Listens to the run's supervisor.
    ///
    /// # Errors
    /// It is gone: bad usage.
    pub fn listen(&self) -> Result<Listener, Failure> {
        listen_to(&self.directory, self.run.robots.len(), Wish::Some)
    }

    /// A service has other settings from a tick on.
    pub fn revise(&mut self, tick: u64, service: ServiceId) {
        self.note(tick, format!("{} has other settings", label_of(&self.run, service)));
    }

    /// What there is to tell now.
    pub fn snapshot(&mut self) -> Snapshot {
        self.window.forget(self.since.elapsed().as_secs_f64());
        let slots = self.board.statuses();
        let supervisor =
            slots.iter().find(|slot| slot.role == Role::Supervisor).and_then(|slot| slot.process);
        // Where the supervisor is the tap it need not be told twice.
        let is_told = |slot: &&SlotStatus| {
            slot.state != State::Absent && (slot.role != Role::Tap || slot.process != supervisor)
        };
        let slots: Vec<_> = slots.iter().filter(is_told).cloned().collect();
        self.cpu.look(slots.iter().filter_map(|slot| slot.process).map(|process| process.pid));
        slots.iter().for_each(|slot| self.note_change(slot));
        let scenario = &self.run.scenario;
        let period_s = scenario.control_period_s;
        let of_bridge = self.board.last_position(ServiceId::Bridge).map(|position| position.tick);
        let tick = self.last.as_ref().map_or(of_bridge.unwrap_or_default(), Observation::tick);
        Snapshot {
            run: self.directory.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            scenario: scenario.name.clone(),
            seed: scenario.seed,
            clock: match scenario.clock {
                Clock::Lockstep => "lockstep",
                Clock::Wall => "wall",
            },
            tick,
            ticks: self.run.ticks,
            time_s: tick as f64 * period_s,
            rate_hz: self.window.rate_hz(),
            real_time_factor: self.window.rate_hz() * period_s,
            ticks_unseen: self.ticks_unseen,
            team: self.last.as_ref().map(|last| Team::of(&last.team_state.payload, &self.observed)),
            processes: slots.iter().map(|slot| self.process(slot)).collect(),
            robots: self.robots(),
            events: self.happenings.iter().cloned().collect(),
        }
    }

    fn process(&self, slot: &SlotStatus) -> ProcessRow {
        let service = match slot.role {
            Role::Service(service) => Some(service),
            Role::Supervisor | Role::Tap | Role::Link => None,
        };
        ProcessRow {
            status: ProcessStatus::of(slot, Some(&self.run)),
            rate_hz: service.map_or(0.0, |service| self.window.rate_of_hz(service)),
            phases: service.map(|service| self.window.phases_of(service)).unwrap_or_default(),
            missed: match service {
                Some(ServiceId::Bridge) => self.ticks_late,
                Some(service) => self.freshness.ticks_missed(service),
                None => 0,
            },
            cpu_share: slot.process.and_then(|process| self.cpu.of(process.pid)),
            swaps: slot.epoch.saturating_sub(1),
        }
    }

    fn robots(&self) -> Vec<RobotRow> {
        let Some(last) = &self.last else { return vec![] };
        let robots = self.observed.robots.iter().enumerate();
        robots
            .filter_map(|(index, robot)| {
                Some(RobotRow::of(robot, index, last, &self.window.worst_of(index)?))
            })
            .collect()
    }

    fn note_change(&mut self, slot: &SlotStatus) {
        let Role::Service(service) = slot.role else { return };
        if let Some(before) = self.epochs.insert(slot.role, slot.epoch)
            && before != slot.epoch
        {
            self.note(slot.tick, format!("another process is {}", label_of(&self.run, service)));
        }
    }

    fn note(&mut self, tick: u64, what: String) {
        self.happenings.truncate(HAPPENINGS - 1);
        self.happenings.push_front(Happening { tick, what });
    }

    fn stop_text(&self, team: &TeamState) -> String {
        safe_stop_text(team, |index| self.observed.robots.get(index).map(|robot| robot.name.as_str()))
    }
}
