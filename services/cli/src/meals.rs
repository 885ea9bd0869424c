//! How often the system is told that a supervisor does not hang, and how far it is.

use crate::wall_clock::Stopwatch;
use core::time::Duration;
use mikoshi_process::notify;

const INTERVAL: Duration = Duration::from_secs(1);

/// When it was told last.
pub struct Meals {
    since: Stopwatch,
}

impl Default for Meals {
    fn default() -> Self {
        Self { since: Stopwatch::start() }
    }
}

impl Meals {
    /// Tells it, if it is time to.
    pub fn serve(&mut self, status: impl FnOnce() -> String) {
        if self.since.elapsed() < INTERVAL {
            return;
        }
        self.since.lap();
        notify::feed_watchdog();
        notify::tell_status(&status());
    }
}
