//! A run whose processes are killed, and the same run undisturbed.

mod by_the_clock;
mod memory;
mod victims;

use crate::arguments::SoakArguments;
use crate::binaries;
use crate::children;
use crate::failure::{Failure, Status};
use crate::interrupts::Interrupts;
use crate::outcome::label_of;
use crate::output_directory::{OutputDirectory, SUMMARY};
use crate::prepare::prepare;
use crate::print::print_out;
use crate::table;
use crate::wall_clock::{Stopwatch, pause};
use core::fmt::Write as _;
use core::time::Duration;
use memory::Memory;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{Board, Domain, Position, Role, RunDirectory, State};
use rustix::process::{Pid, Signal, kill_process};
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use victims::Strike;

/// How often it is looked where a run is: well within a tick.
const LOOK: Duration = Duration::from_micros(200);
const MEMORY_PERIOD: Duration = Duration::from_secs(1);
/// How often somebody is killed, unless told otherwise.
const KILLS: usize = 200;

/// What a soak came to.
#[derive(Debug, Serialize)]
pub struct SoakResult {
    scenario: String,
    seed: u64,
    passed: bool,
    failures: Vec<String>,
    /// Of the run that nobody disturbed.
    undisturbed_hash: String,
    disturbed_hash: String,
    undisturbed_wall_time_s: f64,
    disturbed_wall_time_s: f64,
    kills: Vec<Kill>,
    left_behind: Vec<PathBuf>,
    memory: Vec<MemoryRow>,
}

/// One process that was killed.
#[derive(Debug, Serialize)]
struct Kill {
    service: String,
    /// Where it was.
    tick: u64,
    phase: usize,
    /// Whether it had only just taken its predecessor's place.
    is_repeated: bool,
}

#[derive(Debug, Serialize)]
struct MemoryRow {
    service: String,
    /// In memory or swapped out, without shared memory and programs.
    own_kib: f64,
    growth_kib_per_min: f64,
}

/// `mikoshi soak`.
///
/// # Errors
/// Bad usage or configuration, or a run that could not be carried out.
pub fn soak(arguments: &SoakArguments) -> Result<Status, Failure> {
    let interrupts = Interrupts::listen().map_err(Failure::fault)?;
    let run = prepare(&arguments.scenario)?.run;
    if arguments.real_time {
        return by_the_clock::soak(arguments, &run, &interrupts);
    }
    let default = || Path::new("runs").join(format!("soak-{}-{}", run.scenario.name, run.scenario.seed));
    let out = arguments.out.clone().unwrap_or_else(default);
    let (calm, rough) = (out.join("undisturbed"), out.join("disturbed"));
    for folder in [&calm, &rough] {
        fs::create_dir_all(folder).map_err(|error| Failure::fault(error).context(folder.display()))?;
        // Nobody else writes there meanwhile.
        drop(OutputDirectory::open(folder, true)?);
    }
    let undisturbed =
        Attempt::start(arguments, run.scenario.seed, &calm, &["--in-process"])?.finish(&interrupts)?;

    let kills = arguments.kills.unwrap_or(KILLS);
    let strikes = victims::draw(run.scenario.seed, kills, run.ticks, run.robots.len());
    let mut attempt = Attempt::start(arguments, run.scenario.seed, &rough, &[])?;
    let mut watch = Watch {
        run: &run,
        directory: attempt.directory(),
        kills: vec![],
        killed: BTreeSet::new(),
        memory: Memory::default(),
    };
    watch.strike_and_wait(&strikes, &mut attempt.child, &interrupts);
    let Watch { directory, kills, memory, .. } = watch;
    let disturbed = attempt.finish(&interrupts)?;

    let result = judge(&run, &undisturbed, &disturbed, kills, &memory, left_behind(&directory)?);
    let json = serde_json::to_string_pretty(&result).map_err(Failure::fault)? + "\n";
    let file = out.join("soak.json");
    fs::write(&file, &json).map_err(|error| Failure::fault(error).context(file.display()))?;
    if arguments.json {
        print_out(&json);
    } else if !arguments.quiet {
        print_out(&result.to_text(&out));
    }
    Ok(if result.passed { Status::Met } else { Status::NotMet })
}

/// A run as a process of its own.
struct Attempt {
    child: Child,
    out: PathBuf,
}

