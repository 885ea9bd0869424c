//! What a measurement came to: a file that scripts read, and a table.

use super::machine::CoreLateness;
use crate::table;
use mikoshi_observation::{LateTick, Span, SpanSummary, WorstTick};
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
    /// What a tick in lockstep can't be faster than on these cores, by the medians of its services.
    #[serde(default)]
    pub critical_path_ns: Option<u64>,
    pub late: Lateness,
    /// All of them.
    #[serde(default)]
    pub late_ticks: Vec<LateTick>,
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

pub const TIME_TITLES: [&str; 7] = ["us", "p50", "p90", "p99", "p99.9", "max", "times"];
pub const MACHINE_TITLES: [&str; 5] = ["waking up, us", "p50", "p99", "p99.9", "max"];
pub const COST_TITLES: [&str; 5] = ["per tick", "page faults", "allocations", "sleeps", "preempted"];

impl LatencyResult {
    /// Of what.
    pub fn title(&self) -> String {
        let what = if self.empty { "empty services" } else { "services" };
        let fifo = self.fifo_priority.map_or_else(String::new, |priority| format!(", FIFO {priority}"));
        let load = if self.load > 0 { format!(", {} threads of load", self.load) } else { String::new() };
        format!(
            "{}: {} robots, {what}, {} clock, {} ticks of {} ms, yielding for {} us{fifo}{load}",
            self.scenario,
            self.robots,
            self.clock,
            self.ticks,
            self.control_period_s * 1e3,
            self.yield_us,
        )
    }

    /// What it found, in sentences.
    pub fn findings(&self) -> Vec<String> {
        let mut findings = vec![];
        if let (Some(path_ns), Some(tick_ns)) = (self.critical_path_ns, p50_ns(&self.spans, Span::Tick)) {
            findings.push(format!(
                "a tick takes {:.2} x the critical path of {} us on {} cores (physics, then the slower core's \
                 share of control), and the run goes {:.1} x as fast as its clock",
                tick_ns as f64 / path_ns as f64,
                us(path_ns),
                self.machine.len(),
                self.control_period_s * 1e9 / tick_ns as f64,
            ));
        }
        if self.clock == "wall" {
            let Lateness { ticks, by_the_machine, by_us, by_nobody_knows } = self.late;
            findings.push(format!(
                "{ticks} of {} ticks began late: {by_the_machine} by the machine, {by_us} by us, \
                 {by_nobody_knows} nobody can say",
                self.ticks
            ));
        }
        if self.ticks_held > 0 {
            findings.push(format!("{} ticks without some robot's command", self.ticks_held));
        }
        if self.frames_lost > 0 {
            findings.push(format!("{} frames were not seen", self.frames_lost));
        }
        findings
    }

    /// Rows below [`TIME_TITLES`].
    pub fn time_rows(&self) -> Vec<Vec<String>> {
        let row = |span: &SpanSummary| {
            let times = [span.p50_ns, span.p90_ns, span.p99_ns, span.p999_ns, span.max_ns];
            let cells = times.map(us).into_iter().chain([span.count.to_string()]);
            core::iter::once(span.span.to_string()).chain(cells).collect()
        };
        self.spans.iter().map(row).collect()
    }

    /// Rows below [`MACHINE_TITLES`].
    pub fn machine_rows(&self) -> Vec<Vec<String>> {
        let idle = self.machine_idle.iter().map(|core| ("idle", core));
        let beside = self.machine.iter().map(|core| ("beside the run", core));
        let row = |(when, core): (&str, &CoreLateness)| {
            let times = [core.p50_ns, core.p99_ns, core.p999_ns, core.max_ns].map(us);
            core::iter::once(format!("core {}, {when}", core.core)).chain(times).collect()
        };
        idle.chain(beside).map(row).collect()
    }

    /// Rows below [`COST_TITLES`].
    pub fn cost_rows(&self) -> Vec<Vec<String>> {
        let row = |process: &ProcessCosts| {
            let ProcessCosts { service, ticks, .. } = process;
            let rate = |count: u64| format!("{:.3}", count as f64 / (*ticks).max(1) as f64);
            let counts = [
                process.page_faults,
                process.allocations,
                process.voluntary_switches,
                process.involuntary_switches,
            ];
            core::iter::once(service.clone()).chain(counts.map(rate)).collect()
        };
        self.processes.iter().map(row).collect()
    }

    /// For people.
    pub fn to_text(&self, out: &Path) -> String {
        let tables = [
            table::of_numbers(&TIME_TITLES, self.time_rows()),
            table::of_numbers(&MACHINE_TITLES, self.machine_rows()),
            table::of_numbers(&COST_TITLES, self.cost_rows()),
        ];
        let findings: String = self.findings().iter().map(|finding| format!("{finding}\n")).collect();
        format!("{}\n\n{}\n{findings}results in {}\n", self.title(), tables.join("\n"), out.display())
    }
}

/// Physics, the coordinator, and the servos that the slower of so many cores has, one after the other.
pub fn critical_path_ns(spans: &[SpanSummary], robots: usize, cores: usize) -> Option<u64> {
    let [step, coordinate, sense, act] =
        [Span::Step, Span::Coordinate, Span::Sense, Span::Act].map(|span| p50_ns(spans, span));
    let servos = robots.div_ceil(cores.max(1)) as u64;
    Some(step? + coordinate? + servos * (sense? + act?))
}

fn p50_ns(spans: &[SpanSummary], span: Span) -> Option<u64> {
    spans.iter().find(|summary| summary.span == span).map(|summary| summary.p50_ns)
}

/// Microseconds.
pub fn us(ns: u64) -> String {
    format!("{:.1}", ns as f64 * 1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_observation::times_ns;

    #[test]
    fn the_critical_path_has_the_servos_of_the_slower_core() {
        let of = |span, ns| {
            let mut histogram = times_ns();
            histogram.saturating_record(ns);
            SpanSummary::of(span, &histogram)
        };
        let mut spans =
            vec![of(Span::Step, 700), of(Span::Coordinate, 20), of(Span::Sense, 6), of(Span::Act, 24)];
        assert_eq!(critical_path_ns(&spans, 4, 2), Some(700 + 20 + 2 * 30));
        assert_eq!(critical_path_ns(&spans, 5, 2), Some(700 + 20 + 3 * 30));
        assert_eq!(critical_path_ns(&spans, 4, 8), Some(700 + 20 + 30));
        spans.pop();
        assert_eq!(critical_path_ns(&spans, 4, 2), None);
    }
}
