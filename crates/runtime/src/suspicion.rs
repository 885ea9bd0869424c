//! Whether who is in charge of a service is frozen, as its standby sees it in one look after another.

use crate::schedule::Position;

/// How long a service must be behind the world before its standby takes its place, in ticks and in time.
const PATIENCE_TICKS: u64 = 2;
const PATIENCE_NS: u64 = 10_000_000;
/// How often a standby looks, at most.
pub(crate) const LEAST_LOOK_NS: u64 = 2_000_000;

/// What a standby holds of who is in charge.
///
/// A core that stalls has both stand still, and either may run first afterwards. So one that lags is only suspected,
/// and frozen if it is still there at the next look.
#[derive(Debug)]
pub(crate) struct Suspicion {
    period_ns: u64,
    patience_ticks: u64,
    /// Where it was when it lagged.
    lagged_at: Option<Position>,
}

impl Suspicion {
    /// Of one whose ticks take so long, and whose work in a tick is due so many ticks later.
    pub(crate) fn new(period_ns: u64, lag_ticks: u64) -> Self {
        let patience_ticks = PATIENCE_NS.div_ceil(period_ns.max(1)).max(PATIENCE_TICKS) + lag_ticks;
        Self { period_ns, patience_ticks, lagged_at: None }
    }

    /// In how many nanoseconds to look again.
    pub(crate) fn next_look_ns(&self) -> u64 {
        let look_ns = if self.lagged_at.is_some() { 0 } else { self.period_ns / 2 };
        look_ns.max(LEAST_LOOK_NS)
    }

    /// Whether it is frozen that is in this tick and phase while the world is in that.
    pub(crate) fn is_confirmed(&mut self, at: Position, world: Position) -> bool {
        let lags = world.tick >= at.tick.saturating_add(self.patience_ticks);
        let before = core::mem::replace(&mut self.lagged_at, lags.then_some(at));
        lags && before == Some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: u64 = 5_000_000;

    fn tick(tick: u64) -> Position {
        Position { tick, phase: 1 }
    }

    #[test]
    fn one_that_stays_where_it_lagged_is_frozen_at_the_second_look() {
        let mut suspicion = Suspicion::new(PERIOD_NS, 0);
        assert!(!suspicion.is_confirmed(tick(7), tick(8)));
        assert_eq!(suspicion.next_look_ns(), PERIOD_NS / 2);
        assert!(!suspicion.is_confirmed(tick(7), tick(9)));
        assert_eq!(suspicion.next_look_ns(), LEAST_LOOK_NS);
        assert!(suspicion.is_confirmed(tick(7), tick(9)));
    }

    #[test]
    fn one_that_has_moved_since_is_not_even_if_it_lags_again() {
        let mut suspicion = Suspicion::new(PERIOD_NS, 0);
        assert!(!suspicion.is_confirmed(tick(7), tick(20)));
        assert!(!suspicion.is_confirmed(tick(8), tick(21)));
        assert!(!suspicion.is_confirmed(Position { tick: 8, phase: 2 }, tick(21)));
        assert!(suspicion.is_confirmed(Position { tick: 8, phase: 2 }, tick(21)));
    }

    #[test]
    fn what_came_up_in_between_is_suspected_anew() {
        let mut suspicion = Suspicion::new(PERIOD_NS, 0);
        assert!(!suspicion.is_confirmed(tick(7), tick(9)));
        assert!(!suspicion.is_confirmed(tick(9), tick(9)));
        assert!(!suspicion.is_confirmed(tick(9), tick(11)));
    }

    #[test]
    fn patience_is_ten_milliseconds_and_as_late_as_work_is_due() {
        let lags_from = |period_ns, lag_ticks| {
            let looks_frozen = |world: &u64| {
                let mut suspicion = Suspicion::new(period_ns, lag_ticks);
                suspicion.is_confirmed(tick(0), tick(*world));
                suspicion.is_confirmed(tick(0), tick(*world))
            };
            (0..100).find(looks_frozen)
        };
        assert_eq!(lags_from(PERIOD_NS, 0), Some(2));
        assert_eq!(lags_from(1_000_000, 0), Some(10));
        assert_eq!(lags_from(20_000_000, 3), Some(5));
    }
}