impl Attempt {
    fn start(arguments: &SoakArguments, seed: u64, out: &Path, options: &[&str]) -> Result<Self, Failure> {
        let program = binaries::find("mikoshi")?;
        let mut command = Command::new(&program);
        command
            .arg("run")
            .arg(&arguments.scenario.scenario)
            .args(["--quiet", "--force", "--no-log", "--out"]);
        command.arg(out).args(["--seed", &seed.to_string()]).args(options);
        for (key, value) in &arguments.scenario.overrides {
            command.arg("--set").arg(format!("{key}={value}"));
        }
        let child = children::start_run(command, &out.with_extension("log"))
            .map_err(|error| Failure::fault(error).context(program.display()))?;
        Ok(Self { child, out: out.to_owned() })
    }

    /// Where a run of processes has its directory.
    fn directory(&self) -> PathBuf {
        RunDirectory::default_base().join(format!("{}-0", self.child.id()))
    }

    /// Waits for its end; what it came to.
    fn finish(mut self, interrupts: &Interrupts) -> Result<Value, Failure> {
        loop {
            if self.child.try_wait().map_err(Failure::fault)?.is_some() {
                break;
            }
            if let Some(signal) = interrupts.received() {
                return Err(Failure { status: Status::Signal(signal), message: "stopped".to_owned() });
            }
            pause(Duration::from_millis(10));
        }
        let file = self.out.join(SUMMARY);
        let told = || fs::read_to_string(self.out.with_extension("log")).unwrap_or_default();
        let summary = fs::read(&file).map_err(|_| Failure::fault(told()).context(self.out.display()))?;
        serde_json::from_slice(&summary).map_err(|error| Failure::fault(error).context(file.display()))
    }
}

impl Drop for Attempt {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            // In order, so that it leaves nothing.
            let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
            let _ = pid.map(|pid| kill_process(pid, Signal::TERM));
            let _ = self.child.wait();
        }
    }
}

/// A run that is being disturbed.
struct Watch<'a> {
    run: &'a RunSpec,
    directory: PathBuf,
    kills: Vec<Kill>,
    /// Who was killed may still be there for a moment.
    killed: BTreeSet<u32>,
    memory: Memory,
}

impl Watch<'_> {
    fn strike_and_wait(&mut self, strikes: &[Strike], child: &mut Child, interrupts: &Interrupts) {
        let mut is_over =
            || matches!(child.try_wait(), Ok(Some(_)) | Err(_)) || interrupts.received().is_some();
        let Some(board) = board_of(&self.directory, &mut is_over) else { return };
        let (clock, mut since_sample) = (Stopwatch::start(), Stopwatch::start());
        let mut strikes = strikes.iter().peekable();
        let mut repeated: Vec<(ServiceId, u64)> = vec![];
        while !is_over() {
            repeated.retain(|&(service, epoch)| {
                let has_successor = board.charge_of(service).is_some_and(|(current, _)| current > epoch);
                !has_successor || !self.kill(&board, service, true)
            });
            let at = board.last_position(ServiceId::Bridge).unwrap_or_default();
            if let Some(strike) = strikes.next_if(|strike| at > Position { tick: strike.tick, phase: 0 }) {
                for &service in &strike.victims {
                    let epoch = board.charge_of(service).map_or(0, |(epoch, _)| epoch);
                    if self.kill(&board, service, false) && strike.is_repeated {
                        repeated.push((service, epoch));
                    }
                }
            }
            if since_sample.elapsed() >= MEMORY_PERIOD {
                since_sample.lap();
                for (role, pid) in processes(&board) {
                    self.memory.sample(role, pid, clock.elapsed().as_secs_f64());
                }
            }
            pause(LOOK);
        }
    }

    /// Kills the process of a service, if it executes ticks.
    fn kill(&mut self, board: &Board, service: ServiceId, is_repeated: bool) -> bool {
        let is_running = board.states().any(|state| state == (Role::Service(service), State::Running));
        let mut processes = processes(board).into_iter();
        let process =
            processes.find(|(role, pid)| *role == Role::Service(service) && !self.killed.contains(pid));
        let Some((_, number)) = process.filter(|_| is_running) else { return false };
        let pid = i32::try_from(number).ok().and_then(Pid::from_raw);
        let is_killed = pid.is_some_and(|pid| kill_process(pid, Signal::KILL).is_ok());
        if is_killed {
            self.killed.insert(number);
            let Position { tick, phase } = board.last_position(service).unwrap_or_default();
            self.kills.push(Kill { service: label_of(self.run, service), tick, phase, is_repeated });
        }
        is_killed
    }
}

