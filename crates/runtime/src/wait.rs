//! Waiting for another process: yield for a while, then sleep on a futex in shared memory.

use crate::pace::now_ns;
use crate::watch::Watch;
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

/// Cores that have a place of their own in every bed; any more share them.
pub(crate) const PLACES: usize = 8;

/// Where processes sleep until somebody calls, each in the place of its core. It lives in shared memory, on a cache line
/// of its own: in the common case callers only read it, and find that nobody sleeps.
///
/// Any number may sleep in it, and one call wakes all. Whoever dies or is frozen in it leaves nothing behind but a call
/// that nobody hears: it is the caller who notes that nobody sleeps any more.
#[cfg_attr(test, derive(Default))]
#[repr(C, align(64))]
pub(crate) struct Bed {
    places: [Place; PLACES],
}

/// Where those sleep who have gone to sleep on one core.
#[cfg_attr(test, derive(Default))]
#[repr(C)]
struct Place {
    /// Changes with every call: the futex.
    ticket: AtomicU32,
    /// Whether somebody may sleep.
    guests: AtomicU32,
}

/// Of [`Place::guests`].
const NOBODY: u32 = 0;
const ASLEEP: u32 = 1;
/// Somebody sleeps, and it is left to the [`Watch`] of that core to wake them.
const CALLED: u32 = 2;

/// In so much time a watch that is awake has found out that it was told. Woken by the caller itself, on another core than
/// its own, they cost it several times as much.
const TELLING_NS: u64 = 2_000;

/// Whoever looks at its watch so much too late did not run, and perhaps nobody could.
const OVERSLEPT_NS: u64 = 500_000;
/// What is then still waited for.
const GRACE_NS: u64 = 2_000_000;

/// How often a process gives way before it looks at its watch again.
const YIELDS_A_LOOK: u32 = 4;

/// What is done once in a wait.
pub(crate) struct Meanwhile<F> {
    /// Whether it first gives way, for as long as it yields at all.
    pub lets_others_go_first: bool,
    pub work: F,
}

impl Meanwhile<fn()> {
    pub const NOTHING: Self = Self { lets_others_go_first: false, work: || () };
}

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
    /// `meanwhile` is done once if there is a wait at all: after whoever shares the core had a turn, or before the first
    /// sleep. What comes during it is found after it: it is polled before anybody gives way or sleeps.
    ///
    /// Nothing is lost: that somebody sleeps is noted before the last poll, and a caller reads it after what it
    /// calls for is visible. Both are separated by sequential consistency, so that the sleeper sees the event or
    /// the caller sees the sleeper.
    pub(crate) fn wait<T, E>(
        &self,
        policy: WaitPolicy,
        due_ns: Option<u64>,
        mut poll: impl FnMut() -> Result<Option<T>, E>,
        meanwhile: Meanwhile<impl FnOnce()>,
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
        if meanwhile.lets_others_go_first && time_ns < end_ns && !patience.is_over(time_ns) {
            rustix::thread::sched_yield();
            if let Some(value) = poll()? {
                return Ok(Some(value));
            }
        }
        (meanwhile.work)();
        while time_ns < end_ns && !patience.is_over(time_ns) {
            for _ in 0..YIELDS_A_LOOK {
                if let Some(value) = poll()? {
                    return Ok(Some(value));
                }
                rustix::thread::sched_yield();
            }
            time_ns = now_ns();
        }
        while !patience.is_over(time_ns) {
            let place = &self.places[place_of(rustix::thread::sched_getcpu())];
            let ticket = place.take();
            if let Some(value) = poll()? {
                return Ok(Some(value));
            }
            let woken = place.sleep(ticket, patience.left_ns(time_ns).min(SLEEP_NS));
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
        self.places.iter().for_each(Place::call);
    }

    /// Whether anybody may sleep: if not, who comes looks for itself what was written before this was asked, sequentially
    /// consistent with it.
    pub(crate) fn has_guests(&self) -> bool {
        self.places.iter().any(Place::has_guests)
    }

    /// As [`Bed::call`], but those who sleep on other cores are left to the watches there, as far as somebody keeps them,
    /// who are told in which slot to look.
    pub(crate) fn call_by(&self, watches: &[Watch; PLACES], slot: usize) {
        if !self.has_guests() {
            return;
        }
        if self.leave_to_watches(place_of(rustix::thread::sched_getcpu()), watches, slot) {
            let until_ns = now_ns().saturating_add(TELLING_NS);
            while self.places.iter().any(Place::is_left_to_watch) && now_ns() < until_ns {
                core::hint::spin_loop();
            }
        }
        // Whoever sleeps on this core, where nobody keeps watch, or where something else runs than the watch.
        self.call();
    }

    /// Leaves those who sleep in other places than this to whoever keeps watch there. Whether there is anybody.
    fn leave_to_watches(&self, own: usize, watches: &[Watch; PLACES], slot: usize) -> bool {
        let mut is_left = false;
        for (index, (place, watch)) in self.places.iter().zip(watches).enumerate() {
            if index != own && watch.is_kept() && place.leave_to_watch() {
                watch.tell(slot);
                is_left = true;
            }
        }
        is_left
    }

    /// Wakes those who are left to the watch of this core.
    pub(crate) fn answer(&self, core: usize) {
        self.places[place_of(core)].answer();
    }

    /// As [`Bed::call`], for what was written in whatever order.
    pub(crate) fn call_after_fence(&self) {
        fence(Ordering::SeqCst);
        self.call();
    }

    /// Wakes all who sleep, though a caller may have been killed after it had noted that nobody does.
    pub(crate) fn call_whoever_sleeps(&self) {
        self.places.iter().for_each(Place::wake);
    }
}

