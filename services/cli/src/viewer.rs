//! The viewer beside a run: a process that nobody waits for once the run has begun.

use crate::binaries;
use crate::children::end_with_this_thread;
use crate::failure::{Failure, Status};
use crate::interrupts::Interrupts;
use crate::print::print_error;
use crate::wall_clock::pause;
use core::time::Duration;
use rustix::process::Signal;
use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};

const LOOK: Duration = Duration::from_millis(20);

/// A page that shows a run. Dropping it ends it.
pub struct Viewer {
    process: Child,
    page: String,
}

impl Viewer {
    /// Opens the page of the run in this directory, which must have been described, and says where it is.
    ///
    /// # Errors
    /// The program is missing, or has no page to show.
    pub fn open(run: &Path) -> Result<Self, Failure> {
        let program = binaries::find_viewer()?;
        let mut command = Command::new(&program);
        command.args(["view", "--web"]).arg(run.file_name().unwrap_or_default());
        command.stdin(Stdio::null()).stdout(Stdio::piped());
        // Ctrl-C is for the run: its page stays until that has ended.
        command.process_group(0);
        end_with_this_thread(&mut command, Signal::TERM);
        let failed = |error| Failure::fault(error).context(program.display());
        let mut process = command.spawn().map_err(failed)?;
        let mut page = String::new();
        // It has nothing else to say there.
        if let Some(said) = process.stdout.take() {
            BufReader::new(said).read_line(&mut page).map_err(failed)?;
        }
        let viewer = Self { process, page: page.trim().to_owned() };
        if viewer.page.is_empty() {
            let message = "the viewer has no page to show: see above".to_owned();
            return Err(Failure { status: Status::Fault, message });
        }
        print_error(&format!("viewer: {}\n", viewer.page));
        Ok(viewer)
    }

    /// Leaves the page to those who look at it, until somebody interrupts or it ends.
    ///
    /// # Errors
    /// The operating system does not let interrupts be heard.
    pub fn stay(mut self) -> Result<(), Failure> {
        let interrupts = Interrupts::listen().map_err(Failure::fault)?;
        print_error(&format!("viewer: {} stays until Ctrl-C\n", self.page));
        while interrupts.received().is_none() && matches!(self.process.try_wait(), Ok(None)) {
            pause(LOOK);
        }
        Ok(())
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
