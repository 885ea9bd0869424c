//! Watches a run tick by tick, and says at the end what it came to.

use crate::arguments::ResultsArguments;
use crate::failure::{Failure, as_lines};
use crate::feed::Feed;
use crate::judge;
use crate::latency::{Costs, WARM_UP_TICKS};
use crate::observed_run::observed_run;
use crate::output_directory::OutputDirectory;
use crate::prepare::Prepared;
use crate::print::print_error;
use crate::progress::Progress;
use crate::stamps::Stamps;
use crate::viewer::Viewer;
use crate::wall_clock::Stopwatch;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{ServiceId, TeamState, stop_cause};
use mikoshi_observation::{
    Fault, Figures, Freshness, LatencyFigures, LogHash, Observation, Summary, Swap, Timing, WriteLogError,
    lost_hands,
};
use mikoshi_process::journal::{self, About, Severity};
use mikoshi_recording::Recording;
use mikoshi_runtime::Board;
use std::path::{Path, PathBuf};

/// Observes a run: figures, hash, log, progress.
pub struct RunObserver {
    /// None where nothing is carried.
    figures: Option<Figures>,
    /// Where times are measured.
    latency: Option<(LatencyFigures, Costs)>,
    hash: LogHash,
    log: Option<Recording>,
    /// Where the run leaves the world's description.
    world: PathBuf,
    /// Why and from which tick on there is no log.
    log_failure: Option<String>,
    feed: Option<Feed>,
    is_viewer_expected: bool,
    viewer: Option<Viewer>,
    progress: Progress,
    stamps: Stamps,
    freshness: Freshness,
    frames_lost: u64,
    swaps: Vec<(ServiceId, Swap)>,
    stops: Stops,
    first_tick: Option<u64>,
    heard_push: (u64, u64),
    ticks: u64,
    /// While all processes still work.
    last_counted_tick: u64,
    clock: Stopwatch,
}

impl RunObserver {
    /// Nothing observed yet; the clock runs from here.
    ///
    /// # Errors
    /// The log can't be written: [`Status::Fault`](crate::failure::Status::Fault).
    pub fn new(
        prepared: &Prepared,
        arguments: &ResultsArguments,
        out: &OutputDirectory,
    ) -> Result<Self, Failure> {
        let run = &prepared.run;
        let observed = observed_run(run, prepared.law.internal_forces())?;
        // Services that compute nothing have nothing to show.
        let view_hz = if prepared.is_empty { 0.0 } else { arguments.views.view_hz };
        let log = (!arguments.no_log).then(|| Recording::create(&out.run_log(), run, &observed, view_hz));
        Ok(Self {
            figures: Some(Figures::new(observed)),
            latency: None,
            hash: LogHash::default(),
            log: log.transpose().map_err(Failure::fault)?,
            world: out.world(),
            log_failure: None,
            feed: None,
            is_viewer_expected: false,
            viewer: None,
            progress: Progress::new(run.ticks, run.scenario.control_period_s, !arguments.quiet),
            stamps: Stamps::new(run.scenario.clock, run.scenario.wall_period_s()),
            freshness: Freshness::with_delay(run.scenario.coordination_delay_ticks),
            frames_lost: 0,
            swaps: vec![],
            stops: Stops::of(run),
            first_tick: None,
            heard_push: (0, 0),
            ticks: 0,
            last_counted_tick: run.ticks.saturating_sub(WARM_UP_TICKS),
            clock: Stopwatch::start(),
        })
    }

    /// Measures times, too; of services that compute nothing nothing else.
    #[must_use]
    pub fn measuring(mut self, prepared: &Prepared) -> Self {
        let scenario = &prepared.run.scenario;
        let (period_s, delay_ticks) = (scenario.wall_period_s(), scenario.coordination_delay_ticks);
        let figures = LatencyFigures::new(period_s, delay_ticks, WARM_UP_TICKS);
        self.latency = Some((figures, Costs::default()));
        self.figures = self.figures.filter(|_| !prepared.is_empty);
        self
    }

    /// What was measured.
    pub fn measured(&mut self) -> (LatencyFigures, Costs) {
        self.latency.take().unwrap_or_else(|| (LatencyFigures::new(1.0, 0, 0), Costs::default()))
    }

    /// Counts what processes ask the system for between the end of the warm-up and that of the run.
    pub fn count_costs(&mut self, board: &Board) {
        let Some((_, costs)) = &mut self.latency else { return };
        if self.ticks >= WARM_UP_TICKS && !costs.has_begun() {
            costs.begin(board);
        } else if self.ticks == self.last_counted_tick {
            costs.end(board);
        }
    }