/// The place of this core in every bed, and its watch's among all.
pub(crate) fn place_of(core: usize) -> usize {
    core % PLACES
}

impl Place {
    /// Says that somebody is about to sleep. Nothing is lost if what it waits for is looked at once more before it does.
    fn take(&self) -> u32 {
        let ticket = self.ticket.load(Ordering::Acquire);
        // Who is left to the watch is not to be forgotten: it calls this guest, too.
        let _ = self.guests.compare_exchange(NOBODY, ASLEEP, Ordering::SeqCst, Ordering::SeqCst);
        fence(Ordering::SeqCst);
        ticket
    }

    fn has_guests(&self) -> bool {
        self.guests.load(Ordering::SeqCst) != NOBODY
    }

    fn call(&self) {
        if self.has_guests() && self.guests.swap(NOBODY, Ordering::SeqCst) != NOBODY {
            self.wake();
        }
    }

    /// Whether it has done so: nobody else is about to call.
    fn leave_to_watch(&self) -> bool {
        self.guests.compare_exchange(ASLEEP, CALLED, Ordering::SeqCst, Ordering::SeqCst).is_ok()
    }

    fn is_left_to_watch(&self) -> bool {
        self.guests.load(Ordering::SeqCst) == CALLED
    }

    fn answer(&self) {
        if self.guests.compare_exchange(CALLED, NOBODY, Ordering::SeqCst, Ordering::SeqCst).is_ok() {
            self.wake();
        }
    }

