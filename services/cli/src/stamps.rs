//! How long ticks took.

use core::time::Duration;
use hdrhistogram::Histogram;
use mikoshi_config::scenario::Clock;
use mikoshi_observation::{Timing, times_ns};

/// A tick is late if it took more than so many periods.
const LATE: f64 = 1.1;

/// When ticks began, by the bridge's clock. What it occupies does not grow with the run.
pub struct Stamps {
    late_ns: f64,
    ticks_late: u64,
    last_ns: Option<u64>,
    periods_ns: Histogram<u64>,
}

impl Stamps {
    /// Of ticks that are to take so long. In lockstep nothing is late.
    pub fn new(clock: Clock, period_s: f64) -> Self {
        let late_ns = match clock {
            Clock::Lockstep => f64::INFINITY,
            Clock::Wall => LATE * period_s * 1e9,
        };
        Self { late_ns, ticks_late: 0, last_ns: None, periods_ns: times_ns() }
    }

    /// Takes in when a tick began.
    pub fn observe(&mut self, stamp_ns: u64) {
        if let Some(last_ns) = self.last_ns.replace(stamp_ns) {
            let period_ns = stamp_ns.saturating_sub(last_ns);
            self.ticks_late += u64::from(period_ns as f64 > self.late_ns);
            self.periods_ns.saturating_record(period_ns);
        }
    }

    /// What it came to: all zero where no clock was read.
    pub fn timing(&self) -> Timing {
        let quantile = |share| Duration::from_nanos(self.periods_ns.value_at_quantile(share)).as_secs_f64();
        Timing {
            tick_p50_s: quantile(0.5),
            tick_p99_s: quantile(0.99),
            ticks_late: self.ticks_late,
            ..Timing::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_periods_between_stamps() {
        let mut stamps = Stamps::new(Clock::Wall, 90.5e-3);
        let mut stamp_ns = 1_000;
        stamps.observe(stamp_ns);
        for period_ms in (1..=100).rev() {
            stamp_ns += 1_000_000 * period_ms;
            stamps.observe(stamp_ns);
        }
        let timing = stamps.timing();
        assert!((timing.tick_p50_s - 50e-3).abs() < 50e-6, "{timing:?}");
        assert!((timing.tick_p99_s - 99e-3).abs() < 99e-6, "{timing:?}");
        assert_eq!(timing.ticks_late, 1, "one took more than a tenth longer than its period");
    }

    #[test]
    fn in_lockstep_nothing_is_late_and_without_a_clock_nothing_took_time() {
        let mut stamps = Stamps::new(Clock::Lockstep, 0.005);
        for stamp_ns in [0, 0, 0] {
            stamps.observe(stamp_ns);
        }
        assert_eq!(stamps.timing(), Timing::default());
        stamps.observe(u64::MAX);
        assert_eq!(stamps.timing().ticks_late, 0);
    }
}
