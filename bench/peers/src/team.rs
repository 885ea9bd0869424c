//! A team of six processes on two cores, whatever carries its frames.

use crate::carrier::Carrier;
use crate::driver::{DriverError, Wait};
use crate::serve::TIMES;
use crate::tap::EveryFrame;
use crate::witness::Fault;
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{Board, Entry, Member, Placement, Role, RunDirectory, TickSchedule, WaitPolicy};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// With a bridge and a coordinator six processes.
const ROBOTS: usize = 4;

/// How often a tap looks what there is: as `mikoshi run` does.
const LOOK: Duration = Duration::from_millis(1);
/// Looks without any word of a service, after which a team is given up: a minute.
const PATIENCE: u32 = 60_000;

/// The tick of all teams.
pub fn schedule() -> TickSchedule {
    let placement = Placement { bridge_core: Some(0), coordinator_core: Some(1), servo_cores: vec![0, 1] };
    TickSchedule::of_team(ROBOTS, 0, &placement).expect("a valid team")
}

/// Who takes part.
pub fn services() -> impl Iterator<Item = ServiceId> {
    ServiceId::of_team(ROBOTS)
}

/// What a team is asked to do.
#[derive(Clone, Copy, Debug)]
pub struct Task {
    /// What carries its frames.
    pub carrier: Carrier,
    /// How its processes wait.
    pub wait: Wait,
    /// For how many ticks.
    pub ticks: u64,
    /// Whether every word of every frame is looked at.
    pub is_checked: bool,
    /// What its coordinator does in one tick.
    pub fault: Option<Fault>,
}

/// What a team did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// When each tick began.
    pub times_ns: Vec<u64>,
    /// What each service came to, in order.
    pub numbers: Vec<String>,
}

/// Ends with its owner.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        // What has ended can't be killed.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What a board and a supervisor's place are for.
struct Supervision {
    tap: Option<EveryFrame>,
    member: Member,
}

impl Supervision {
    fn of(place: &Path, schedule: &TickSchedule, has_tap: bool) -> Result<Self, DriverError> {
        Board::create(place, &schedule.services(), has_tap).map_err(DriverError::of)?;
        let join =
            |role| Member::join(place, role, WaitPolicy::default(), Entry::Vacant).map_err(DriverError::of);
        let member = join(Role::Supervisor)?;
        let tap = match has_tap {
            true => Some(EveryFrame::open(place, join(Role::Tap)?, schedule)?),
            false => None,
        };
        Ok(Self { tap, member })
    }
}

/// Carries out a task, from making the processes to their end.
///
/// # Errors
/// A process can't be made, fails, or says nothing for a minute.
pub fn run(task: Task) -> Result<Outcome, DriverError> {
    let directory = RunDirectory::create(&RunDirectory::default_base()).map_err(DriverError::of)?;
    let place = directory.path();
    let schedule = schedule();
    let mut supervision = match task.carrier {
        Carrier::Mikoshi => Some(Supervision::of(place, &schedule, true)?),
        Carrier::MikoshiUnobserved => Some(Supervision::of(place, &schedule, false)?),
        _ => None,
    };
    let (sender, words) = channel();
    let mut processes = Vec::new();
    for (index, service) in services().enumerate() {
        let mut child = command(task, place, service)?.spawn().map_err(DriverError::of)?;
        let stdout = child.stdout.take();
        processes.push(Process(child));
        let sender = sender.clone();
        std::thread::spawn(move || {
            let mut line = String::new();
            if let Some(stdout) = stdout {
                // A service that can't be heard has said nothing.
                let _ = BufReader::new(stdout).read_line(&mut line);
            }
            let _ = sender.send((index, line.trim().to_owned()));
        });
    }
    let numbers = gather(&words, supervision.as_mut().and_then(|supervision| supervision.tap.as_mut()))?;
    let times = std::fs::read(place.join(TIMES)).map_err(DriverError::of)?;
    let times_ns =
        times.chunks_exact(8).map(|word| word.iter().rev().fold(0, |n, byte| n << 8 | u64::from(*byte)));
    let times_ns = times_ns.collect();
    // They end when they are no longer spoken to, and only now: who ends early takes its ports with it.
    for process in &mut processes {
        drop(process.0.stdin.take());
        process.0.wait().map_err(DriverError::of)?;
    }
    if let Some(supervision) = supervision {
        supervision.member.conclude();
    }
    Ok(Outcome { times_ns, numbers })
}

fn command(task: Task, place: &Path, service: ServiceId) -> Result<Command, DriverError> {
    let Task { carrier, wait, ticks, is_checked, fault } = task;
    let mut command = Command::new(std::env::current_exe().map_err(DriverError::of)?);
    command.arg("serve").arg("--place").arg(place).args([
        format!("--service={service}"),
        format!("--carrier={carrier}"),
        format!("--wait={wait}"),
        format!("--ticks={ticks}"),
    ]);
    if is_checked {
        command.arg("--check");
    }
    if let Some(fault) = fault.filter(|_| service == ServiceId::Coordinator) {
        command.arg("--fault").arg(fault.name());
    }
    command.stdin(Stdio::piped()).stdout(Stdio::piped());
    Ok(command)
}

/// Hears of all services what they came to.
fn gather(
    words: &Receiver<(usize, String)>,
    mut tap: Option<&mut EveryFrame>,
) -> Result<Vec<String>, DriverError> {
    let mut numbers = vec![None; services().count()];
    let mut quiet = 0;
    while numbers.iter().any(Option::is_none) {
        if let Some(tap) = &mut tap {
            tap.take()?;
        }
        match words.recv_timeout(LOOK) {
            Ok((_, word)) if word.is_empty() => return Err(DriverError("a process has failed".to_owned())),
            Ok((index, word)) => (numbers[index], quiet) = (Some(word), 0),
            Err(RecvTimeoutError::Timeout) if quiet < PATIENCE => quiet += 1,
            Err(_) => return Err(DriverError("the team stands still".to_owned())),
        }
    }
    Ok(numbers.into_iter().flatten().collect())
}
