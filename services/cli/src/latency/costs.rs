//! What the processes of a run ask the system for: page faults, memory, switches.

use super::result::ProcessCosts;
use crate::outcome::label_of;
use crate::process_status::ProcessStatus;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::Board;
use std::collections::BTreeMap;
use std::fs;

/// Counted from the end of the warm-up on.
#[derive(Debug, Default)]
pub struct Costs {
    begin: BTreeMap<ServiceId, Counters>,
    end: BTreeMap<ServiceId, Counters>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Counters {
    pid: u32,
    tick: u64,
    page_faults: u64,
    allocations: u64,
    voluntary_switches: u64,
    involuntary_switches: u64,
}

impl Costs {
    /// Whether counting has begun.
    pub fn has_begun(&self) -> bool {
        !self.begin.is_empty()
    }

    /// Begins with what all processes have asked for so far.
    pub fn begin(&mut self, board: &Board) {
        self.begin = counters_of(board);
    }

    /// Takes note of what they have asked for by now.
    pub fn end(&mut self, board: &Board) {
        self.end = counters_of(board);
    }

    /// What it comes to; of services whose process was replaced nothing.
    pub fn of(&self, run: &RunSpec) -> Vec<ProcessCosts> {
        let both = self.begin.iter().filter_map(|(service, begin)| {
            let end = self.end.get(service).filter(|end| end.pid == begin.pid)?;
            Some((service, begin, end))
        });
        both.map(|(service, begin, end)| ProcessCosts {
            service: label_of(run, *service),
            ticks: end.tick.saturating_sub(begin.tick),
            page_faults: end.page_faults.saturating_sub(begin.page_faults),
            allocations: end.allocations.saturating_sub(begin.allocations),
            voluntary_switches: end.voluntary_switches.saturating_sub(begin.voluntary_switches),
            involuntary_switches: end.involuntary_switches.saturating_sub(begin.involuntary_switches),
        })
        .collect()
    }
}

fn counters_of(board: &Board) -> BTreeMap<ServiceId, Counters> {
    let services: Vec<_> = board.positions().collect();
    let found = services.into_iter().filter_map(|(service, at)| {
        let pid = board.process_of(service)?.pid;
        let counters = Counters::of(pid)?;
        let allocations = board.allocations_of(service).unwrap_or_default();
        Some((service, Counters { tick: at.tick, allocations, ..counters }))
    });
    found.collect()
}

impl Counters {
    fn of(pid: u32) -> Option<Self> {
        let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        let (_, after_name) = stat.rsplit_once(')')?;
        let fields: Vec<&str> = after_name.split_ascii_whitespace().collect();
        // Fields 10 and 12 of the line: minor and major faults.
        let field = |number: usize| fields.get(number - 3)?.parse::<u64>().ok();
        let status = ProcessStatus::of(pid)?;
        Some(Self {
            pid,
            page_faults: field(10)? + field(12)?,
            voluntary_switches: status.number("voluntary_ctxt_switches")?,
            involuntary_switches: status.number("nonvoluntary_ctxt_switches")?,
            ..Self::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_process_has_counters_and_one_that_is_gone_has_none() {
        let own = Counters::of(std::process::id()).expect("/proc is there");
        assert!(own.page_faults > 0 && own.voluntary_switches + own.involuntary_switches > 0, "{own:?}");
        assert!(Counters::of(u32::MAX).is_none());
    }
}
