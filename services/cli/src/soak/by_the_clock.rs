//! A run in wall-clock time whose processes are killed and frozen while their standbys wait.

use super::{Attempt, LOOK, board_of, left_behind};
use crate::arguments::SoakArguments;
use crate::failure::{Failure, Status};
use crate::interrupts::Interrupts;
use crate::output_directory::OutputDirectory;
use crate::print::print_out;
use crate::table;
use crate::wall_clock::pause;
use core::fmt::Write as _;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_observation::Summary;
use mikoshi_runtime::{Role, State};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use rustix::process::{Pid, Signal, kill_process};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// How often somebody is killed, and frozen, unless told otherwise.
const TIMES: usize = 100;
/// Between two blows, at least: a new standby must be there.
const PAUSE_S: f64 = 0.6;
/// Blows begin when the team walks, and end before it rests.
const FIRST_S: f64 = 5.0;
const LAST_S: f64 = 4.0;
/// When a frozen process is thawed: long after its standby has taken over.
const THAW_S: f64 = 0.3;

/// What is done to a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Blow {
    Kill,
    Freeze,
}

/// What happens in one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Strike {
    tick: u64,
    victim: ServiceId,
    blow: Blow,
}

/// What a soak came to.
#[derive(Debug, Serialize)]
struct ClockSoakResult {
    scenario: String,
    passed: bool,
    failures: Vec<String>,
    rounds: Vec<Round>,
    losses: Vec<Losses>,
}

/// One run.
#[derive(Debug, Serialize)]
struct Round {
    seed: u64,
    blows: usize,
    passed: bool,
    tick_p50_s: f64,
    tick_p99_s: f64,
    ticks_late: u64,
    ticks_held: u64,
}

/// For how many ticks commands were missing when processes were replaced.
#[derive(Debug, Serialize)]
struct Losses {
    service: String,
    cause: String,
    times: usize,
    ticks_median: u64,
    ticks_worst: u64,
}

/// As many rounds as it takes.
pub fn soak(arguments: &SoakArguments, run: &RunSpec, interrupts: &Interrupts) -> Result<Status, Failure> {
    let name = &run.scenario.name;
    let out =
        arguments.out.clone().unwrap_or_else(|| Path::new("runs").join(format!("soak-{name}-real-time")));
    let blows = blows(arguments.kills.unwrap_or(TIMES), arguments.freezes.unwrap_or(TIMES));
    let per_round = blows_per_round(run)?;
    let mut result = ClockSoakResult {
        scenario: name.clone(),
        passed: false,
        failures: vec![],
        rounds: vec![],
        losses: vec![],
    };
    let mut lost: BTreeMap<(String, String), Vec<u64>> = BTreeMap::new();
    for (index, blows) in blows.chunks(per_round).enumerate() {
        let seed = run.scenario.seed + index as u64;
        let folder = out.join(format!("seed-{seed}"));
        fs::create_dir_all(&folder).map_err(|error| Failure::fault(error).context(folder.display()))?;
        drop(OutputDirectory::open(&folder, true)?);
        let strikes = draw(run, seed, blows);
        let options = ["--real-time", "--set", "supervision.standby=true"];
        let mut attempt = Attempt::start(arguments, seed, &folder, &options)?;
        let directory = attempt.directory();
        let struck = strike(&strikes, run.scenario.control_period_s, &mut attempt, interrupts);
        let summary: Summary = serde_json::from_value(attempt.finish(interrupts)?).map_err(Failure::fault)?;
        result.take(seed, struck, strikes.len(), &summary, &left_behind(&directory)?);
        for swap in summary.swaps {
            lost.entry((swap.service, swap.cause)).or_default().push(swap.ticks_lost);
        }
    }
    result.losses =
        lost.into_iter().map(|((service, cause), ticks)| Losses::of(service, cause, ticks)).collect();
    result.passed = result.failures.is_empty();
    let json = serde_json::to_string_pretty(&result).map_err(Failure::fault)? + "\n";
    let file = out.join("soak.json");
    fs::write(&file, &json).map_err(|error| Failure::fault(error).context(file.display()))?;
    if arguments.json {
        print_out(&json);
    } else if !arguments.quiet {
        print_out(&result.to_text(&out));
    }
    Ok(if result.passed { Status::Met } else { Status::NotMet })
}

/// Kills and freezes by turns.
fn blows(kills: usize, freezes: usize) -> Vec<Blow> {
    let mut blows = Vec::with_capacity(kills + freezes);
    for index in 0..kills.max(freezes) {
        blows.extend((index < kills).then_some(Blow::Kill));
        blows.extend((index < freezes).then_some(Blow::Freeze));
    }
    blows
}

fn blows_per_round(run: &RunSpec) -> Result<usize, Failure> {
    let time_s = run.scenario.duration_s - FIRST_S - LAST_S;
    match (time_s / PAUSE_S).floor() {
        // Kills and freezes of servos and of the coordinator come to the same number.
        blows if blows >= 4.0 => Ok(blows as usize / 4 * 4),
        blows if blows >= 1.0 => Ok(blows as usize),
        _ => Err(Failure::usage(format!(
            "duration_s: found {}, expected more than {} for a soak in real time",
            run.scenario.duration_s,
            FIRST_S + LAST_S + PAUSE_S
        ))),
    }
}

