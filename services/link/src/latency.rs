//! How long frames are on their way.

use core::sync::atomic::{AtomicU64, Ordering};
use hdrhistogram::Histogram;
use serde::Serialize;

/// A distribution of times, of a fixed size.
pub struct Latencies(Histogram<u64>);

/// Longer than any frame is of use.
const LONGEST_NS: u64 = 60_000_000_000;

impl Default for Latencies {
    fn default() -> Self {
        Self(Histogram::new_with_bounds(1000, LONGEST_NS, 3).expect("these are bounds"))
    }
}

/// What is shown of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct Quantiles {
    pub count: u64,
    pub p50_s: f64,
    pub p99_s: f64,
    pub p999_s: f64,
    pub max_s: f64,
}

impl Latencies {
    /// One more.
    pub fn note(&mut self, ns: u64) {
        self.0.saturating_record(ns);
    }

    /// Its quantiles, if there is anything.
    pub fn quantiles(&self) -> Option<Quantiles> {
        let at = |quantile| self.0.value_at_quantile(quantile) as f64 / 1e9;
        (!self.0.is_empty()).then(|| Quantiles {
            count: self.0.len(),
            p50_s: at(0.5),
            p99_s: at(0.99),
            p999_s: at(0.999),
            max_s: self.0.max() as f64 / 1e9,
        })
    }
}

/// The least age of a team command that 999 of 1000 reach: of one that answers, after this time, what a robot said.
pub fn fitting_delay_ticks(round_trip: &Quantiles, period_s: f64) -> u64 {
    (round_trip.p999_s / period_s).ceil().max(1.0) as u64
}

/// When the frames of the last ticks were sent.
pub struct SentTimes([(AtomicU64, AtomicU64); 64]);

impl Default for SentTimes {
    fn default() -> Self {
        Self(core::array::from_fn(|_| (AtomicU64::new(u64::MAX), AtomicU64::new(0))))
    }
}

impl SentTimes {
    /// The frame of this tick was sent.
    pub fn note(&self, tick: u64, now_ns: u64) {
        let (of_tick, sent_ns) = &self.0[tick as usize % self.0.len()];
        of_tick.store(u64::MAX, Ordering::Release);
        sent_ns.store(now_ns, Ordering::Release);
        of_tick.store(tick, Ordering::Release);
    }

    /// How long ago that was, if it is known.
    pub fn since(&self, tick: u64, now_ns: u64) -> Option<u64> {
        let (of_tick, sent_ns) = &self.0[tick as usize % self.0.len()];
        let sent_ns = sent_ns.load(Ordering::Acquire);
        (of_tick.load(Ordering::Acquire) == tick).then(|| now_ns.saturating_sub(sent_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_what_was_noted() {
        let mut latencies = Latencies::default();
        assert_eq!(latencies.quantiles(), None);
        (1..=1000).for_each(|us| latencies.note(us * 1000));
        let found = latencies.quantiles().expect("there is something");
        let expected =
            [(found.p50_s, 500e-6), (found.p99_s, 990e-6), (found.p999_s, 999e-6), (found.max_s, 1e-3)];
        for (found, expected) in expected {
            assert!((found - expected).abs() < 2e-3 * expected, "{found} instead of {expected}");
        }
    }

    #[test]
    fn the_delay_is_that_in_which_999_of_1000_come_back() {
        let after = |p999_s| Quantiles { count: 1, p50_s: 0.0, p99_s: 0.0, p999_s, max_s: 1.0 };
        let delays = [0.0005, 0.005, 0.0051, 0.0249].map(|s| fitting_delay_ticks(&after(s), 0.005));
        assert_eq!(delays, [1, 1, 2, 5]);
    }

    #[test]
    fn what_was_sent_long_ago_is_forgotten() {
        let sent = SentTimes::default();
        assert_eq!(sent.since(0, 5), None);
        sent.note(0, 5);
        sent.note(1, 10);
        assert_eq!((sent.since(0, 12), sent.since(1, 12)), (Some(7), Some(2)));
        sent.note(64, 20);
        assert_eq!((sent.since(0, 30), sent.since(64, 30)), (None, Some(10)));
    }
}