    /// Lets other processes see what is observed of the run in this directory.
    ///
    /// # Errors
    /// There can be no socket.
    pub fn open_feed(&mut self, run_directory: &Path, run: &RunSpec) -> std::io::Result<()> {
        self.feed = Some(Feed::open(run_directory, run.robots.len())?);
        Ok(())
    }

    /// From now on the run is to be shown once it can be.
    pub fn expect_viewer(&mut self) {
        self.is_viewer_expected = true;
    }

    /// Opens the viewer of the run in this directory, if one is expected.
    ///
    /// # Errors
    /// There is none.
    pub fn open_viewer(&mut self, run_directory: &Path) -> Result<(), Failure> {
        if self.is_viewer_expected {
            self.viewer = Some(Viewer::open(run_directory)?);
        }
        Ok(())
    }

    /// The viewer that was opened.
    pub fn viewer(&mut self) -> Option<Viewer> {
        self.viewer.take()
    }

    /// Serves those that listen; `true` if a run that can wait should.
    pub fn serve_listeners(&mut self) -> bool {
        self.feed.as_mut().is_some_and(|feed| {
            feed.look();
            feed.is_behind()
        })
    }

    /// Takes in one tick. That the log can't be written is no reason to stop anybody: it is told at the end.
    pub fn observe(&mut self, observation: &Observation) {
        self.hash.observe(observation);
        if let Some(figures) = &mut self.figures {
            figures.observe(observation);
        }
        if let Some((latency, _)) = &mut self.latency {
            latency.observe(observation);
        }
        self.stamps.observe(observation.object_truth.envelope.stamp_ns);
        let written = self.log.as_mut().map_or(Ok(()), |log| log.write(observation));
        self.note_log(observation.tick(), written);
        if let Some(feed) = &mut self.feed {
            feed.tick(observation);
        }
        self.stops.observe(observation.tick(), &observation.team_state.payload);
        self.freshness.observe(observation);
        let number = observation.object_truth.payload.heard_push_number;
        if number != self.heard_push.0 {
            self.heard_push = (number, observation.tick().saturating_sub(1));
        }
        self.first_tick.get_or_insert(observation.tick());
        self.ticks = observation.tick() + 1;
        self.progress.set_ticks(self.ticks);
    }

    fn note_log(&mut self, tick: u64, written: Result<(), WriteLogError>) {
        let Err(error) = written else { return };
        self.log = None;
        let message = format!("the log ends in tick {tick}: {error}");
        print_error(&as_lines("warning", &message));
        let service = "recorder".to_owned();
        self.stops.faults.push(Fault { tick, service, robot: None, code: "log-lost".to_owned() });
        self.log_failure = Some(message);
    }

    /// Number of the last push that the world has heard of, and the tick in which it was.
    pub fn heard_push(&self) -> (u64, u64) {
        self.heard_push
    }

    /// Takes note of a process that was replaced.
    pub fn note_swap(&mut self, service: ServiceId, swap: Swap) {
        self.swaps.push((service, swap));
    }

    /// Takes note of something that went wrong, though the run goes on.
    pub fn note_fault(&mut self, fault: Fault) {
        self.stops.faults.push(fault);
    }

    /// Takes note of frames that never came.
    pub fn note_lost_frames(&mut self, frames: u64) {
        self.frames_lost = frames;
    }

    /// Keeps the description of the run that a service has from a swap on. What the log
    /// can't take now it will not take later either, and says so then.
    pub fn note_revision(&mut self, swap: &Swap, service: ServiceId, revised: &RunSpec) {
        if let Some(log) = &mut self.log {
            let _ = log.write_revision(swap.tick, service, revised);
        }
        if let Some(feed) = &mut self.feed {
            feed.revision(swap.tick, service, revised);
        }
    }