/// Blows spread over a run; every second pair of them is at the coordinator, the others at a servo.
fn draw(run: &RunSpec, seed: u64, blows: &[Blow]) -> Vec<Strike> {
    let mut random = Pcg64::seed_from_u64(seed);
    let (first, last) = (run.scenario.tick_at(FIRST_S), run.ticks - run.scenario.tick_at(LAST_S));
    let step = (last - first) / blows.len().max(1) as u64;
    let strikes = blows.iter().enumerate().map(|(index, &blow)| {
        let victim = match (index / 2) % 2 {
            0 => ServiceId::Servo(random.random_range(0..run.robots.len())),
            _ => ServiceId::Coordinator,
        };
        let tick = first + index as u64 * step + random.random_range(0..(step / 8).max(1));
        Strike { tick, victim, blow }
    });
    strikes.collect()
}

/// Strikes, and thaws what it froze; how many blows hit.
fn strike(strikes: &[Strike], period_s: f64, attempt: &mut Attempt, interrupts: &Interrupts) -> usize {
    let directory = attempt.directory();
    let mut is_over =
        || matches!(attempt.child.try_wait(), Ok(Some(_)) | Err(_)) || interrupts.received().is_some();
    let Some(board) = board_of(&directory, &mut is_over) else { return 0 };
    let thaw_ticks = (THAW_S / period_s).round() as u64;
    let mut strikes = strikes.iter().peekable();
    let mut frozen: Vec<(u64, Pid)> = vec![];
    let mut struck = 0;
    while !is_over() {
        let tick = board.last_position(ServiceId::Bridge).unwrap_or_default().tick;
        // Who is just taking over is struck as soon as it has.
        let is_due = |strike: &&Strike| {
            let running = (Role::Service(strike.victim), State::Running);
            tick >= strike.tick && board.states().any(|state| state == running)
        };
        if let Some(strike) = strikes.next_if(is_due) {
            let process = board.process_of(strike.victim);
            let pid = process.and_then(|process| Pid::from_raw(i32::try_from(process.pid).ok()?));
            let signal = if strike.blow == Blow::Kill { Signal::KILL } else { Signal::STOP };
            if let Some(pid) = pid.filter(|&pid| kill_process(pid, signal).is_ok()) {
                struck += 1;
                if strike.blow == Blow::Freeze {
                    frozen.push((tick + thaw_ticks, pid));
                }
            }
        }
        frozen.retain(|&(thaw_tick, pid)| {
            if tick < thaw_tick {
                return true;
            }
            // It may have been buried meanwhile.
            let _ = kill_process(pid, Signal::CONT);
            false
        });
        pause(LOOK);
    }
    struck
}

impl ClockSoakResult {
    fn take(&mut self, seed: u64, struck: usize, strikes: usize, summary: &Summary, left_behind: &[PathBuf]) {
        let mut fail = |problem: String| self.failures.push(format!("seed {seed}: {problem}"));
        if struck < strikes {
            fail(format!("{struck} of {strikes} blows hit"));
        }
        if summary.swaps.len() < struck {
            fail(format!("{struck} processes were struck, {} were replaced", summary.swaps.len()));
        }
        for fault in &summary.faults {
            fail(format!("{} in tick {}", fault.code, fault.tick));
        }
        if !left_behind.is_empty() {
            fail(format!("{} files were left in shared memory", left_behind.len()));
        }
        summary.failures.iter().cloned().for_each(fail);
        self.rounds.push(Round {
            seed,
            blows: struck,
            passed: summary.passed,
            tick_p50_s: summary.timing.tick_p50_s,
            tick_p99_s: summary.timing.tick_p99_s,
            ticks_late: summary.timing.ticks_late,
            ticks_held: summary.timing.ticks_held,
        });
    }

    fn to_text(&self, out: &Path) -> String {
        let milliseconds = |seconds: f64| format!("{:.2}", 1e3 * seconds);
        let rounds = self.rounds.iter().map(|round| {
            vec![
                round.seed.to_string(),
                round.blows.to_string(),
                milliseconds(round.tick_p50_s),
                milliseconds(round.tick_p99_s),
                round.ticks_late.to_string(),
                round.ticks_held.to_string(),
                if round.passed { "met" } else { "not met" }.to_owned(),
            ]
        });
        let titles = ["seed", "blows", "tick p50 ms", "p99 ms", "late", "held", "thresholds"];
        let mut text = table::of_text(&titles, rounds);
        let losses = self.losses.iter().map(|row| {
            let counts = [row.times.to_string(), row.ticks_median.to_string(), row.ticks_worst.to_string()];
            [vec![row.service.clone(), row.cause.clone()], counts.to_vec()].concat()
        });
        text +=
            &table::of_text(&["service", "replaced since", "times", "ticks lost, median", "worst"], losses);
        for failure in &self.failures {
            // Writing to a String can't fail.
            let _ = writeln!(text, "failed: {failure}");
        }
        let verdict = if self.passed { "passed: nobody noticed" } else { "failed" };
        let _ = writeln!(text, "results in {}\n{verdict}", out.display());
        text
    }
}

impl Losses {
    fn of(service: String, cause: String, mut ticks: Vec<u64>) -> Self {
        ticks.sort_unstable();
        let at = |index: usize| ticks.get(index).copied().unwrap_or_default();
        let (times, last) = (ticks.len(), ticks.len().saturating_sub(1));
        Self { service, cause, times, ticks_median: at(last / 2), ticks_worst: at(last) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kills_and_freezes_come_by_turns_and_none_is_forgotten() {
        use Blow::{Freeze, Kill};
        assert_eq!(blows(3, 1), [Kill, Freeze, Kill, Kill]);
        assert_eq!(blows(0, 2), [Freeze, Freeze]);
    }

    #[test]
    fn of_losses_the_median_and_the_worst_are_told() {
        let losses = Losses::of("servo".to_owned(), "killed".to_owned(), vec![5, 1, 2]);
        assert_eq!((losses.times, losses.ticks_median, losses.ticks_worst), (3, 2, 5));
    }
}
