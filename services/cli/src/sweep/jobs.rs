//! Runs as processes, several at once: started, watched, and never left behind.

use super::run_folder::RunFolder;
use crate::binaries;
use crate::children;
use crate::failure::{Failure, Status};
use crate::interrupts::Interrupts;
use crate::wall_clock::pause;
use core::time::Duration;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::fs;
use std::path::PathBuf;
use std::process::{Child, ExitStatus};

/// How often it is looked whether a run has ended.
const LOOK: Duration = Duration::from_millis(10);

/// Carries out runs, so many at once.
pub struct Jobs<'a> {
    count: usize,
    program: PathBuf,
    interrupts: &'a Interrupts,
    running: Vec<Job<'a>>,
}

struct Job<'a> {
    folder: &'a RunFolder,
    child: Child,
}

impl<'a> Jobs<'a> {
    /// `count` runs at once.
    ///
    /// # Errors
    /// The simulator is missing.
    pub fn new(count: usize, interrupts: &'a Interrupts) -> Result<Self, Failure> {
        binaries::simulator_version()?;
        Ok(Self { count, program: binaries::find(binaries::IN_PROCESS)?, interrupts, running: vec![] })
    }

    /// Carries out those runs that are not finished. All that were started have ended when it returns, and
    /// one that had to be ended leaves nothing.
    ///
    /// # Errors
    /// A signal; a run without a result.
    pub fn perform(mut self, folders: &[&'a RunFolder], is_shown: bool) -> Result<(), Failure> {
        let progress = progress(folders.len(), is_shown);
        let mut waiting = folders.iter().copied().filter(|folder| {
            let is_finished = folder.is_finished();
            progress.inc(u64::from(is_finished));
            !is_finished
        });
        loop {
            if let Some(signal) = self.interrupts.received() {
                // Clearing the bar moves it to its end.
                let finished = progress.position();
                progress.finish_and_clear();
                let message = format!(
                    "stopped after {finished} of {} runs: the same command goes on from there",
                    folders.len()
                );
                return Err(Failure { status: Status::Signal(signal), message });
            }
            while self.running.len() < self.count
                && let Some(folder) = waiting.next()
            {
                self.start(folder)?;
            }
            if self.running.is_empty() {
                progress.finish_and_clear();
                return Ok(());
            }
            progress.inc(self.look()?);
            pause(LOOK);
        }
    }

    fn start(&mut self, folder: &'a RunFolder) -> Result<(), Failure> {
        folder.make_parent()?;
        let child = children::start_run(folder.command(&self.program), &folder.errors())
            .map_err(|error| Failure::fault(error).context(&folder.label))?;
        self.running.push(Job { folder, child });
        Ok(())
    }

    /// Takes in the runs that have ended: how many.
    fn look(&mut self) -> Result<u64, Failure> {
        let mut ended = 0;
        let mut index = 0;
        while let Some(job) = self.running.get_mut(index) {
            match job.child.try_wait().map_err(Failure::fault)? {
                Some(status) => {
                    let job = self.running.swap_remove(index);
                    job.conclude(status)?;
                    ended += 1;
                }
                None => index += 1,
            }
        }
        Ok(ended)
    }
}

impl Job<'_> {
    /// A run that ends without a result, or with that of another run, ends the sweep.
    fn conclude(self, status: ExitStatus) -> Result<(), Failure> {
        if self.folder.is_finished() {
            return self.folder.tidy();
        }
        let told = fs::read(self.folder.errors()).unwrap_or_default();
        let told = String::from_utf8_lossy(&told).trim().to_owned();
        self.folder.discard();
        let status_of_ours = if status.code() == Some(2) { Status::Usage } else { Status::Fault };
        let message = match told.strip_prefix("error: ") {
            Some(told) => format!("{}: {told}", self.folder.label),
            None => format!("{}: {status}\n{told}", self.folder.label),
        };
        Err(Failure { status: status_of_ours, message })
    }
}

impl Drop for Jobs<'_> {
    fn drop(&mut self) {
        for job in &mut self.running {
            // It fails for a process that has just ended, which is what we want.
            let _ = job.child.kill();
            let _ = job.child.wait();
            job.folder.discard();
        }
    }
}

/// A bar where somebody looks.
fn progress(runs: usize, is_shown: bool) -> ProgressBar {
    let target = if is_shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let style = ProgressStyle::with_template("{bar:40} {pos} of {len} runs, {elapsed}, {eta} left");
    ProgressBar::with_draw_target(Some(runs as u64), target)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
