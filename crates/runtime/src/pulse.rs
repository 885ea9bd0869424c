//! Whether the loop of this process's service still turns.
//!
//! It beats with every phase that begins, and in every wait: who waits for others is not the one that hangs.

use core::sync::atomic::{AtomicU64, Ordering};

static BEATS: AtomicU64 = AtomicU64::new(0);

/// Says that the service gets on, or waits as it should.
pub(crate) fn beat() {
    BEATS.fetch_add(1, Ordering::Relaxed);
}

/// How often it has said so: a number that stands still where the service hangs.
pub fn beats() -> u64 {
    BEATS.load(Ordering::Relaxed)
}
