//! Wall-clock time: when ticks begin, and when their phases are due.

use crate::{Clock, Phase, Position, TickSchedule};
use mikoshi_ipc_types::ServiceId;
use rustix::time::{ClockId, Timespec, clock_gettime};

const NS_PER_S: u64 = 1_000_000_000;

/// How much longer inputs of the first ticks are waited for.
const START_PATIENCE_NS: u64 = NS_PER_S;

/// Nanoseconds on the machine's monotonic clock.
pub fn now_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * NS_PER_S + now.tv_nsec as u64
}

/// Sleeps until this time, and not at all if it has passed.
pub fn sleep_until(due_ns: u64) {
    let due = Timespec { tv_sec: (due_ns / NS_PER_S) as i64, tv_nsec: (due_ns % NS_PER_S) as i64 };
    while rustix::thread::clock_nanosleep_absolute(ClockId::Monotonic, &due) == Err(rustix::io::Errno::INTR) {
    }
}

/// Gives way to others until this time.
pub(crate) fn yield_until(due_ns: u64) {
    while now_ns() < due_ns {
        rustix::thread::sched_yield();
    }
}

/// By how much of a period a tick may be longer or shorter, for it to come nearer to the clock's.
const TRIM: f64 = 0.01;

/// When tick 0 is to have begun by the next tick, if it began at `own_ns` so far and by the clock of the team at
/// `master_ns`: nearer to that by a hundredth of a period at most. So no tick is skipped, and none is much longer or
/// shorter than another.
pub(crate) fn trimmed_origin_ns(own_ns: u64, master_ns: u64, period_ns: u64) -> u64 {
    let most_ns = (TRIM * period_ns as f64) as u64;
    let nearer = own_ns.clamp(master_ns.saturating_sub(most_ns), master_ns.saturating_add(most_ns));
    match own_ns.cmp(&master_ns) {
        _ if nearer == own_ns => master_ns,
        core::cmp::Ordering::Less => own_ns.saturating_add(most_ns),
        _ => own_ns.saturating_sub(most_ns),
    }
}

/// When the phases of one service are due.
#[derive(Clone, Debug)]
pub(crate) struct Pace {
    pub period_ns: u64,
    /// By phase, from the beginning of its tick; none where it waits for the tick itself.
    due_ns: Vec<Option<u64>>,
    /// In the ticks before, processes are still getting ready.
    first_usual_tick: u64,
}

impl Pace {
    /// Of this service; none in lockstep.
    pub fn of(schedule: &TickSchedule, service: ServiceId) -> Option<Self> {
        let Clock::Wall { period_ns } = schedule.clock() else { return None };
        let due_ns = |phase: &Phase| {
            // What opens the tick says when it is.
            let waits_for_others = phase.inputs.iter().any(|input| Some(input.from) != schedule.opener());
            waits_for_others.then(|| (schedule.latest_start(phase) * period_ns as f64) as u64)
        };
        let ages = schedule.phases().iter().flat_map(|phase| &phase.inputs).map(|input| input.age_ticks);
        Some(Self {
            period_ns,
            due_ns: schedule.phases_of(service).map(due_ns).collect(),
            first_usual_tick: ages.max().unwrap_or(0) + 1,
        })
    }

    /// When the inputs of this phase are due in a run whose tick 0 began at `origin_ns`.
    pub fn due_ns(&self, origin_ns: u64, at: Position) -> Option<u64> {
        let due_ns = self.due_ns.get(at.phase).copied().flatten()?;
        let patience_ns = if at.tick < self.first_usual_tick { START_PATIENCE_NS } else { 0 };
        Some(self.start_ns(origin_ns, at.tick).saturating_add(due_ns + patience_ns))
    }

    /// How many ticks behind the world its service may be when all is well.
    pub fn lag_ticks(&self) -> u64 {
        self.due_ns.iter().flatten().max().unwrap_or(&0) / self.period_ns.max(1)
    }

    /// When this tick begins.
    pub fn start_ns(&self, origin_ns: u64, tick: u64) -> u64 {
        origin_ns.saturating_add(tick.saturating_mul(self.period_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Placement;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn ticks_come_nearer_to_the_clock_by_a_hundredth_at_most_and_none_is_skipped(
            own_ns in 1_u64..1 << 62,
            master_ns in 1_u64..1 << 62,
            period_ns in 100_u64..1 << 40,
        ) {
            let trimmed = trimmed_origin_ns(own_ns, master_ns, period_ns);
            let most_ns = period_ns / 100;
            prop_assert!(trimmed.abs_diff(own_ns) <= most_ns);
            let (before, after) = (own_ns.abs_diff(master_ns), trimmed.abs_diff(master_ns));
            prop_assert_eq!(after, before.saturating_sub(most_ns));
        }

        #[test]
        fn whatever_the_clocks_drift_within_a_hundredth_they_meet_and_stay_together(
            start in -50_i64..50,
            drift_ppm in -5000_i64..5000,
        ) {
            const PERIOD_NS: u64 = 5_000_000;
            let (mut own, mut master) = (1_u64 << 40, (1_i64 << 40) + start * PERIOD_NS as i64 / 100);
            for _ in 0..400 {
                master += drift_ppm * PERIOD_NS as i64 / 1_000_000;
                own = trimmed_origin_ns(own, master as u64, PERIOD_NS);
            }
            prop_assert!(own.abs_diff(master as u64) <= PERIOD_NS / 100);
        }
    }

    const PERIOD_NS: u64 = 5_000_000;

    fn pace_of(service: ServiceId) -> Pace {
        let schedule = TickSchedule::of_team(2, 1, &Placement::default()).expect("a valid team");
        let schedule = schedule.with_clock(Clock::Wall { period_ns: PERIOD_NS });
        Pace::of(&schedule, service).expect("it is paced")
    }

    #[test]
    fn in_lockstep_nothing_is_due() {
        let schedule = TickSchedule::of_team(2, 1, &Placement::default()).expect("a valid team");
        assert!(Pace::of(&schedule, ServiceId::Bridge).is_none());
    }

    #[test]
    fn phases_are_due_a_share_of_the_period_after_their_tick_began() {
        let at = |phase| Position { tick: 10, phase };
        let begun_ns = 7 + 10 * PERIOD_NS;
        let bridge = pace_of(ServiceId::Bridge);
        assert_eq!(bridge.start_ns(7, 10), begun_ns);
        assert_eq!(bridge.due_ns(7, at(0)), None);
        assert_eq!(bridge.due_ns(7, at(1)), Some(begun_ns + PERIOD_NS / 2));
        let servo = pace_of(ServiceId::Servo(1));
        assert_eq!(servo.due_ns(7, at(0)), None, "the sensors are the tick");
        assert_eq!(servo.due_ns(7, at(1)), Some(begun_ns + PERIOD_NS / 4));
    }

    #[test]
    fn inputs_of_the_first_ticks_may_take_a_second_more() {
        let bridge = pace_of(ServiceId::Bridge);
        let due = |tick| bridge.due_ns(0, Position { tick, phase: 1 });
        let usual = |tick| tick * PERIOD_NS + PERIOD_NS / 2;
        let expected = [usual(0) + START_PATIENCE_NS, usual(1) + START_PATIENCE_NS, usual(2)];
        assert_eq!([due(0), due(1), due(2)], expected.map(Some));
    }
}
