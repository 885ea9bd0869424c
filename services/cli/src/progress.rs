//! A bar with simulated time and speed, where somebody looks.

use crate::wall_clock::Stopwatch;
use core::time::Duration;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Redraws this often: the eye sees no more, and a terminal may be slow.
const REFRESH_HZ: u8 = 10;

/// How far a run has come. Draws nothing where standard error is no terminal.
pub struct Progress {
    bar: ProgressBar,
    clock: Stopwatch,
    period_s: f64,
    sim_time_s: f64,
}

impl Progress {
    /// For a run of this many ticks.
    pub fn new(ticks: u64, period_s: f64, is_shown: bool) -> Self {
        let target = match is_shown {
            true => ProgressDrawTarget::stderr_with_hz(REFRESH_HZ),
            false => ProgressDrawTarget::hidden(),
        };
        let style =
            ProgressStyle::with_template("{bar:40} {msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::with_draw_target(Some(ticks), target).with_style(style);
        bar.set_message("starting");
        bar.tick();
        Self { bar, clock: Stopwatch::start(), period_s, sim_time_s: ticks as f64 * period_s }
    }

    /// This many ticks are done.
    pub fn set_ticks(&self, ticks: u64) {
        if self.bar.is_hidden() {
            return;
        }
        let (sim_time_s, wall_time) = (ticks as f64 * self.period_s, self.clock.elapsed());
        // A speed over less than this is noise.
        let speed =
            if wall_time < Duration::from_millis(200) { 0.0 } else { sim_time_s / wall_time.as_secs_f64() };
        self.bar.set_message(format!("{sim_time_s:.1} of {:.1} s, {speed:.1} × real time", self.sim_time_s));
        self.bar.set_position(ticks);
    }

    /// Nothing of it remains on the screen.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}
