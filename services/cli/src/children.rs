//! The service processes of a run: started, watched, ended, and never left behind.

use crate::binaries;
use crate::failure::Failure;
use crate::wall_clock::{Stopwatch, pause};
use core::time::Duration;
use mikoshi_ipc_types::ServiceId;
use rustix::process::{Pid, Signal, getpid, getppid, set_parent_process_death_signal};
use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};

/// How long processes get to end by themselves.
const GRACE: Duration = Duration::from_secs(2);
/// How often it is looked whether they have.
const LOOK: Duration = Duration::from_millis(2);
/// How long a process that was taken over from may live on: it may wake up, and end by itself.
const FENCED_GRACE: Duration = Duration::from_secs(1);
/// Last words of a process that are shown when it failed.
const LAST_LINES: usize = 12;

/// One service process.
pub struct ServiceProcess {
    /// Which service.
    pub service: ServiceId,
    /// What people call it: `bridge`, `servo of robot A`.
    pub label: String,
    /// The robot that it controls.
    robot: Option<String>,
    /// What its successors take over, too.
    variant: Variant,
    /// How it ended, once it has.
    pub ended: Option<Ended>,
    child: Child,
    log: PathBuf,
}

/// In what a process differs from the others of its kind.
#[derive(Clone, Debug, Default)]
pub struct Variant {
    /// Its description of the run.
    pub spec: Option<PathBuf>,
    /// Its program.
    pub program: Option<PathBuf>,
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
pub struct Children {
    run_directory: PathBuf,
    logs: PathBuf,
    processes: Vec<ServiceProcess>,
    /// Successors of processes that are still in charge.
    candidates: Vec<ServiceProcess>,
    /// Those that take over by themselves.
    standbys: Vec<ServiceProcess>,
    /// Those that were taken over from while they lived, and since when.
    fenced: Vec<(ServiceProcess, Stopwatch)>,
}

impl Children {
    /// None yet. What they say goes to files in `logs`.
    pub fn of(run_directory: &Path, logs: &Path) -> Self {
        let (run_directory, logs) = (run_directory.to_owned(), logs.to_owned());
        Self { run_directory, logs, processes: vec![], candidates: vec![], standbys: vec![], fenced: vec![] }
    }

    /// Starts a service, which people call `label`.
    ///
    /// # Errors
    /// Its program is missing or can't be started.
    pub fn spawn(&mut self, service: ServiceId, label: String, robot: Option<&str>) -> Result<(), Failure> {
        let robot = robot.map(str::to_owned);
        let process = self.start(service, label, robot, Variant::default(), &[])?;
        self.processes.push(process);
        Ok(())
    }

    /// Starts the successor of a process that has ended.
    ///
    /// # Errors
    /// As [`Children::spawn`].
    pub fn succeed(&mut self, service: ServiceId) -> Result<(), Failure> {
        let Some(index) = self.processes.iter().position(|process| process.service == service) else {
            return Ok(());
        };
        let ServiceProcess { label, robot, variant, .. } = &self.processes[index];
        self.processes[index] = self.start(service, label.clone(), robot.clone(), variant.clone(), &[])?;
        Ok(())
    }

    /// Starts a process that is to take the place of one that is in charge.
    ///
    /// # Errors
    /// As [`Children::spawn`].
    pub fn nominate(&mut self, service: ServiceId, variant: Variant) -> Result<(), Failure> {
        let candidate = self.start_beside(service, variant, "--replace")?;
        self.candidates.extend(candidate);
        Ok(())
    }

    /// Starts a process that takes this service's place when whoever is in charge is lost or falls behind.
    ///
    /// # Errors
    /// As [`Children::spawn`].
    pub fn stand_by(&mut self, service: ServiceId) -> Result<(), Failure> {
        let standby = self.start_beside(service, self.variant(service), "--standby")?;
        self.standbys.extend(standby);
        Ok(())
    }

    /// Starts a second process of a service, which is told by `entry` when it is to take over.
    fn start_beside(
        &self,
        service: ServiceId,
        variant: Variant,
        entry: &str,
    ) -> Result<Option<ServiceProcess>, Failure> {
        let process = self.processes.iter().find(|process| process.service == service);
        process
            .map(|ServiceProcess { label, robot, .. }| {
                self.start(service, label.clone(), robot.clone(), variant, &[OsStr::new(entry)])
            })
            .transpose()
    }

    /// Whether a standby of this service lives.
    pub fn has_standby(&self, service: ServiceId) -> bool {
        self.standbys.iter().any(|standby| standby.service == service && standby.ended.is_none())
    }

    /// Takes note of standbys that are in charge by now, as `in_charge` says by service and process id; returns
    /// which, and why.
    pub fn note_promotions(
        &mut self,
        in_charge: impl Fn(ServiceId) -> Option<u32>,
    ) -> Vec<(ServiceId, String)> {
        let mut promotions = Vec::new();
        let is_promoted =
            |standby: &mut ServiceProcess| in_charge(standby.service) == Some(standby.child.id());
        for standby in self.standbys.extract_if(.., is_promoted) {
            let service = standby.service;
            let process = self.processes.iter_mut().find(|process| process.service == service);
            let Some(process) = process else { continue };
            let mut predecessor = core::mem::replace(process, standby);
            let cause = match predecessor.look().map(|ended| ended.status) {
                Some(status) => match status.signal() {
                    Some(signal) => format!("killed by signal {signal}"),
                    // Who was fenced ends well.
                    None if status.success() => "fell behind".to_owned(),
                    None => "failed".to_owned(),
                },
                None => "fell behind".to_owned(),
            };
            // Of those before it nobody expects anything any more, and their places are needed.
            for (other, _) in self.fenced.iter_mut().filter(|(other, _)| other.service == service) {
                other.kill();
            }
            self.fenced.push((predecessor, Stopwatch::start()));
            promotions.push((service, cause));
        }
        promotions
    }

