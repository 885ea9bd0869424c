//! What the machine does by itself: threads that only sleep and look how late they wake up, one on each core, as
//! `cyclictest` does. While a run goes on they say whose fault a late tick is.

use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use mikoshi_observation::{LateTick, times_ns};
use mikoshi_runtime::{OnMissingRight, RealTime, now_ns, sleep_until};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::thread::JoinHandle;

/// How often they wake up.
const PERIOD_NS: u64 = 1_000_000;
/// What is told as a stall.
const STALL_NS: u64 = 100_000;
const MAX_STALLS: usize = 100_000;
/// Of the time by which a tick was late, as much must lie within stalls for it to be the machine's fault.
const MACHINES_SHARE: f64 = 0.5;

/// How late one core woke its thread up \[ns\].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct CoreLateness {
    pub core: usize,
    /// Whether its thread had a priority above the services', so that it waited for nobody but the machine.
    pub is_above_services: bool,
    pub count: u64,
    pub p50_ns: u64,
    pub p99_ns: u64,
    pub p999_ns: u64,
    pub max_ns: u64,
    /// Times in which it should have run and did not, if they were long: from, to.
    #[serde(skip)]
    pub stalls: Vec<(u64, u64)>,
}

/// Threads that watch.
pub struct MachineWatch {
    is_over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<CoreLateness>>,
}

impl MachineWatch {
    /// Starts one on each core that this process may use, with a priority one above `fifo_priority` if there is one.
    pub fn start(fifo_priority: Option<u8>) -> Self {
        let is_over = Arc::new(AtomicBool::new(false));
        let cores = core_affinity::get_core_ids().unwrap_or_default();
        let watch = |core: core_affinity::CoreId| {
            let is_over = Arc::clone(&is_over);
            std::thread::spawn(move || watch_core(core.id, fifo_priority, &is_over))
        };
        Self { threads: cores.into_iter().map(watch).collect(), is_over }
    }

    /// Ends them; what they saw, by core.
    pub fn stop(self) -> Vec<CoreLateness> {
        self.is_over.store(true, Ordering::Relaxed);
        // One that panicked has nothing to tell.
        self.threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
    }
}

fn watch_core(core: usize, fifo_priority: Option<u8>, is_over: &AtomicBool) -> CoreLateness {
    let ask = |fifo_priority| RealTime {
        core: Some(core),
        fifo_priority,
        lock_memory: false,
        on_missing_right: OnMissingRight::Warn,
    };
    let missing = ask(fifo_priority.map(|priority| priority.saturating_add(1).min(99))).apply();
    let is_above_services = fifo_priority.is_some() && missing.is_ok_and(|missing| missing.is_empty());
    let mut histogram = times_ns();
    let mut stalls = vec![];
    let mut due_ns = now_ns();
    while !is_over.load(Ordering::Relaxed) {
        due_ns += PERIOD_NS;
        sleep_until(due_ns);
        let now_ns = now_ns();
        let late_ns = now_ns.saturating_sub(due_ns);
        histogram.saturating_record(late_ns);
        if late_ns > STALL_NS && stalls.len() < MAX_STALLS {
            stalls.push((due_ns, now_ns));
        }
        // What was slept through is not made up for.
        due_ns = due_ns.max(now_ns.saturating_sub(PERIOD_NS));
    }
    let at = |share| histogram.value_at_quantile(share);
    CoreLateness {
        core,
        is_above_services,
        count: histogram.len(),
        p50_ns: at(0.5),
        p99_ns: at(0.99),
        p999_ns: at(0.999),
        max_ns: histogram.max(),
        stalls,
    }
}

/// Whether a tick was late since a core stood still, or since its bridge, that was ready, was not woken up while no
/// other service had anything to do either; none if nobody can tell, as all had to queue behind others.
pub fn is_the_machines(late: &LateTick, cores: &[CoreLateness]) -> Option<bool> {
    if cores.iter().any(|core| !core.is_above_services) {
        return None;
    }
    let late_ns = late.began_ns.saturating_sub(late.due_ns);
    let is_much = |ns: u64| ns as f64 >= MACHINES_SHARE * late_ns as f64;
    if !late.is_overrun() && is_much(late_ns.saturating_sub(late.others_busy_ns)) {
        return Some(true);
    }
    let overlap_ns = |&(from_ns, to_ns): &(u64, u64)| {
        to_ns.min(late.began_ns).saturating_sub(from_ns.max(late.due_ns - late.due_ns.min(PERIOD_NS)))
    };
    let longest_ns = cores.iter().map(|core| core.stalls.iter().map(overlap_ns).sum::<u64>()).max();
    Some(is_much(longest_ns.unwrap_or_default()))
}

/// Sees what an idle machine does for so long.
pub fn idle(duration: Duration, fifo_priority: Option<u8>) -> Vec<CoreLateness> {
    let watch = MachineWatch::start(fifo_priority);
    crate::wall_clock::pause(duration);
    watch.stop()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn core(stalls: &[(u64, u64)], is_above_services: bool) -> CoreLateness {
        CoreLateness {
            core: 0,
            is_above_services,
            count: 1,
            p50_ns: 0,
            p99_ns: 0,
            p999_ns: 0,
            max_ns: 0,
            stalls: stalls.to_vec(),
        }
    }

    /// Due at 50 ms, begun at 54 ms.
    fn late(ready_ns: u64, others_busy_ns: u64) -> LateTick {
        let (due_ns, began_ns) = (50_000_000, 54_000_000);
        LateTick { tick: 7, due_ns, heard_ns: 49_000_000, ready_ns, began_ns, others_busy_ns }
    }

    #[test]
    fn a_tick_is_the_machines_if_nobody_else_was_busy_while_its_bridge_was_not_woken_up() {
        let told = |late: &LateTick| is_the_machines(late, &[core(&[], true)]);
        assert_eq!(told(&late(49_900_000, 1_900_000)), Some(true));
        assert_eq!(told(&late(49_900_000, 2_100_000)), Some(false));
        assert_eq!(told(&late(53_900_000, 0)), Some(false));
        assert_eq!(is_the_machines(&late(49_900_000, 0), &[core(&[], false)]), None);
    }

    #[test]
    fn a_tick_is_the_machines_if_a_core_stood_still_for_half_of_its_delay() {
        let late = late(53_900_000, 0);
        let told = |stalls: &[(u64, u64)]| is_the_machines(&late, &[core(&[], true), core(stalls, true)]);
        assert_eq!(told(&[(50_100_000, 53_900_000)]), Some(true));
        assert_eq!(told(&[(49_500_000, 52_000_000)]), Some(true));
        assert_eq!(told(&[(52_000_000, 53_000_000)]), Some(false));
        assert_eq!(told(&[(10_000_000, 12_000_000), (60_000_000, 65_000_000)]), Some(false));
        assert_eq!(told(&[]), Some(false));
        assert_eq!(is_the_machines(&late, &[core(&[(50_000_000, 54_000_000)], false)]), None);
    }

    #[test]
    fn every_core_is_watched() {
        let seen = idle(Duration::from_millis(20), None);
        assert_eq!(seen.len(), core_affinity::get_core_ids().unwrap_or_default().len());
        assert!(seen.iter().all(|core| core.count > 0 && !core.is_above_services), "{seen:?}");
    }
}
