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

/// Where processes sleep until somebody calls. It lives in shared memory, on a cache line of its own: in the common
/// case callers only read it, and find that nobody sleeps.
///
/// Any number may sleep in it, and one call wakes all. Whoever dies or is frozen in it leaves nothing behind but a call
/// that nobody hears: it is the caller who notes that nobody sleeps any more.
#[repr(C, align(64))]
pub(crate) struct Bed {
    /// Changes with every call: the futex.
    ticket: AtomicU32,
    /// Not 0 if somebody may sleep.
    is_taken: AtomicU32,
}

/// Whoever looks at its watch so much too late did not run, and perhaps nobody could.
const OVERSLEPT_NS: u64 = 500_000;
/// What is then still waited for.
const GRACE_NS: u64 = 2_000_000;

/// How often a process gives way before it looks at its watch again.
const YIELDS_A_LOOK: u32 = 4;

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
    /// Nothing is lost: that somebody sleeps is written before the last poll, and a caller reads it after what it
    /// calls for is visible. Both are separated by sequential consistency, so that the sleeper sees the event or
    /// the caller sees the sleeper.
    pub(crate) fn wait<T, E>(
        &self,
        policy: WaitPolicy,
        due_ns: Option<u64>,
        mut poll: impl FnMut() -> Result<Option<T>, E>,
        mut check: impl FnMut(Woken) -> Result<(), E>,
    ) -> Result<Option<T>, E> {
        if let Some(value) = poll()? {
            return Ok(Some(value));
        }
        // In the common case it is over before anybody has to know what time it is.
        let start_ns = if due_ns.is_some() || !policy.yield_for.is_zero() { now_ns() } else { 0 };
        let mut patience = Patience::until(due_ns, start_ns);
        let end_ns = start_ns.saturating_add(policy.yield_for.as_nanos() as u64);
        let mut time_ns = start_ns;
        while time_ns < end_ns && !patience.is_over(time_ns) {
            for _ in 0..YIELDS_A_LOOK {
                rustix::thread::sched_yield();
                if let Some(value) = poll()? {
                    return Ok(Some(value));
                }
            }
            time_ns = now_ns();
        }
        while !patience.is_over(time_ns) {
            let ticket = self.ticket.load(Ordering::Acquire);
            self.is_taken.store(1, Ordering::Relaxed);
            fence(Ordering::SeqCst);
            if let Some(value) = poll()? {
                return Ok(Some(value));
            }
            let woken = self.sleep(ticket, patience.left_ns(time_ns).min(SLEEP_NS));
            if let Some(value) = poll()? {
                return Ok(Some(value));
            }
            check(woken)?;
            time_ns = now_ns();
        }
        Ok(None)
    }

    /// Wakes all who sleep. What they are woken for has been written before, sequentially consistent with what follows.
    pub(crate) fn call(&self) {
        if self.is_taken.load(Ordering::SeqCst) != 0 && self.is_taken.swap(0, Ordering::SeqCst) != 0 {
            self.call_whoever_sleeps();
        }
    }

    /// As [`Bed::call`], for what was written in whatever order.
    pub(crate) fn call_after_fence(&self) {
        fence(Ordering::SeqCst);
        self.call();
    }

    /// Wakes all who sleep, though a caller may have been killed after it had noted that nobody does.
    pub(crate) fn call_whoever_sleeps(&self) {
        self.ticket.fetch_add(1, Ordering::SeqCst);
        // Fails only for an address that is not mapped, and `self` is.
        let _ = futex::wake(&self.ticket, futex::Flags::empty(), u32::MAX >> 1);
    }

    /// Sleeps unless somebody has called since the ticket was drawn.
    fn sleep(&self, ticket: u32, at_most_ns: u64) -> Woken {
        let at_most = Timespec { tv_sec: 0, tv_nsec: at_most_ns as i64 };
        match futex::wait(&self.ticket, futex::Flags::empty(), ticket, Some(&at_most)) {
            Err(rustix::io::Errno::TIMEDOUT) => Woken::TimedOut,
            _ => Woken::Called,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// Lets so many sleep in one bed, and calls once when they do. Returns what woke each.
    fn woken_by(sleepers: usize, call: impl FnOnce(&Bed)) -> Vec<Woken> {
        let bed = Bed { ticket: AtomicU32::new(0), is_taken: AtomicU32::new(0) };
        let looks = AtomicU32::new(0);
        let policy = WaitPolicy { yield_for: Duration::ZERO, up_early: Duration::ZERO };
        std::thread::scope(|scope| {
            let sleeper = || {
                let poll = || {
                    looks.fetch_add(1, Ordering::SeqCst);
                    Ok(None::<()>)
                };
                // What woke it ends its wait.
                bed.wait(policy, None, poll, Err).expect_err("there is nothing")
            };
            let threads: Vec<_> = (0..sleepers).map(|_| scope.spawn(sleeper)).collect();
            // Each looks twice before it sleeps.
            while looks.load(Ordering::SeqCst) < 2 * sleepers as u32 {
                std::thread::yield_now();
            }
            call(&bed);
            threads.into_iter().map(|thread| thread.join().expect("it ends")).collect()
        })
    }

    #[test]
    fn one_call_wakes_all_who_sleep() {
        assert_eq!(woken_by(3, Bed::call_after_fence), [Woken::Called; 3]);
    }

    #[test]
    fn a_sleeper_is_called_also_if_a_caller_was_killed_before_it_woke_anybody() {
        let was_killed = |bed: &Bed| bed.is_taken.store(0, Ordering::SeqCst);
        let woken = woken_by(1, |bed| {
            was_killed(bed);
            bed.call_whoever_sleeps();
        });
        assert_eq!(woken, [Woken::Called]);
        let woken = woken_by(1, |bed| {
            was_killed(bed);
            bed.call();
        });
        assert_eq!(woken, [Woken::TimedOut], "who sleeps was noted to be awake");
    }

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