    /// Ticks that have gone by.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// Closes the log, and judges the run.
    pub fn finish(mut self, run: &RunSpec, faults: Vec<Fault>) -> Summary {
        let wall_time_s = self.clock.elapsed().as_secs_f64();
        self.progress.clear();
        let written = self.log.take().map_or(Ok(()), |log| log.finish(&self.world));
        self.note_log(self.ticks, written);
        if let Some(feed) = self.feed.take() {
            feed.end();
        }
        let is_judged = self.figures.is_some();
        let figures = self.figures.map(Figures::finish).unwrap_or_default();
        let scenario = &run.scenario;
        let first_tick = self.first_tick.unwrap_or_default();
        let sim_time_s = (self.ticks - first_tick) as f64 * scenario.control_period_s;
        let freshness = &self.freshness;
        let count_lost = |(service, swap): (ServiceId, Swap)| {
            let ticks_lost = freshness.ticks_lost(service, swap.tick);
            Swap { ticks_lost, ..swap }
        };
        let mut summary = Summary {
            scenario: scenario.name.clone(),
            seed: scenario.seed,
            ticks: self.ticks,
            first_tick,
            control_period_s: scenario.control_period_s,
            sim_time_s,
            wall_time_s,
            real_time_factor: sim_time_s / wall_time_s,
            passed: false,
            failures: vec![],
            log_hash: self.hash.to_hex(),
            fell: figures.fell,
            modes: figures.modes,
            object: figures.object,
            internal: figures.internal,
            internal_measurement_error_n: figures.internal_measurement_error_n,
            internal_measurement_error_nm: figures.internal_measurement_error_nm,
            robots: figures.robots,
            drift_between_robots_m: figures.drift_between_robots_m,
            minutes: figures.minutes,
            load: figures.load,
            members: figures.members,
            unintended_contact_ticks: figures.unintended_contact_ticks,
            timing: Timing {
                ticks_held: self.freshness.ticks_held(),
                frames_lost: self.frames_lost,
                ..self.stamps.timing()
            },
            faults: [self.stops.faults, faults].concat(),
            swaps: self.swaps.into_iter().map(count_lost).collect(),
        };
        if self.ticks < run.ticks {
            summary.failures.push(format!("the run ended after {} of {} ticks", self.ticks, run.ticks));
        } else if is_judged {
            summary.failures = judge::failures(scenario, &summary);
        }
        summary.failures.extend(self.log_failure);
        summary.passed = summary.failures.is_empty();
        summary
    }
}

/// Why and when the team stopped for safety's sake, and whose hands it has lost.
struct Stops {
    robots: Vec<String>,
    /// Robot and name of each hand, in hand order.
    hands: Vec<(String, String)>,
    cause: u64,
    absent_hands: u64,
    faults: Vec<Fault>,
}

impl Stops {
    fn of(run: &RunSpec) -> Self {
        let robots = run.robots.iter().map(|robot| robot.member.name.clone()).collect();
        let hands = run.robots.iter().flat_map(|robot| {
            let name = |&hand: &usize| (robot.member.name.clone(), robot.config.hands[hand].name.clone());
            robot.grasping_hands.iter().map(name)
        });
        Self { robots, hands: hands.collect(), cause: 0, absent_hands: 0, faults: vec![] }
    }

    fn observe(&mut self, tick: u64, team: &TeamState) {
        self.observe_hands(tick, team);
        self.observe_stop(tick, team);
    }

    fn observe_hands(&mut self, tick: u64, team: &TeamState) {
        let lost = lost_hands(team);
        let lost = lost & !core::mem::replace(&mut self.absent_hands, lost);
        let left = self.hands.len() as u32 - team.absent_hands.count_ones();
        let code = stop_cause::name(team.loss_cause);
        for (_, (robot, hand)) in self.hands.iter().enumerate().filter(|(index, _)| lost >> index & 1 != 0) {
            let text = format!(
                "{robot}'s {hand} hand lost the object in tick {tick}: {code}, {left} hands are left"
            );
            let about = About { tick: Some(tick), robot: Some(robot), fault: Some(code) };
            journal::say(Severity::Warning, about, text);
            // A team that stops for it says so itself.
            if team.stop_cause == 0 {
                let (service, robot) = ("coordinator".to_owned(), Some(robot.clone()));
                self.faults.push(Fault { tick, service, robot, code: code.to_owned() });
            }
        }
    }

    fn observe_stop(&mut self, tick: u64, team: &TeamState) {
        if core::mem::replace(&mut self.cause, team.stop_cause) == team.stop_cause || team.stop_cause == 0 {
            return;
        }
        let robot =
            (team.stop_robot as usize).checked_sub(1).and_then(|index| self.robots.get(index)).cloned();
        let code = stop_cause::name(team.stop_cause).to_owned();
        let of_robot = robot.as_ref().map_or_else(String::new, |robot| format!(", robot {robot}"));
        let about = About { tick: Some(tick), robot: robot.as_deref(), fault: Some(&code) };
        journal::say(Severity::Warning, about, format_args!("safe stop in tick {tick}: {code}{of_robot}"));
        self.faults.push(Fault { tick, service: "coordinator".to_owned(), robot, code });
    }
}
