//! The service processes of a run: started or adopted, replaced, ended.

use crate::binaries;
use crate::failure::Failure;
use crate::orphans::{Orphan, orphans_of};
use crate::service_process::{Handle, ServiceProcess, Variant};
use crate::wall_clock::{Stopwatch, pause};
use core::time::Duration;
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{Board, ProcessIdentity, ProcessWatch};
use rustix::process::{Pid, Signal, getpid, getppid, set_parent_process_death_signal};
use std::ffi::OsStr;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::rc::Rc;

/// How long processes get to end by themselves.
const GRACE: Duration = Duration::from_secs(2);
/// How often it is looked whether they have.
const LOOK: Duration = Duration::from_millis(2);
/// How long a process that was taken over from may live on: it may wake up, and end by itself.
const FENCED_GRACE: Duration = Duration::from_secs(1);
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
    pub fn spawn(
        &mut self,
        service: ServiceId,
        label: String,
        robot: Option<&str>,
        variant: Variant,
    ) -> Result<(), Failure> {
        let robot = robot.map(str::to_owned);
        let process = self.start(service, label, robot, variant, &[])?;
        self.processes.push(process);
        Ok(())
    }

    /// Takes over the services of a run that has lost its supervisor, each of which people call by its label, and
    /// whatever stands by; who was on the way to be swapped in is not awaited any more.
    ///
    /// # Errors
    /// A service is nobody's, or `/proc` is not to be read.
    pub fn adopt<'a>(
        run_directory: &Path,
        logs: &Path,
        services: impl Iterator<Item = (ServiceId, String, Option<&'a str>)>,
    ) -> Result<Self, Failure> {
        let mut children = Self::of(run_directory, logs);
        let board = Rc::new(Board::open(run_directory).map_err(Failure::fault)?);
        let services: Vec<_> = services.collect();
        // Before anything happens to anybody.
        if let Some((_, label, _)) =
            services.iter().find(|(service, ..)| board.process_of(*service).is_none())
        {
            return Err(Failure::fault(format!("the run has no {label}: it had not begun")));
        }
        let mut orphans = orphans_of(run_directory).map_err(Failure::fault)?;
        for (service, label, robot) in services {
            let Some(in_charge) = board.process_of(service) else { continue };
            let is_of_service = |orphan: &mut Orphan| match robot {
                Some(robot) => orphan.robot.as_deref() == Some(robot),
                None => orphan.pid == in_charge.pid || orphan.is_program(binaries::name_of(service)),
            };
            let mut found: Vec<_> = orphans.extract_if(.., is_of_service).collect();
            let known = found.iter().position(|orphan| orphan.pid == in_charge.pid);
            let known = known.map(|index| found.swap_remove(index));
            let default_log = children.log_of(service, robot);
            let adopted = |identity, orphan: Option<Orphan>| {
                let (variant, log) = orphan.map(|orphan| (orphan.variant, orphan.log)).unwrap_or_default();
                ServiceProcess {
                    service,
                    label: label.clone(),
                    robot: robot.map(str::to_owned),
                    variant,
                    ended: None,
                    handle: Handle::Adopted { watch: ProcessWatch::new(identity), board: Rc::clone(&board) },
                    log: log.unwrap_or_else(|| default_log.clone()),
                }
            };
            children.processes.push(adopted(in_charge, known));
            for orphan in found {
                let Ok(Some(identity)) = ProcessIdentity::of(orphan.pid) else { continue };
                let is_standby = orphan.is_standby;
                let mut process = adopted(identity, Some(orphan));
                match is_standby {
                    true => children.standbys.push(process),
                    false => process.kill(),
                }
            }
        }
        Ok(children)
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
        let is_promoted = |standby: &mut ServiceProcess| in_charge(standby.service) == Some(standby.id());
        for standby in self.standbys.extract_if(.., is_promoted) {
            let service = standby.service;
            let process = self.processes.iter_mut().find(|process| process.service == service);
            let Some(process) = process else { continue };
            let mut predecessor = core::mem::replace(process, standby);
            predecessor.look();
            // Who was fenced ends well.
            let cause = match (predecessor.death(), predecessor.has_failed()) {
                (Some(death), _) => death,
                (None, true) => "failed".to_owned(),
                (None, false) => "fell behind".to_owned(),
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
        let log = self.log_of(service, robot.as_deref());
        let mut command = Command::new(&program);
        command.arg("--run").arg(&self.run_directory).args(arguments);
        if let Some(robot) = &robot {
            command.args(["--robot", robot]);
        }
        command.args(&variant.arguments);
        if let Some(spec) = &variant.spec {
            command.arg("--spec").arg(spec);
        }
        // After what its predecessors said.
        let log_file = OpenOptions::new().create(true).append(true).open(&log);
        let child = log_file
            .and_then(|log_file| spawn(command, log_file))
            .map_err(|error| Failure::fault(error).context(format_args!("{label}: {}", program.display())))?;
        Ok(ServiceProcess { service, label, robot, variant, ended: None, handle: Handle::Own(child), log })
    }

    fn log_of(&self, service: ServiceId, robot: Option<&str>) -> PathBuf {
        self.logs.join(match robot {
            Some(robot) => format!("servo-{robot}.log"),
            None => format!("{service}.log"),
        })
    }

    /// All processes.
    pub fn processes(&self) -> &[ServiceProcess] {
        &self.processes
    }

    /// Looks which have ended.
    pub fn look(&mut self) {
        self.bury_fenced();
        for process in self.processes.iter_mut().chain(&mut self.candidates) {
            process.look();
        }
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

/// Starts a run whose every word goes to a new file, and which ends in order with the thread that calls this.
pub(crate) fn start_run(mut command: Command, log: &Path) -> io::Result<Child> {
    end_with_this_thread(&mut command, Signal::TERM);
    spawn(command, File::create(log)?)
}

/// Has a process ended by this signal when the thread that starts it ends.
pub(crate) fn end_with_this_thread(command: &mut Command, signal: Signal) -> &mut Command {
    let parent = getpid();
    // SAFETY: between fork and exec the closure only makes two system calls on plain values: it neither
    // allocates nor takes a lock.
    unsafe { command.pre_exec(move || end_with(parent, signal)) }
}

/// A process of its own: it lives on without us.
fn spawn(mut command: Command, log: File) -> io::Result<Child> {
    command.stdin(Stdio::null()).stdout(log.try_clone()?).stderr(log);
    // A Ctrl-C at the terminal is for the supervisor, who ends all in order.
    command.process_group(0).spawn()
}

fn end_with(parent: Pid, signal: Signal) -> io::Result<()> {
    set_parent_process_death_signal(Some(signal))?;
    // It may have died before.
    match getppid() == Some(parent) {
        true => Ok(()),
        false => Err(rustix::io::Errno::SRCH.into()),
    }
}