/// The board of the run in this directory, as soon as there is one; none if the run is over before.
fn board_of(directory: &Path, mut is_over: impl FnMut() -> bool) -> Option<Board> {
    loop {
        match Board::open(directory) {
            Ok(board) => return Some(board),
            Err(_) if is_over() => return None,
            Err(_) => pause(LOOK),
        }
    }
}

/// All that live; the tap is a part of the supervisor.
fn processes(board: &Board) -> Vec<(Role, u32)> {
    let statuses = board.statuses().into_iter();
    let living = statuses.filter(|status| status.alive && status.role != Role::Tap);
    living.filter_map(|status| Some((status.role, status.process?.pid))).collect()
}

/// What the run in this directory has left in shared memory.
fn left_behind(directory: &Path) -> Result<Vec<PathBuf>, Failure> {
    let mut found = Domain::of(directory).shared_memory_files().map_err(Failure::fault)?;
    found.extend(directory.exists().then(|| directory.to_owned()));
    Ok(found)
}

fn judge(
    run: &RunSpec,
    undisturbed: &Value,
    disturbed: &Value,
    kills: Vec<Kill>,
    memory: &Memory,
    left_behind: Vec<PathBuf>,
) -> SoakResult {
    let text = |summary: &Value, key: &str| summary[key].as_str().unwrap_or_default().to_owned();
    let seconds = |summary: &Value| summary["wall_time_s"].as_f64().unwrap_or_default();
    let (calm, rough) = (text(undisturbed, "log_hash"), text(disturbed, "log_hash"));
    let replaced = disturbed["swaps"].as_array().map_or(0, Vec::len);
    let mut failures = vec![];
    if calm != rough {
        failures.push("the disturbed run is another one: its log has another hash".to_owned());
    }
    if replaced != kills.len() {
        failures.push(format!("{} processes were killed, {replaced} were replaced", kills.len()));
    }
    if !left_behind.is_empty() {
        failures.push(format!("{} files were left in shared memory", left_behind.len()));
    }
    let of_run = disturbed["failures"].as_array().into_iter().flatten().filter_map(Value::as_str);
    failures.extend(of_run.map(str::to_owned));
    let memory = memory.slopes().into_iter().map(|(role, own_kib, growth_kib_per_min)| MemoryRow {
        service: match role {
            Role::Service(service) => label_of(run, service),
            role => role.to_string(),
        },
        own_kib,
        growth_kib_per_min,
    });
    SoakResult {
        scenario: run.scenario.name.clone(),
        seed: run.scenario.seed,
        passed: failures.is_empty(),
        failures,
        undisturbed_hash: calm,
        disturbed_hash: rough,
        undisturbed_wall_time_s: seconds(undisturbed),
        disturbed_wall_time_s: seconds(disturbed),
        kills,
        left_behind,
        memory: memory.collect(),
    }
}

impl SoakResult {
    fn to_text(&self, out: &Path) -> String {
        let mut text = String::new();
        // Writing to a String can't fail.
        let _ = writeln!(
            text,
            "{} processes killed, in {} ticks; {:.1} s, undisturbed and in one thread {:.1} s",
            self.kills.len(),
            self.kills.iter().map(|kill| kill.tick).collect::<BTreeSet<_>>().len(),
            self.disturbed_wall_time_s,
            self.undisturbed_wall_time_s,
        );
        if !self.memory.is_empty() {
            let rows = self.memory.iter().map(|row| {
                let megabytes = format!("{:.1}", row.own_kib / 1024.0);
                vec![row.service.clone(), megabytes, format!("{:+.1}", row.growth_kib_per_min)]
            });
            text += &table::of_text(&["service", "memory MiB", "growth KiB/min"], rows);
        }
        let _ = writeln!(text, "log hash {}", self.disturbed_hash);
        for failure in &self.failures {
            let _ = writeln!(text, "failed: {failure}");
        }
        let verdict = if self.passed { "passed: byte for byte the undisturbed run" } else { "failed" };
        let _ = writeln!(text, "results in {}\n{verdict}", out.display());
        text
    }
}
