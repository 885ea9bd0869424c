//! Waiting for another process: yield for a while, then sleep on a futex in shared memory.

use crate::pace::now_ns;
use core::sync::atomic::{AtomicU32, Ordering, fence};
use rustix::event::Timespec;
use rustix::thread::futex;
use std::time::Duration;

/// How a process waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WaitPolicy {
    /// How long it gives way to others before it sleeps. While it does, it notices its input within a
    /// microsecond; a sleeper has to be woken, which costs the waker a system call and takes longer.
    pub yield_for: Duration,
    /// How long before a tick is due it stops sleeping: a core that is asleep itself takes tens of microseconds
    /// to wake up, and now and then hundreds.
    pub up_early: Duration,
}

impl Default for WaitPolicy {
    /// By `mikoshi latency --empty` (six processes on two cores, medians): an empty tick takes 31 us with
    /// any yielding from 20 us on, and 71 to 100 us without. Where there is work to do and others want
    /// the cores, longer yielding costs milliseconds at a time, since one that yields goes to the end of
    /// the queue, and one that is woken does not.
    fn default() -> Self {
        Self { yield_for: Duration::from_micros(20), up_early: Duration::from_micros(100) }
    }
}

/// How long a sleeper sleeps before it looks whether those it waits for still live.
const SLEEP_NS: u64 = 100_000_000;

/// What a process sleeps for, by a number that waker and sleeper agree on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Reason(u16);

impl Reason {
    /// The state of another slot.
    pub(crate) const STATE: Self = Self(u16::MAX);
    /// The tap's progress.
    pub(crate) const CREDIT: Self = Self(u16::MAX - 1);

    /// The frame that the schedule lists at this place among its outputs.
    pub(crate) fn output(index: usize) -> Self {
        Self(index as u16 + 1)
    }
}

/// Who sleeps, and what for: a process that lost its place must not be taken for its successor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sleeper {
    pub reason: Reason,
    /// Its incarnation.
    pub epoch: u64,
}

impl Sleeper {
    fn to_word(self) -> u32 {
        (self.epoch as u32) << u16::BITS | u32::from(self.reason.0)
    }
}

/// Where one process sleeps and others wake it. It lives in shared memory, on a cache line of its own:
/// in the common case wakers only read it, and find that nobody sleeps.
#[repr(C, align(64))]
pub(crate) struct Bed {
    /// Changes when the sleeper is woken: the futex.
    ticket: AtomicU32,
    /// The [`Sleeper`]; 0 while it is awake.
    sleeper: AtomicU32,
}

/// Whoever looks at its watch so much too late did not run, and perhaps nobody could.
const OVERSLEPT_NS: u64 = 500_000;
/// What is then still waited for.
const GRACE_NS: u64 = 2_000_000;

/// Until when something is waited for.
struct Patience {
    due_ns: Option<u64>,
    /// When it was looked last.
    looked_ns: u64,
    has_grace: bool,
}

impl Patience {
    fn until(due_ns: Option<u64>, now_ns: u64) -> Self {
        Self { due_ns, looked_ns: now_ns, has_grace: true }
    }

    /// Whether it is over. If between two looks nobody may have run, it lasts a little longer, once.
    fn is_over(&mut self, now_ns: u64) -> bool {
        let Some(due_ns) = self.due_ns else { return false };
        let was_early = core::mem::replace(&mut self.looked_ns, now_ns) < due_ns;
        if was_early && now_ns > due_ns.saturating_add(OVERSLEPT_NS) && core::mem::take(&mut self.has_grace) {
            self.due_ns = Some(now_ns.saturating_add(GRACE_NS));
            return false;
        }
        now_ns >= due_ns
    }

    fn left_ns(&self, now_ns: u64) -> u64 {
        self.due_ns.map_or(u64::MAX, |due_ns| due_ns.saturating_sub(now_ns))
    }
}

/// Why a sleep ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Woken {
    /// Somebody called, or may have.
    Called,
    /// Nobody did for the longest time that a process sleeps.
    TimedOut,
}

