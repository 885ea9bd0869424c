//! How the memory of processes grows with time.

use crate::process_status::ProcessStatus;
use mikoshi_runtime::Role;
use std::collections::BTreeMap;

/// Memory that every process of a run has of its own, sampled.
#[derive(Debug, Default)]
pub struct Memory {
    samples: BTreeMap<(Role, u32), Vec<Sample>>,
}

#[derive(Clone, Copy, Debug)]
struct Sample {
    seconds: f64,
    kib: f64,
}

/// Samples in the beginning of a process that tell nothing: pages are touched for the first time.
const WARM_UP: usize = 5;
/// Samples that a slope needs.
const LEAST_SAMPLES: usize = 10;

impl Memory {
    /// Takes note of what the process in this role occupies now.
    pub fn sample(&mut self, role: Role, pid: u32, seconds: f64) {
        if let Some(kib) = own_kib(pid) {
            self.samples.entry((role, pid)).or_default().push(Sample { seconds, kib });
        }
    }

    /// What each role's longest-lived process occupies in the end \[KiB\], and how fast that grows \[KiB/min\];
    /// roles without a process that lived long enough are left out.
    pub fn slopes(&self) -> Vec<(Role, f64, f64)> {
        let mut longest: BTreeMap<Role, &[Sample]> = BTreeMap::new();
        for ((role, _), samples) in &self.samples {
            let samples = samples.get(WARM_UP..).unwrap_or_default();
            let best = longest.entry(*role).or_default();
            if samples.len() > best.len() {
                *best = samples;
            }
        }
        let slopes = longest.into_iter().filter(|(_, samples)| samples.len() >= LEAST_SAMPLES);
        slopes.map(|(role, samples)| (role, samples[samples.len() - 1].kib, 60.0 * slope(samples))).collect()
    }
}

/// By least squares.
fn slope(samples: &[Sample]) -> f64 {
    let count = samples.len() as f64;
    let mean = |of: fn(&Sample) -> f64| samples.iter().map(of).sum::<f64>() / count;
    let (t, m) = (mean(|sample| sample.seconds), mean(|sample| sample.kib));
    let covariance: f64 = samples.iter().map(|sample| (sample.seconds - t) * (sample.kib - m)).sum();
    let variance: f64 = samples.iter().map(|sample| (sample.seconds - t).powi(2)).sum();
    if variance > 0.0 { covariance / variance } else { 0.0 }
}

/// What a process has that no other has and no file: its heap and stacks, in memory or swapped out. Pages of
/// programs and of shared memory come and go as the system likes.
fn own_kib(pid: u32) -> Option<f64> {
    let status = ProcessStatus::of(pid)?;
    Some((status.number("RssAnon")? + status.number("VmSwap")?) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_is_that_of_the_line() {
        let samples: Vec<_> =
            (0..50).map(|t| Sample { seconds: f64::from(t), kib: 100.0 + 0.5 * f64::from(t) }).collect();
        assert!((slope(&samples) - 0.5).abs() < 1e-12);
        assert_eq!(slope(&samples[..1]), 0.0);
    }

    #[test]
    fn this_process_occupies_something_and_one_that_is_gone_nothing() {
        assert!(own_kib(std::process::id()).is_some_and(|kib| kib > 100.0));
        assert_eq!(own_kib(u32::MAX), None);
    }

    #[test]
    fn a_process_that_lives_for_a_moment_says_nothing() {
        let mut memory = Memory::default();
        for second in 0..WARM_UP + LEAST_SAMPLES {
            assert_eq!(memory.slopes(), []);
            memory.sample(Role::Supervisor, std::process::id(), second as f64);
        }
        assert_eq!(memory.slopes().len(), 1);
    }
}
