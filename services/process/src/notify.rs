//! What the system that has started a process is told of it: that it is ready, how far it is, and that its loop
//! turns. Where nobody listens, nothing happens.
//!
//! A thread beside the service's says so, and a tick does nothing for it but count. A service that hangs in a phase
//! no longer counts, nor does a frozen one; one that waits for others does, and so does a team that was stopped.

use core::time::Duration;
use sd_notify::NotifyState;
use std::env;
use std::thread;

/// How often it is told how far a service is, where nobody watches over it.
const USUAL_INTERVAL: Duration = Duration::from_secs(1);
/// How often a watchdog is fed in the time that it waits.
const MEALS: u32 = 4;

/// Says that the process is ready, in words too.
pub fn tell_ready(status: &str) {
    // Nobody waits for it, or it can't be told: the service goes on.
    let _ = sd_notify::notify(&[NotifyState::Ready, NotifyState::Status(status)]);
}

/// Says how far the process is.
pub fn tell_status(status: &str) {
    let _ = sd_notify::notify(&[NotifyState::Status(status)]);
}

/// Says that the process does not hang.
pub fn feed_watchdog() {
    let _ = sd_notify::notify(&[NotifyState::Watchdog]);
}

/// From now on, as long as `beats` changes, a thread feeds the watchdog and says the status.
pub fn keep_told(beats: impl Fn() -> u64 + Send + 'static, status: impl Fn() -> String + Send + 'static) {
    if env::var_os("NOTIFY_SOCKET").is_none() {
        return;
    }
    let interval = sd_notify::watchdog_enabled().map_or(USUAL_INTERVAL, |patience| patience / MEALS);
    thread::spawn(move || {
        let mut heart = Heart::default();
        loop {
            pause(interval);
            if heart.has_beaten(beats()) {
                feed_watchdog();
                tell_status(&status());
            }
        }
    });
}

#[expect(clippy::disallowed_methods, reason = "beside the service, of which no tick waits for it")]
fn pause(interval: Duration) {
    thread::sleep(interval);
}

/// Whether a count has changed.
#[derive(Debug, Default)]
struct Heart {
    last: Option<u64>,
}

impl Heart {
    fn has_beaten(&mut self, beats: u64) -> bool {
        self.last.replace(beats) != Some(beats)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_service_that_no_longer_counts_is_not_said_to_live() {
        let mut heart = Heart::default();
        let told: Vec<_> = [0, 1, 1, 1, 2].into_iter().map(|beats| heart.has_beaten(beats)).collect();
        assert_eq!(told, [true, true, false, false, true]);
    }
}