    fn wake(&self) {
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
        let bed = Bed::default();
        let looks = AtomicU32::new(0);
        let policy = WaitPolicy { yield_for: Duration::ZERO, up_early: Duration::ZERO };
        std::thread::scope(|scope| {
            let sleeper = || {
                let poll = || {
                    looks.fetch_add(1, Ordering::SeqCst);
                    Ok(None::<()>)
                };
                // What woke it ends its wait.
                bed.wait(policy, None, poll, Meanwhile::NOTHING, Err).expect_err("there is nothing")
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

    /// As if somebody kept them.
    fn watches() -> [Watch; PLACES] {
        let watches: [Watch; PLACES] = Default::default();
        watches.iter().for_each(Watch::keep);
        watches
    }

    /// Calls from a core on which nobody sleeps.
    fn call_from_elsewhere(bed: &Bed, watches: &[Watch; PLACES]) {
        bed.leave_to_watches(PLACES, watches, 0);
        bed.call();
    }

    /// How often a wait polled before the work that is done in it, if it was; what it finds is there from poll `found_at`
    /// on, or from the work on.
    fn polls_before_work(yield_for: Duration, lets_others_go_first: bool, found_at: u32) -> Option<u32> {
        let (polls, worked_after) = (AtomicU32::new(0), AtomicU32::new(0));
        let poll = || {
            let is_there = polls.fetch_add(1, Ordering::Relaxed) == found_at;
            Ok((is_there || worked_after.load(Ordering::Relaxed) > 0).then_some(()))
        };
        let work = || worked_after.store(polls.load(Ordering::Relaxed), Ordering::Relaxed);
        let meanwhile = Meanwhile { lets_others_go_first, work };
        let policy = WaitPolicy { yield_for, up_early: Duration::ZERO };
        // Nobody sleeps: what came during the work is found after it.
        assert_eq!(Bed::default().wait(policy, None, poll, meanwhile, Err), Ok(Some(())));
        Some(worked_after.into_inner()).filter(|polls| *polls > 0)
    }

    #[test]
    fn what_is_done_meanwhile_is_done_by_who_waits_and_what_comes_during_it_is_found() {
        const LONG: Duration = Duration::from_secs(60);
        for yield_for in [Duration::ZERO, LONG] {
            for lets_others_go_first in [false, true] {
                assert_eq!(polls_before_work(yield_for, lets_others_go_first, 0), None);
            }
        }
        assert_eq!(polls_before_work(LONG, false, 1), Some(1));
        assert_eq!(polls_before_work(LONG, true, 1), None, "others went first, and it came");
        assert_eq!(polls_before_work(LONG, true, 2), Some(2));
        assert_eq!(
            polls_before_work(Duration::ZERO, true, 9),
            Some(1),
            "who does not yield gives way to nobody"
        );
    }

    #[test]
    fn one_call_wakes_all_who_sleep() {
        assert_eq!(woken_by(3, Bed::call_after_fence), [Woken::Called; 3]);
    }

    #[test]
    fn a_sleeper_is_called_also_if_a_caller_was_killed_before_it_woke_anybody() {
        let was_killed =
            |bed: &Bed| bed.places.iter().for_each(|place| place.guests.store(NOBODY, Ordering::SeqCst));
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
    fn who_keeps_watch_wakes_those_who_are_left_to_it() {
        let woken = woken_by(3, |bed| {
            let (watches, is_over) = (&watches(), &AtomicU32::new(0));
            std::thread::scope(|scope| {
                scope.spawn(move || {
                    while is_over.load(Ordering::SeqCst) == 0 {
                        let told = watches.iter().any(|watch| watch.ask() & 1 != 0);
                        (0..PLACES).filter(|_| told).for_each(|core| bed.answer(core));
                        std::hint::spin_loop();
                    }
                });
                call_from_elsewhere(bed, watches);
                is_over.store(1, Ordering::SeqCst);
            });
        });
        assert_eq!(woken, [Woken::Called; 3]);
    }

    #[test]
    fn who_is_left_to_a_watch_that_does_not_answer_is_woken_by_the_caller() {
        assert_eq!(woken_by(3, |bed| call_from_elsewhere(bed, &watches())), [Woken::Called; 3]);
    }

    #[test]
    fn a_watch_answers_alone_for_whom_no_caller_wakes() {
        let woken = woken_by(1, |bed| {
            let watches = watches();
            bed.leave_to_watches(PLACES, &watches, 70);
            let told = watches.iter().fold(0, |told, watch| told | watch.ask());
            assert_eq!(told, 1 << 6, "slot 70 is slot 6 to them");
            (0..PLACES).for_each(|core| bed.answer(core));
        });
        assert_eq!(woken, [Woken::Called]);
    }

    #[test]
    fn a_guest_who_comes_while_others_are_left_to_the_watch_does_not_keep_them_asleep() {
        let place = Place::default();
        let first = place.take();
        assert!(place.leave_to_watch());
        let second = place.take();
        assert!(place.is_left_to_watch(), "the newcomer has taken the call away");
        place.answer();
        for ticket in [first, second] {
            assert_eq!(place.sleep(ticket, 60_000 * MS), Woken::Called, "it slept though it had been called");
        }
    }

    /// The places whose guests are left to a watch by a caller on this core, of a bed with guests in all.
    fn left_by_caller_on(own: usize, watches: &[Watch; PLACES]) -> Vec<usize> {
        let bed = Bed::default();
        for place in &bed.places {
            place.take();
        }
        bed.leave_to_watches(own, watches, 0);
        (0..PLACES).filter(|index| bed.places[*index].is_left_to_watch()).collect()
    }

    #[test]
    fn guests_are_left_to_watches_that_are_kept_on_other_cores() {
        assert_eq!(left_by_caller_on(0, &Default::default()), [0; 0]);
        assert_eq!(left_by_caller_on(3, &watches()), [0, 1, 2, 4, 5, 6, 7]);
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
