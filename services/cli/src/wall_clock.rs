//! The wall clock: for speed, which people read, and for patience with processes. Nothing that a run
//! computes depends on it.

use core::time::Duration;
use std::time::Instant;

/// Runs from its making.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    start: Instant,
}

impl Stopwatch {
    /// Starts from zero.
    #[expect(clippy::disallowed_methods, reason = "read by supervisors and people, never by a tick")]
    pub fn start() -> Self {
        Self { start: Instant::now() }
    }

    /// What it shows; it starts again from zero.
    pub fn lap(&mut self) -> Duration {
        let elapsed = self.elapsed();
        *self = Self::start();
        elapsed
    }

    /// What it shows.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }
}

/// Leaves the processor to others for a while.
#[expect(clippy::disallowed_methods, reason = "looks after processes, of which none waits for it")]
pub fn pause(duration: Duration) {
    std::thread::sleep(duration);
}