impl Bed {
    /// Polls until it returns something: at first giving way to others, then sleeping in between. After
    /// each sleep `check` may end the wait. At `due_ns`, if there is such a time, it ends with nothing.
    ///
    /// Nothing is lost: the reason is written before the last poll, and a waker reads it after what it
    /// wakes for is visible. Both are separated by sequentially consistent fences, so that the sleeper
    /// sees the event or the waker sees the sleeper.
    pub(crate) fn wait<T, E>(
        &self,
        sleeper: Sleeper,
        policy: WaitPolicy,
        due_ns: Option<u64>,
        mut poll: impl FnMut() -> Result<Option<T>, E>,
        mut check: impl FnMut(Woken) -> Result<(), E>,
    ) -> Result<Option<T>, E> {
        if let Some(value) = poll()? {
            return Ok(Some(value));
        }
        let start_ns = now_ns();
        let mut patience = Patience::until(due_ns, start_ns);
        let end_ns = start_ns.saturating_add(policy.yield_for.as_nanos() as u64);
        let mut time_ns = start_ns;
        while time_ns < end_ns && !patience.is_over(time_ns) {
            rustix::thread::sched_yield();
            if let Some(value) = poll()? {
                return Ok(Some(value));
            }
            time_ns = now_ns();
        }
        let word = sleeper.to_word();
        while !patience.is_over(time_ns) {
            self.sleeper.store(word, Ordering::Relaxed);
            fence(Ordering::SeqCst);
            let ticket = self.ticket.load(Ordering::Relaxed);
            let last_look = poll();
            let left_ns = patience.left_ns(now_ns()).min(SLEEP_NS);
            let woken =
                if matches!(last_look, Ok(None)) { self.sleep(ticket, left_ns) } else { Woken::Called };
            // By now it may be another one's.
            let _ = self.sleeper.compare_exchange(word, 0, Ordering::Relaxed, Ordering::Relaxed);
            if let Some(value) = last_look? {
                return Ok(Some(value));
            }
            if let Some(value) = poll()? {
                return Ok(Some(value));
            }
            check(woken)?;
            time_ns = now_ns();
        }
        Ok(None)
    }

    /// Wakes the sleeper if it sleeps for this reason. What it is woken for has been written before.
    pub(crate) fn wake(&self, reason: Reason) {
        fence(Ordering::SeqCst);
        if self.sleeper.load(Ordering::Relaxed) as u16 == reason.0 {
            self.call();
        }
    }

    /// Wakes the sleeper, whatever it sleeps for.
    pub(crate) fn wake_anyway(&self) {
        fence(Ordering::SeqCst);
        if self.sleeper.load(Ordering::Relaxed) != 0 {
            self.call();
        }
    }

    /// Sleeps unless somebody has called since the ticket was drawn.
    fn sleep(&self, ticket: u32, at_most_ns: u64) -> Woken {
        let at_most = Timespec { tv_sec: 0, tv_nsec: at_most_ns as i64 };
        match futex::wait(&self.ticket, futex::Flags::empty(), ticket, Some(&at_most)) {
            Err(rustix::io::Errno::TIMEDOUT) => Woken::TimedOut,
            _ => Woken::Called,
        }
    }

    fn call(&self) {
        self.ticket.fetch_add(1, Ordering::Relaxed);
        // Fails only for an address that is not mapped, and `self` is.
        let _ = futex::wake(&self.ticket, futex::Flags::empty(), u32::MAX >> 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn patience_ends_when_it_is_due() {
        let mut patience = Patience::until(Some(10 * MS), 0);
        assert!(!patience.is_over(10 * MS - 1));
        assert!(patience.is_over(10 * MS));
        assert!(Patience::until(Some(10 * MS), 11 * MS).is_over(11 * MS), "it was over when it began");
        assert!(!Patience::until(None, 0).is_over(u64::MAX));
    }

    #[test]
    fn who_overslept_waits_a_little_longer_once() {
        let mut patience = Patience::until(Some(10 * MS), 0);
        assert!(!patience.is_over(17 * MS));
        assert_eq!(patience.left_ns(18 * MS), MS);
        assert!(!patience.is_over(18 * MS));
        assert!(patience.is_over(30 * MS));
    }
}
