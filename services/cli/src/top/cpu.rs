//! How busy processes are, by what the system counts.

use crate::wall_clock::Stopwatch;
use rustix::param::clock_ticks_per_second;
use std::collections::BTreeMap;
use std::fs;

/// The system counts in hundredths of a second: over less than this, shares would be coarse.
const LEAST_S: f64 = 0.5;

/// Shares of a core, from one look to the next.
pub struct CpuShares {
    since: Stopwatch,
    used_s: BTreeMap<u32, f64>,
    shares: BTreeMap<u32, f64>,
}

impl CpuShares {
    /// Nothing known yet.
    pub fn new() -> Self {
        Self { since: Stopwatch::start(), used_s: BTreeMap::new(), shares: BTreeMap::new() }
    }

    /// Looks at these processes, unless it has done so just now.
    pub fn look(&mut self, pids: impl Iterator<Item = u32>) {
        let took_s = self.since.elapsed().as_secs_f64();
        if took_s < LEAST_S && !self.used_s.is_empty() {
            return;
        }
        self.since.lap();
        let used_s: BTreeMap<_, _> = pids.filter_map(|pid| Some((pid, used_s(pid)?))).collect();
        let share = |(pid, now_s): (&u32, &f64)| {
            let before_s = self.used_s.get(pid)?;
            Some((*pid, (now_s - before_s) / took_s))
        };
        self.shares = used_s.iter().filter_map(share).collect();
        self.used_s = used_s;
    }

    /// How much of one core this process took; none where it was not seen twice.
    pub fn of(&self, pid: u32) -> Option<f64> {
        self.shares.get(&pid).copied()
    }
}

/// What a process has used so far; none if it is gone.
fn used_s(pid: u32) -> Option<f64> {
    ticks_in(&fs::read_to_string(format!("/proc/{pid}/stat")).ok()?)
        .map(|ticks| ticks as f64 / clock_ticks_per_second() as f64)
}

/// User's and system's time in a line of `/proc/PID/stat`. Its second field is a name, which may hold anything.
fn ticks_in(line: &str) -> Option<u64> {
    let (_, behind_name) = line.rsplit_once(')')?;
    let mut fields = behind_name.split_ascii_whitespace().skip(11);
    let mut next = || fields.next()?.parse::<u64>().ok();
    Some(next()? + next()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_found_behind_whatever_name_a_process_has() {
        let line = "7 (a ) 1 (b) S 1 7 7 0 -1 4194560 10 0 0 0 25 17 0 0 20 0 1 0 100 0 0";
        assert_eq!(ticks_in(line), Some(42));
        assert_eq!(ticks_in("7 (a) S 1"), None);
    }
}
