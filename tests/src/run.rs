//! Runs, as a user starts, watches and ends them.

use crate::programs::mikoshi;
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{Board, Domain, Role, RunDirectory, State};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::yield_now;
use tempfile::TempDir;

/// How a command ended, and what it said.
#[derive(Debug)]
pub struct Said {
    /// Its exit status; none if a signal ended it.
    pub status: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub error: String,
}

impl Said {
    /// The tick that was told: "… from tick N on".
    #[track_caller]
    pub fn from_tick(&self) -> u64 {
        assert_eq!(self.status, Some(0), "{self:#?}");
        let (_, behind) = self.out.split_once("from tick ").expect("a tick");
        behind.split_whitespace().next().and_then(|tick| tick.parse().ok()).expect("a tick")
    }

    /// Ends the test unless the exit status is this and every text was said on standard error.
    #[track_caller]
    pub fn expect_error(&self, status: i32, texts: &[&str]) {
        assert_eq!(self.status, Some(status), "{self:#?}");
        assert!(self.error.starts_with("error: "), "{self:#?}");
        for text in texts {
            assert!(self.error.contains(text), "no {text:?} in {self:#?}");
        }
    }
}

impl From<Output> for Said {
    fn from(output: Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Self { status: output.status.code(), out: text(&output.stdout), error: text(&output.stderr) }
    }
}

/// Runs a command to its end.
pub fn say(command: &mut Command) -> Said {
    command.stdin(Stdio::null()).output().expect("it can be started").into()
}

/// `mikoshi` with these arguments, to its end.
pub fn say_mikoshi<T: AsRef<OsStr>>(arguments: impl IntoIterator<Item = T>) -> Said {
    say(mikoshi().args(arguments))
}

/// `mikoshi run SCENARIO ARGUMENTS`, quietly and to its end.
pub fn run(scenario: &Path, arguments: &[&str], results: &Results) -> Said {
    say(&mut run_command(scenario, arguments, results))
}

/// What [`run`] runs, to be changed.
pub fn run_command(scenario: &Path, arguments: &[&str], results: &Results) -> Command {
    let mut command = mikoshi();
    command.args(["run", "--quiet", "--out"]).arg(results.path()).arg(scenario).args(arguments);
    command
}

/// A folder for the results of a run.
pub struct Results {
    folder: TempDir,
}

impl Results {
    /// An empty one.
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a folder") }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Every frame of the run.
    pub fn log(&self) -> PathBuf {
        self.path().join("run.mcap")
    }

    /// The scenario, to be run again.
    pub fn scenario(&self) -> PathBuf {
        self.path().join("scenario.toml")
    }

    /// The world in the simulator's language.
    pub fn world(&self) -> PathBuf {
        self.path().join("world.xml")
    }

    /// What the run came to.
    pub fn summary(&self) -> Value {
        let text = fs::read_to_string(self.path().join("summary.json")).expect("it has ended");
        serde_json::from_str(&text).expect("a summary is JSON")
    }
}

impl Default for Results {
    fn default() -> Self {
        Self::new()
    }
}

/// A run in its own processes that has not ended yet.
pub struct Running {
    supervisor: Child,
}

impl Running {
    /// Starts `mikoshi run SCENARIO ARGUMENTS`, and waits until all services have executed a tick.
    pub fn start(scenario: &Path, arguments: &[&str], results: &Results) -> Self {
        let supervisor = run_command(scenario, arguments, results)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it can be started");
        let mut running = Self { supervisor };
        while !running.has_begun() {
            assert!(!running.has_ended(), "it ended at once: {:#?}", running.wait());
            yield_now();
        }
        running
    }

    /// Its directory in shared memory.
    pub fn directory(&self) -> PathBuf {
        RunDirectory::default_base().join(format!("{}-0", self.supervisor.id()))
    }

    /// `mikoshi COMMAND ARGUMENTS` of this run, to its end.
    pub fn say(&self, command: &[&str]) -> Said {
        let name = self.directory().file_name().expect("a name").to_string_lossy().into_owned();
        say_mikoshi([command, &["--run", &name]].concat())
    }

    /// Waits until the world is in this tick.
    pub fn wait_for_tick(&self, tick: u64) {
        let board = Board::open(&self.directory()).expect("it runs");
        while board.last_position(ServiceId::Bridge).is_none_or(|at| at.tick < tick) {
            yield_now();
        }
    }

    /// The processes of its services.
    pub fn services(&self) -> Vec<(ServiceId, u32)> {
        let board = Board::open(&self.directory()).expect("it is running");
        let statuses = board.statuses().into_iter();
        statuses
            .filter_map(|status| match (status.role, status.process) {
                (Role::Service(service), Some(process)) => Some((service, process.pid)),
                _ => None,
            })
            .collect()
    }

    /// Waits until so many processes of the run stand by.
    pub fn wait_for_standbys(&self, count: usize) {
        let of_run = self.directory();
        let is_standby = |line: &[u8]| {
            let arguments = line.split(|byte| *byte == 0);
            let has = |text: &[u8]| arguments.clone().any(|argument| argument == text);
            has(b"--standby") && has(of_run.as_os_str().as_encoded_bytes())
        };
        let stand_by = || {
            let processes = fs::read_dir("/proc").expect("/proc is there").flatten();
            let lines = processes.filter_map(|process| fs::read(process.path().join("cmdline")).ok());
            lines.filter(|line| is_standby(line)).count()
        };
        while stand_by() < count {
            yield_now();
        }
    }

    /// Sends a signal to a service's process.
    pub fn signal_service(&self, service: ServiceId, signal: Signal) {
        let found = self.services().into_iter().find(|(id, _)| *id == service);
        let (_, pid) = found.expect("it is a service of this run");
        send(pid, signal);
    }

    /// Sends a signal to the supervisor.
    pub fn signal(&self, signal: Signal) {
        send(self.supervisor.id(), signal);
    }

    /// Waits for its end.
    pub fn wait(self) -> Said {
        let output = self.supervisor.wait_with_output().expect("it was started");
        if output.status.signal().is_some() {
            eprintln!("ended by {}", output.status);
        }
        output.into()
    }

    fn has_begun(&self) -> bool {
        Board::open(&self.directory()).is_ok_and(|board| {
            let mut statuses = board.statuses().into_iter();
            statuses.all(|status| {
                !matches!(status.role, Role::Service(_)) || status.state == State::Running && status.tick > 0
            })
        })
    }

    fn has_ended(&mut self) -> bool {
        self.supervisor.try_wait().expect("it was started").is_some()
    }
}

fn send(pid: u32, signal: Signal) {
    let pid = Pid::from_raw(pid.try_into().expect("a pid")).expect("a pid is not zero");
    kill_process(pid, signal).expect("it runs");
}

/// Whether a process with this pid runs (a zombie does not).
pub fn is_alive(pid: u32) -> bool {
    mikoshi_runtime::ProcessIdentity::of(pid).expect("/proc can be read").is_some()
}

/// What a run in this directory has left in shared memory.
pub fn left_behind(directory: &Path) -> Vec<PathBuf> {
    let mut found = Domain::of(directory).shared_memory_files().expect("shared memory can be read");
    if directory.exists() {
        found.push(directory.to_owned());
    }
    found
}
