//! The service processes of a run: started, watched, ended, and never left behind.

use crate::binaries;
use crate::failure::Failure;
use crate::wall_clock::{Stopwatch, pause};
use core::time::Duration;
use mikoshi_ipc_types::ServiceId;
use rustix::process::{Pid, Signal, getpid, getppid, set_parent_process_death_signal};
use std::fs::{self, File};
use std::io;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};

/// How long processes get to end by themselves.
const GRACE: Duration = Duration::from_secs(2);
/// How often it is looked whether they have.
const LOOK: Duration = Duration::from_millis(2);
/// Last words of a process that are shown when it failed.
const LAST_LINES: usize = 12;

/// One service process.
pub struct ServiceProcess {
    /// Which service.
    pub service: ServiceId,
    /// What people call it: `bridge`, `servo of robot A`.
    pub label: String,
    /// How it ended, once it has.
    pub ended: Option<Ended>,
    child: Child,
    log: PathBuf,
}

/// How a process ended.
#[derive(Clone, Copy, Debug)]
pub struct Ended {
    /// By itself or by a signal.
    pub status: ExitStatus,
    /// Whether the signal was ours, since it would not end.
    pub by_us: bool,
}

/// The service processes of a run. Dropping them ends them.
#[derive(Default)]
pub struct Children {
    processes: Vec<ServiceProcess>,
}

impl Children {
    /// Starts a service of the run in `run_directory`, which people call `label`; what it says goes to a
    /// file in `logs`.
    ///
    /// # Errors
    /// Its program is missing or can't be started.
    pub fn spawn(
        &mut self,
        service: ServiceId,
        label: String,
        robot: Option<&str>,
        run_directory: &Path,
        logs: &Path,
    ) -> Result<(), Failure> {
        let program = binaries::find(binaries::name_of(service))?;
        let file_name = match robot {
            Some(robot) => format!("servo-{robot}.log"),
            None => format!("{service}.log"),
        };
        let log = logs.join(file_name);
        let mut command = Command::new(&program);
        command.arg("--run").arg(run_directory);
        if let Some(robot) = robot {
            command.args(["--robot", robot]);
        }
        let child = start(command, &log)
            .map_err(|error| Failure::fault(error).context(format_args!("{label}: {}", program.display())))?;
        self.processes.push(ServiceProcess { service, label, ended: None, child, log });
        Ok(())
    }

    /// All processes.
    pub fn processes(&self) -> &[ServiceProcess] {
        &self.processes
    }

    /// Looks which have ended; whether any of them ended otherwise than with success.
    pub fn look(&mut self) -> bool {
        let mut has_failed = false;
        for process in &mut self.processes {
            if process.ended.is_none()
                && let Ok(Some(status)) = process.child.try_wait()
            {
                process.ended = Some(Ended { status, by_us: false });
            }
            has_failed |= process.ended.is_some_and(|ended| !ended.status.success());
        }
        has_failed
    }

    /// Kills these: they are frozen, and would not end by themselves.
    pub fn kill_frozen(&mut self, services: &[ServiceId]) {
        for process in self.processes.iter_mut().filter(|process| services.contains(&process.service)) {
            process.kill();
        }
    }

    /// Waits until all have ended, and kills those that have not after a while.
    pub fn end(&mut self) {
        let since_asked = Stopwatch::start();
        loop {
            self.look();
            if self.processes.iter().all(|process| process.ended.is_some()) {
                return;
            }
            if since_asked.elapsed() > GRACE {
                break;
            }
            pause(LOOK);
        }
        self.kill();
    }

    fn kill(&mut self) {
        for process in &mut self.processes {
            process.kill();
        }
    }
}

impl Drop for Children {
    fn drop(&mut self) {
        self.kill();
    }
}

impl ServiceProcess {
    fn kill(&mut self) {
        if self.ended.is_none() {
            // It fails for a process that has just ended, which is what we want.
            let _ = self.child.kill();
            self.ended = self.child.wait().ok().map(|status| Ended { status, by_us: true });
        }
    }

    /// The last lines that it wrote, indented; empty if it said nothing.
    pub fn last_words(&self) -> String {
        let text = fs::read(&self.log).map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        let text = text.unwrap_or_default();
        let lines: Vec<_> = text.lines().filter(|line| !line.trim().is_empty()).collect();
        let last = &lines[lines.len().saturating_sub(LAST_LINES)..];
        last.iter().flat_map(|line| ["\n  ", line]).collect()
    }
}

/// Starts a process whose every word goes to a file, and which dies with the thread that calls this.
pub(crate) fn start(mut command: Command, log: &Path) -> io::Result<Child> {
    let log = File::create(log)?;
    command.stdin(Stdio::null()).stdout(log.try_clone()?).stderr(log);
    // A Ctrl-C at the terminal is for the supervisor, who ends all in order.
    command.process_group(0);
    let parent = getpid();
    // SAFETY: between fork and exec the closure only makes two system calls on plain values: it neither
    // allocates nor takes a lock.
    unsafe { command.pre_exec(move || die_with(parent)) };
    command.spawn()
}

/// Services notice on the board that their supervisor is gone. This is for those that no longer look.
fn die_with(parent: Pid) -> io::Result<()> {
    set_parent_process_death_signal(Some(Signal::KILL))?;
    // It may have died before.
    match getppid() == Some(parent) {
        true => Ok(()),
        false => Err(rustix::io::Errno::SRCH.into()),
    }
}
