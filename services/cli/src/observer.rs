//! Watches a run tick by tick, and says at the end what it came to.

use crate::arguments::RunArguments;
use crate::failure::{Failure, as_lines};
use crate::judge;
use crate::observed_run::observed_run;
use crate::output_directory::OutputDirectory;
use crate::prepare::Prepared;
use crate::print::print_error;
use crate::progress::Progress;
use crate::wall_clock::Stopwatch;
use core::time::Duration;
use mikoshi_config::RunSpec;
use mikoshi_config::scenario::Clock;
use mikoshi_ipc_types::{ServiceId, TeamState, stop_cause};
use mikoshi_observation::{
    Fault, Figures, Freshness, LogHash, LogWriter, Observation, Summary, Swap, Timing, WriteLogError,
};

/// Observes a run: figures, hash, log, progress.
pub struct RunObserver {
    figures: Figures,
    hash: LogHash,
    log: Option<LogWriter>,
    progress: Progress,
    stamps: Stamps,
    freshness: Freshness,
    frames_lost: u64,
    swaps: Vec<(ServiceId, Swap)>,
    stops: Stops,
    ticks: u64,
    clock: Stopwatch,
}

impl RunObserver {
    /// Nothing observed yet; the clock runs from here.
    ///
    /// # Errors
    /// The log can't be written: [`Status::Fault`](crate::failure::Status::Fault).
    pub fn new(
        prepared: &Prepared,
        arguments: &RunArguments,
        out: &OutputDirectory,
    ) -> Result<Self, Failure> {
        let run = &prepared.run;
        let log = (!arguments.no_log).then(|| LogWriter::create(&out.run_log(), run));
        Ok(Self {
            figures: Figures::new(observed_run(run, prepared.law.internal_forces())?),
            hash: LogHash::default(),
            log: log.transpose().map_err(Failure::fault)?,
            progress: Progress::new(run.ticks, run.scenario.control_period_s, !arguments.quiet),
            stamps: Stamps::default(),
            freshness: Freshness::with_delay(run.scenario.coordination_delay_ticks),
            frames_lost: 0,
            swaps: vec![],
            stops: Stops::of(run),
            ticks: 0,
            clock: Stopwatch::start(),
        })
    }

    /// Takes in one tick.
    ///
    /// # Errors
    /// The log can't be written.
    pub fn observe(&mut self, observation: &Observation) -> Result<(), WriteLogError> {
        self.hash.observe(observation);
        self.figures.observe(observation);
        self.stamps.observe(observation.object_truth.envelope.stamp_ns);
        if let Some(log) = &mut self.log {
            log.write(observation)?;
        }
        self.stops.observe(observation.tick(), &observation.team_state.payload);
        self.freshness.observe(observation);
        self.ticks = observation.tick() + 1;
        self.progress.set_ticks(self.ticks);
        Ok(())
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
    }

    /// Ticks that have gone by.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// Closes the log, and judges the run.
    ///
    /// # Errors
    /// The log can't be written: [`Status::Fault`](crate::failure::Status::Fault).
    pub fn finish(self, run: &RunSpec, faults: Vec<Fault>) -> Result<Summary, Failure> {
        let wall_time_s = self.clock.elapsed().as_secs_f64();
        self.progress.clear();
        if let Some(log) = self.log {
            log.finish().map_err(Failure::fault)?;
        }
        let (figures, scenario) = (self.figures.finish(), &run.scenario);
        let sim_time_s = self.ticks as f64 * scenario.control_period_s;
        let freshness = &self.freshness;
        let count_lost = |(service, swap): (ServiceId, Swap)| {
            let ticks_lost = freshness.ticks_lost(service, swap.tick);
            Swap { ticks_lost, ..swap }
        };
        let mut summary = Summary {
            scenario: scenario.name.clone(),
            seed: scenario.seed,
            ticks: self.ticks,
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
            unintended_contact_ticks: figures.unintended_contact_ticks,
            timing: Timing {
                ticks_held: self.freshness.ticks_held(),
                frames_lost: self.frames_lost,
                ..self.stamps.timing(scenario.clock, scenario.control_period_s)
            },
            faults: [self.stops.faults, faults].concat(),
            swaps: self.swaps.into_iter().map(count_lost).collect(),
        };
        if self.ticks < run.ticks {
            summary.failures.push(format!("the run ended after {} of {} ticks", self.ticks, run.ticks));
        } else {
            summary.failures = judge::failures(scenario, &summary);
        }
        summary.passed = summary.failures.is_empty();
        Ok(summary)
    }
}

/// Why and when the team stopped for safety's sake.
struct Stops {
    robots: Vec<String>,
    cause: u64,
    faults: Vec<Fault>,
}

impl Stops {
    fn of(run: &RunSpec) -> Self {
        let robots = run.robots.iter().map(|robot| robot.member.name.clone()).collect();
        Self { robots, cause: 0, faults: vec![] }
    }

    fn observe(&mut self, tick: u64, team: &TeamState) {
        if core::mem::replace(&mut self.cause, team.stop_cause) == team.stop_cause || team.stop_cause == 0 {
            return;
        }
        let robot =
            (team.stop_robot as usize).checked_sub(1).and_then(|index| self.robots.get(index)).cloned();
        let code = stop_cause::name(team.stop_cause).to_owned();
        let of_robot = robot.as_ref().map_or_else(String::new, |robot| format!(", robot {robot}"));
        print_error(&as_lines("warning", &format!("safe stop in tick {tick}: {code}{of_robot}")));
        self.faults.push(Fault { tick, service: "coordinator".to_owned(), robot, code });
    }
}

/// A tick is late if it took more than so many periods.
const LATE: f64 = 1.1;

/// When ticks began, by the bridge's clock.
#[derive(Default)]
struct Stamps {
    last_ns: Option<u64>,
    periods_ns: Vec<u64>,
}

impl Stamps {
    fn observe(&mut self, stamp_ns: u64) {
        if let Some(last_ns) = self.last_ns.replace(stamp_ns) {
            self.periods_ns.push(stamp_ns.saturating_sub(last_ns));
        }
    }

    /// All zero where no clock was read; in lockstep nothing is late.
    fn timing(mut self, clock: Clock, period_s: f64) -> Timing {
        self.periods_ns.sort_unstable();
        let late_ns = LATE * period_s * 1e9;
        let ticks_late = match clock {
            Clock::Lockstep => 0,
            Clock::Wall => self.periods_ns.iter().filter(|period_ns| **period_ns as f64 > late_ns).count(),
        };
        let quantile = |share: f64| {
            let last = self.periods_ns.len().saturating_sub(1);
            let index = (share * last as f64).round() as usize;
            Duration::from_nanos(self.periods_ns.get(index).copied().unwrap_or_default()).as_secs_f64()
        };
        Timing {
            tick_p50_s: quantile(0.5),
            tick_p99_s: quantile(0.99),
            ticks_late: ticks_late as u64,
            ..Timing::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_periods_between_stamps() {
        let mut stamps = Stamps::default();
        let mut stamp_ns = 1_000;
        stamps.observe(stamp_ns);
        for period_ns in (1..=100).rev() {
            stamp_ns += period_ns;
            stamps.observe(stamp_ns);
        }
        let timing = stamps.timing(Clock::Wall, 90.5e-9);
        assert_eq!((timing.tick_p50_s, timing.tick_p99_s), (51e-9, 99e-9));
        assert_eq!(timing.ticks_late, 1, "one took more than a tenth longer than its period");
        assert_eq!(Stamps::default().timing(Clock::Lockstep, 0.005), Timing::default());
    }
}
