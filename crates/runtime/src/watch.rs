//! Who keeps a core awake wakes those who sleep there.
//!
//! To wake somebody on another core takes an interrupt there. In a virtual machine the caller alone spends 17 µs on it,
//! and the sleeper runs after 22 µs; woken by a thread that runs on its own core, it does after 4 µs.

use crate::Board;
use crate::board::Slot;
use crate::wait::{Bed, place_of};
use core::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// Of one core. On a cache line of its own: whoever keeps it looks at it all the time.
#[cfg_attr(test, derive(Default))]
#[repr(C, align(64))]
pub(crate) struct Watch {
    /// Not 0 if somebody keeps it, now and then: only while nobody else wants to run there.
    is_kept: AtomicU32,
    /// Bit i: slot i, or one that has as much over 64, has a bed in which somebody was called.
    told: AtomicU64,
}

impl Watch {
    /// Says that somebody keeps it.
    pub(crate) fn keep(&self) {
        self.is_kept.store(1, Ordering::Relaxed);
    }

    pub(crate) fn is_kept(&self) -> bool {
        self.is_kept.load(Ordering::Relaxed) != 0
    }

    /// Says that somebody was called in a bed of this slot.
    pub(crate) fn tell(&self, slot: usize) {
        self.told.fetch_or(1 << (slot % 64), Ordering::SeqCst);
    }

    /// Of which slots it was told since this was asked last.
    pub(crate) fn ask(&self) -> u64 {
        match self.told.load(Ordering::Acquire) {
            0 => 0,
            _ => self.told.swap(0, Ordering::SeqCst),
        }
    }
}

impl Board {
    /// Wakes everybody who sleeps in a bed of this slot; `bed` says in which.
    pub(crate) fn call(&self, slot: usize, bed: impl FnOnce(&Slot) -> &Bed) {
        if let Some(of_slot) = self.slots().get(slot) {
            bed(of_slot).call_by(self.watches(), slot);
        }
    }

    /// Keeps the watch of this core for ever. The calling thread is to run there, and only while nobody else wants to.
    pub fn keep_watch(&self, core: usize) -> ! {
        let watch = &self.watches()[place_of(core)];
        watch.keep();
        loop {
            self.answer(watch.ask(), core);
            core::hint::spin_loop();
        }
    }

    fn answer(&self, told: u64, core: usize) {
        let slots = self.slots().iter().enumerate();
        for (_, slot) in slots.filter(|(index, _)| told >> (index % 64) & 1 != 0) {
            slot.beds().for_each(|bed| bed.answer(core));
        }
    }
}
