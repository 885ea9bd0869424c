//! What a measurement came to: a file that scripts read, and a table.

use super::machine::CoreLateness;
use crate::table;
use core::fmt::Write as _;
use mikoshi_observation::{SpanSummary, WorstTick};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// One measurement. Keys stay, more may follow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct LatencyResult {
    pub scenario: String,
    pub robots: usize,
    pub seed: u64,
    /// Whether services computed nothing.
    pub empty: bool,
    pub clock: String,
    pub control_period_s: f64,
    /// How long a process that waits gives way to others before it sleeps.
    pub yield_us: u32,
    pub fifo_priority: Option<u8>,
    /// Threads that disturbed.
    pub load: usize,
    /// Ticks that were measured.
    pub ticks: u64,
    pub spans: Vec<SpanSummary>,
    pub late: Lateness,
    /// Ticks in which the world moved on without a robot's command.
    pub ticks_held: u64,
    /// Frames that the measurement missed.
    pub frames_lost: u64,
    /// What the processes asked the system for after the first ticks.
    pub processes: Vec<ProcessCosts>,
    /// How late an idle machine wakes up who sleeps.
    pub machine_idle: Vec<CoreLateness>,
    /// The same beside the run.
    pub machine: Vec<CoreLateness>,
    pub worst: Vec<WorstTick>,
}

/// Ticks that began more than a tenth of their period after they were due.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Lateness {
    pub ticks: u64,
    /// Of those, ticks before which a core stood still, as a thread above all services noticed.
    pub by_the_machine: u64,
    /// All others.
    pub by_us: u64,
    /// Without the right to a priority above the services nobody can say.
    pub by_nobody_knows: u64,
}

/// What one process asked the system for, from the end of the warm-up to the end of the measurement.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct ProcessCosts {
    pub service: String,
    pub ticks: u64,
    pub page_faults: u64,
    pub allocations: u64,
    pub voluntary_switches: u64,
    pub involuntary_switches: u64,
}

impl LatencyResult {
    /// For people.
    pub fn to_text(&self, out: &Path) -> String {
        let mut text = String::new();
        let what = if self.empty { "empty services" } else { "services" };
        // Writing to a String can't fail.
        let _ = writeln!(
            text,
            "{}: {} robots, {what}, {} clock, {} ticks of {} ms, yielding for {} us{}{}\n",
            self.scenario,
            self.robots,
            self.clock,
            self.ticks,
            self.control_period_s * 1e3,
            self.yield_us,
            self.fifo_priority.map_or_else(String::new, |priority| format!(", FIFO {priority}")),
            if self.load > 0 { format!(", {} threads of load", self.load) } else { String::new() },
        );
        text += &table::of_numbers(
            &["us", "p50", "p90", "p99", "p99.9", "max", "times"],
            self.spans.iter().map(|span| {
                let times = [span.p50_ns, span.p90_ns, span.p99_ns, span.p999_ns, span.max_ns];
                let cells = times.map(us).into_iter().chain([span.count.to_string()]);
                core::iter::once(span.span.to_string()).chain(cells).collect()
            }),
        );
        text.push('\n');
        text += &table::of_numbers(
            &["waking up, us", "p50", "p99", "p99.9", "max"],
            [("idle", &self.machine_idle), ("beside the run", &self.machine)].into_iter().flat_map(
                |(when, cores)| {
                    cores.iter().map(move |core| {
                        let times = [core.p50_ns, core.p99_ns, core.p999_ns, core.max_ns].map(us);
                        core::iter::once(format!("core {}, {when}", core.core)).chain(times).collect()
                    })
                },
            ),
        );
        text.push('\n');
        text += &table::of_numbers(
            &["per tick", "page faults", "allocations", "sleeps", "preempted"],
            self.processes.iter().map(|process| {
                let rate = |count: u64| format!("{:.3}", count as f64 / process.ticks.max(1) as f64);
                let of_process = [
                    process.page_faults,
                    process.allocations,
                    process.voluntary_switches,
                    process.involuntary_switches,
                ];
                core::iter::once(process.service.clone()).chain(of_process.map(rate)).collect()
            }),
        );
        if self.clock == "wall" {
            let Lateness { ticks, by_the_machine, by_us, by_nobody_knows } = self.late;
            let _ = writeln!(
                text,
                "\n{ticks} of {} ticks began late: {by_the_machine} by the machine, {by_us} by us, \
                 {by_nobody_knows} nobody can say; {} ticks without a command",
                self.ticks, self.ticks_held
            );
        }
        if self.frames_lost > 0 {
            let _ = writeln!(text, "{} frames were not seen", self.frames_lost);
        }
        let _ = writeln!(text, "results in {}", out.display());
        text
    }
}

fn us(ns: u64) -> String {
    format!("{:.1}", ns as f64 * 1e-3)
}
