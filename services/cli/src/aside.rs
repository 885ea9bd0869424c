//! Out of the way of those who keep time.

use mikoshi_config::scenario::Placement;
use rustix::process::nice;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

/// How much less this process counts than others.
const NICE: i32 = 10;

/// Leaves the run's cores to it, if there are others, and any core to whoever wants it. Threads that are started from
/// now on do so, too. What is not granted is no reason not to show anything.
pub fn step_aside(placement: &Placement) {
    let _ = nice(NICE);
    let Ok(all) = sched_getaffinity(None) else { return };
    let spare = spare_cores(&all, placement);
    if spare.count() > 0 {
        let _ = sched_setaffinity(None, &spare);
    }
}

fn spare_cores(all: &CpuSet, placement: &Placement) -> CpuSet {
    let mut spare = *all;
    let taken = placement.bridge_core.iter().chain(&placement.coordinator_core).chain(&placement.servo_cores);
    for &core in taken.filter(|core| **core < CpuSet::MAX_CPU) {
        spare.unset(core);
    }
    spare
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cores(cores: &[usize]) -> CpuSet {
        let mut set = CpuSet::new();
        cores.iter().for_each(|core| set.set(*core));
        set
    }

    #[test]
    fn cores_of_services_are_left_to_them() {
        let placement = Placement {
            bridge_core: Some(0),
            coordinator_core: Some(9999),
            servo_cores: vec![1, 1],
            ..Placement::default()
        };
        assert_eq!(spare_cores(&cores(&[0, 1, 2, 3]), &placement), cores(&[2, 3]));
        assert_eq!(spare_cores(&cores(&[0, 1]), &placement).count(), 0);
        assert_eq!(spare_cores(&cores(&[0, 1]), &Placement::default()), cores(&[0, 1]));
    }
}