    /// Standbys that have ended, though the run goes on.
    pub fn lost_standbys(&mut self) -> Vec<ServiceId> {
        let lost = self.standbys.extract_if(.., |standby| standby.look().is_some());
        lost.map(|standby| standby.service).collect()
    }

    /// Ends those that were taken over from, once they had time to notice.
    fn bury_fenced(&mut self) {
        for (process, since_fenced) in &mut self.fenced {
            if process.look().is_none() && since_fenced.elapsed() > FENCED_GRACE {
                process.kill();
            }
        }
        self.fenced.retain(|(process, _)| process.ended.is_none());
    }

    /// What sets this service's process apart.
    pub fn variant(&self, service: ServiceId) -> Variant {
        let process = self.processes.iter().find(|process| process.service == service);
        process.map(|process| process.variant.clone()).unwrap_or_default()
    }

    /// The successor of this service that is on its way.
    pub fn candidate(&self, service: ServiceId) -> Option<&ServiceProcess> {
        self.candidates.iter().find(|process| process.service == service)
    }

    /// The candidate is in charge: its predecessor, which ends by itself, is forgotten once it has.
    pub fn promote(&mut self, service: ServiceId) {
        let candidate = self.candidates.iter().position(|process| process.service == service);
        let predecessor = self.processes.iter_mut().find(|process| process.service == service);
        if let (Some(candidate), Some(predecessor)) = (candidate, predecessor) {
            let mut retired = core::mem::replace(predecessor, self.candidates.swap_remove(candidate));
            let since_promoted = Stopwatch::start();
            while retired.look().is_none() && since_promoted.elapsed() < GRACE {
                pause(LOOK);
            }
            retired.kill();
        }
    }

    /// The candidate will not be in charge.
    pub fn dismiss(&mut self, service: ServiceId) {
        for process in self.candidates.iter_mut().filter(|process| process.service == service) {
            process.kill();
        }
        self.candidates.retain(|process| process.service != service);
    }

    fn start(
        &self,
        service: ServiceId,
        label: String,
        robot: Option<String>,
        variant: Variant,
        arguments: &[&OsStr],
    ) -> Result<ServiceProcess, Failure> {
        let program = match &variant.program {
            Some(program) => program.clone(),
            None => binaries::find(binaries::name_of(service))?,
        };
        let file_name = match &robot {
            Some(robot) => format!("servo-{robot}.log"),
            None => format!("{service}.log"),
        };
        let log = self.logs.join(file_name);
        let mut command = Command::new(&program);
        command.arg("--run").arg(&self.run_directory).args(arguments);
        if let Some(robot) = &robot {
            command.args(["--robot", robot]);
        }
        if let Some(spec) = &variant.spec {
            command.arg("--spec").arg(spec);
        }
        // After what its predecessors said.
        let log_file = OpenOptions::new().create(true).append(true).open(&log);
        let child = log_file
            .and_then(|log_file| start_with(command, log_file))
            .map_err(|error| Failure::fault(error).context(format_args!("{label}: {}", program.display())))?;
        Ok(ServiceProcess { service, label, robot, variant, ended: None, child, log })
    }

    /// All processes.
    pub fn processes(&self) -> &[ServiceProcess] {
        &self.processes
    }

    /// Looks which have ended; whether any of them ended otherwise than with success.
    pub fn look(&mut self) -> bool {
        self.bury_fenced();
        for candidate in &mut self.candidates {
            candidate.look();
        }
        self.processes.iter_mut().fold(false, |has_failed, process| {
            has_failed | process.look().is_some_and(|ended| !ended.status.success())
        })
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
            for standby in &mut self.standbys {
                standby.look();
            }
            let all = || self.processes.iter().chain(&self.candidates).chain(&self.standbys);
            if all().all(|process| process.ended.is_some()) {
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
        let fenced = self.fenced.iter_mut().map(|(process, _)| process);
        let waiting = self.candidates.iter_mut().chain(&mut self.standbys);
        for process in self.processes.iter_mut().chain(waiting).chain(fenced) {
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
    /// How it ended, if it has.
    pub fn look(&mut self) -> Option<Ended> {
        if self.ended.is_none()
            && let Ok(Some(status)) = self.child.try_wait()
        {
            self.ended = Some(Ended { status, by_us: false });
        }
        self.ended
    }

    /// Its process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// The signal that it died of.
    pub fn signal(&self) -> Option<i32> {
        self.ended.and_then(|ended| ended.status.signal())
    }

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

/// Starts a process whose every word goes to a new file, and which dies with the thread that calls this.
pub(crate) fn start(command: Command, log: &Path) -> io::Result<Child> {
    start_with(command, File::create(log)?)
}

fn start_with(mut command: Command, log: File) -> io::Result<Child> {
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
