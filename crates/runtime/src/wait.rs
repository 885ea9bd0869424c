//! Waiting for another process: yield for a while, then sleep on a futex in shared memory.

use core::sync::atomic::{AtomicU32, Ordering, fence};
use rustix::event::Timespec;
use rustix::thread::futex;
use std::time::{Duration, Instant};

/// How a process waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WaitPolicy {
    /// How long it gives way to others before it sleeps. While it does, it notices its input within a
    /// microsecond; a sleeper has to be woken, which costs the waker a system call and takes longer.
    pub yield_for: Duration,
}

impl Default for WaitPolicy {
    /// By `examples/empty_tick` (six processes on two cores, medians): an empty tick takes 31 us with
    /// any yielding from 20 us on, and 71 to 100 us without. Where there is work to do and others want
    /// the cores, longer yielding costs milliseconds at a time, since one that yields goes to the end of
    /// the queue, and one that is woken does not.
    fn default() -> Self {
        Self { yield_for: Duration::from_micros(20) }
    }
}

/// How long a sleeper sleeps before it looks whether those it waits for still live.
const SLEEP: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };

/// What a process sleeps for, by a number that waker and sleeper agree on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Reason(u32);

impl Reason {
    /// The state of another slot.
    pub(crate) const STATE: Self = Self(u32::MAX);
    /// The tap's progress.
    pub(crate) const CREDIT: Self = Self(u32::MAX - 1);

    /// The frame that the schedule lists at this place among its outputs.
    pub(crate) fn output(index: usize) -> Self {
        Self(index as u32 + 1)
    }
}

/// Where one process sleeps and others wake it. It lives in shared memory, on a cache line of its own:
/// in the common case wakers only read it, and find that nobody sleeps.
#[repr(C, align(64))]
pub(crate) struct Bed {
    /// Changes when the sleeper is woken: the futex.
    ticket: AtomicU32,
    /// The [`Reason`] it sleeps for; 0 while it is awake.
    reason: AtomicU32,
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
    /// each sleep `check` may end the wait.
    ///
    /// Nothing is lost: the reason is written before the last poll, and a waker reads it after what it
    /// wakes for is visible. Both are separated by sequentially consistent fences, so that the sleeper
    /// sees the event or the waker sees the sleeper.
    #[expect(clippy::disallowed_methods, reason = "how long to yield; no result depends on it")]
    pub(crate) fn wait<T, E>(
        &self,
        reason: Reason,
        policy: WaitPolicy,
        mut poll: impl FnMut() -> Result<Option<T>, E>,
        mut check: impl FnMut(Woken) -> Result<(), E>,
    ) -> Result<T, E> {
        if let Some(value) = poll()? {
            return Ok(value);
        }
        let start = Instant::now();
        while start.elapsed() < policy.yield_for {
            rustix::thread::sched_yield();
            if let Some(value) = poll()? {
                return Ok(value);
            }
        }
        loop {
            self.reason.store(reason.0, Ordering::Relaxed);
            fence(Ordering::SeqCst);
            let ticket = self.ticket.load(Ordering::Relaxed);
            let last_look = poll();
            let woken = if matches!(last_look, Ok(None)) { self.sleep(ticket) } else { Woken::Called };
            self.reason.store(0, Ordering::Relaxed);
            if let Some(value) = last_look? {
                return Ok(value);
            }
            if let Some(value) = poll()? {
                return Ok(value);
            }
            check(woken)?;
        }
    }

    /// Wakes the sleeper if it sleeps for this reason. What it is woken for has been written before.
    pub(crate) fn wake(&self, reason: Reason) {
        fence(Ordering::SeqCst);
        if self.reason.load(Ordering::Relaxed) == reason.0 {
            self.call();
        }
    }

    /// Wakes the sleeper, whatever it sleeps for.
    pub(crate) fn wake_anyway(&self) {
        fence(Ordering::SeqCst);
        if self.reason.load(Ordering::Relaxed) != 0 {
            self.call();
        }
    }

    /// Sleeps unless somebody has called since the ticket was drawn.
    fn sleep(&self, ticket: u32) -> Woken {
        match futex::wait(&self.ticket, futex::Flags::empty(), ticket, Some(&SLEEP)) {
            Err(rustix::io::Errno::TIMEDOUT) => Woken::TimedOut,
            _ => Woken::Called,
        }
    }

    fn call(&self) {
        self.ticket.fetch_add(1, Ordering::Relaxed);
        // Fails only for an address that is not mapped, and `self` is.
        let _ = futex::wake(&self.ticket, futex::Flags::empty(), 1);
    }
}
