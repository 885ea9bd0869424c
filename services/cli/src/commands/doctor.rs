//! `mikoshi doctor`: whether this machine is fit to run, and how to make it so.

use crate::arguments::DoctorArguments;
use crate::binaries;
use crate::failure::{Failure, Status};
use crate::print::{print_json, print_out};
use mikoshi_ipc_types::{MAX_ROBOTS, ServiceId};
use mikoshi_runtime::{Domain, Placement, RunDirectory, TickSchedule, required_bytes};
use rustix::process::{Resource, getrlimit};
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

const SHARED_MEMORY: &str = "/dev/shm";
/// The team of the paper.
const USUAL_TEAM: usize = 4;
/// Memory that a process in real time wants to lock.
const LOCKED_BYTES: u64 = 256 << 20;
/// Services that yield take up to this much of a core; with less they would stand still in the rest.
const REAL_TIME_SHARE: f64 = 0.9;
/// Fewer cores than this run a team of four slower than they could.
const CORES: usize = 2;

/// Prints what was found.
///
/// # Errors
/// Something that no run can do without is missing: [`Status::Fault`].
pub fn doctor(arguments: &DoctorArguments) -> Result<Status, Failure> {
    let checks = [
        check_shared_memory(),
        check_programs(),
        check_simulator(),
        check_left_overs(arguments.clean),
        check_cores(),
        check_fifo_priority(),
        check_locked_memory(),
        check_real_time_share(),
        check_frequency(),
    ];
    if arguments.json {
        print_json(&checks)?;
    } else {
        print_out(&checks.iter().map(Check::to_text).collect::<String>());
    }
    let is_unfit = checks.iter().any(|check| check.verdict == Verdict::Unfit);
    Ok(if is_unfit { Status::Fault } else { Status::Met })
}

/// One thing that was looked at.
#[derive(Debug, Serialize)]
struct Check {
    name: &'static str,
    verdict: Verdict,
    found: String,
    /// How to put it right; absent where nothing is wrong.
    fix: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Verdict {
    /// As it should be.
    Fit,
    /// Runs work, though less well.
    Advice,
    /// No run works.
    Unfit,
}

impl Check {
    fn fit(name: &'static str, found: impl Into<String>) -> Self {
        Self { name, verdict: Verdict::Fit, found: found.into(), fix: None }
    }

    fn advice(name: &'static str, found: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { name, verdict: Verdict::Advice, found: found.into(), fix: Some(fix.into()) }
    }

    fn unfit(name: &'static str, found: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { name, verdict: Verdict::Unfit, found: found.into(), fix: Some(fix.into()) }
    }

    fn to_text(&self) -> String {
        let mark = match self.verdict {
            Verdict::Fit => "ok  ",
            Verdict::Advice => "note",
            Verdict::Unfit => "FAIL",
        };
        let indented = |text: &str| text.replace('\n', "\n       ");
        let fix = self.fix.as_ref().map(|fix| format!("       → {}\n", indented(fix))).unwrap_or_default();
        format!("{mark}   {}: {}\n{fix}", self.name, indented(&self.found))
    }
}

fn check_shared_memory() -> Check {
    const NAME: &str = "shared memory";
    let status = match rustix::fs::statvfs(SHARED_MEMORY) {
        Ok(status) => status,
        Err(errno) => {
            let found = format!("{SHARED_MEMORY}: {errno}");
            return Check::unfit(NAME, found, format!("mount -t tmpfs tmpfs {SHARED_MEMORY}"));
        }
    };
    let free = status.f_bavail.saturating_mul(status.f_frsize);
    let (usual, largest) = (room_for(USUAL_TEAM), room_for(MAX_ROBOTS));
    let found = format!(
        "{} MiB free in {SHARED_MEMORY}; a run of {USUAL_TEAM} robots takes {}, of {MAX_ROBOTS} robots {}",
        free >> 20,
        usual.div_ceil(1 << 20),
        largest.div_ceil(1 << 20)
    );
    let fix = format!(
        "remove what lies there (`mikoshi doctor --clean` removes what is ours), or \
         mount -o remount,size=1G {SHARED_MEMORY} (docker: --shm-size=1g)"
    );
    match free {
        _ if free >= largest => Check::fit(NAME, found),
        _ if free >= usual => Check::advice(NAME, found, fix),
        _ => Check::unfit(NAME, found, fix),
    }
}

/// Shared memory that a run of this many robots takes.
fn room_for(robots: usize) -> u64 {
    TickSchedule::of_team(robots, 0, &Placement::default())
        .map_or(u64::MAX, |schedule| required_bytes(&schedule))
}

fn check_programs() -> Check {
    const NAME: &str = "programs";
    let names = [ServiceId::Bridge, ServiceId::Coordinator, ServiceId::Servo(0)].map(binaries::name_of);
    let missing =
        names.into_iter().chain([binaries::IN_PROCESS]).filter_map(|name| binaries::find(name).err());
    match missing.map(|failure| failure.message).next() {
        None => Check::fit(NAME, "all services are beside this command"),
        Some(message) => Check::unfit(NAME, message, "make build"),
    }
}

fn check_simulator() -> Check {
    const NAME: &str = "simulator";
    match binaries::simulator_version() {
        Ok(version) => Check::fit(NAME, version),
        Err(failure) => Check::unfit(NAME, failure.message, "make setup build"),
    }
}

/// What dead runs have left in shared memory.
fn check_left_overs(clean: bool) -> Check {
    const NAME: &str = "left over";
    let base = RunDirectory::default_base();
    let found = match left_overs(&base) {
        Ok(found) => found,
        Err(message) => return Check::unfit(NAME, message, format!("rm -r {}", base.display())),
    };
    if found.is_empty() {
        return Check::fit(NAME, "nothing of dead runs");
    }
    let list = found.iter().map(|path| format!("\n{}", path.display())).collect::<String>();
    if !clean {
        return Check::advice(NAME, format!("of dead runs:{list}"), "mikoshi doctor --clean");
    }
    match remove(&base) {
        Ok(()) => Check::fit(NAME, format!("removed:{list}")),
        Err(message) => Check::unfit(NAME, message, "remove it by hand"),
    }
}

/// Directories of dead runs, and files of runs that have no directory any more.
fn left_overs(base: &Path) -> Result<Vec<PathBuf>, String> {
    let runs = RunDirectory::list(base).map_err(|error| error.to_string())?;
    let (alive, dead): (Vec<_>, Vec<_>) = runs.into_iter().partition(|run| run.alive);
    let dead: Vec<_> = dead.into_iter().map(|run| run.path).collect();
    let known: Vec<_> = alive.into_iter().map(|run| run.path).chain(dead.iter().cloned()).collect();
    let orphans = Domain::orphans(&known).map_err(|error| format!("{SHARED_MEMORY}: {error}"))?;
    Ok(dead.into_iter().chain(orphans).collect())
}

fn remove(base: &Path) -> Result<(), String> {
    RunDirectory::clean_dead(base).map_err(|error| error.to_string())?;
    let runs = RunDirectory::list(base).map_err(|error| error.to_string())?;
    let runs: Vec<_> = runs.into_iter().map(|run| run.path).collect();
    for orphan in Domain::orphans(&runs).map_err(|error| error.to_string())? {
        fs::remove_file(&orphan).map_err(|error| format!("{}: {error}", orphan.display()))?;
    }
    Ok(())
}

fn check_cores() -> Check {
    const NAME: &str = "cores";
    let cores = available_parallelism().map_or(1, usize::from);
    let found = format!("{cores} may be used");
    match cores {
        _ if cores >= CORES => Check::fit(NAME, found),
        _ => Check::advice(
            NAME,
            found,
            "runs are slower than they could be: allow this user more (cpuset, taskset)",
        ),
    }
}

fn check_fifo_priority() -> Check {
    const NAME: &str = "FIFO priority";
    let highest = getrlimit(Resource::Rtprio).current;
    if rustix::process::geteuid().is_root() || highest.is_none_or(|highest| highest > 0) {
        return Check::fit(NAME, "granted");
    }
    Check::advice(
        NAME,
        "not granted; only runs in real time want it",
        "add `@realtime - rtprio 80` to /etc/security/limits.conf and this user to the group realtime, or \
         LimitRTPRIO=80 to the systemd unit",
    )
}

/// The kernel takes cores away from who has a FIFO priority for the rest of each period.
fn check_real_time_share() -> Check {
    const NAME: &str = "real-time share";
    let number = |name: &str| -> Option<f64> {
        fs::read_to_string(format!("/proc/sys/kernel/{name}")).ok()?.trim().parse().ok()
    };
    match (number("sched_rt_runtime_us"), number("sched_rt_period_us")) {
        (Some(runtime), _) if runtime < 0.0 => Check::fit(NAME, "not limited"),
        (Some(runtime), Some(period)) if period > 0.0 => {
            let found = format!("{:.0} % of every {:.1} s", 100.0 * runtime / period, 1e-6 * period);
            if runtime / period >= REAL_TIME_SHARE {
                return Check::fit(NAME, found);
            }
            let fix = "sysctl kernel.sched_rt_runtime_us=950000, or -1 on cores that nothing else needs";
            Check::advice(NAME, found, fix)
        }
        _ => Check::fit(NAME, "this kernel has no limit"),
    }
}

/// Cores that save power are slow when they are wanted.
fn check_frequency() -> Check {
    const NAME: &str = "frequency";
    match fs::read_to_string("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor") {
        Ok(governor) if governor.trim() != "performance" => Check::advice(
            NAME,
            format!("cores follow the governor `{}`; runs in real time want the highest", governor.trim()),
            "cpupower frequency-set --governor performance",
        ),
        Ok(_) => Check::fit(NAME, "the highest"),
        Err(_) => Check::fit(NAME, "not this system's to choose"),
    }
}

fn check_locked_memory() -> Check {
    const NAME: &str = "locked memory";
    match getrlimit(Resource::Memlock).current {
        None => Check::fit(NAME, "not limited"),
        Some(bytes) if bytes >= LOCKED_BYTES => Check::fit(NAME, format!("{} MiB", bytes >> 20)),
        Some(bytes) => Check::advice(
            NAME,
            format!("{} KiB; only runs in real time want more", bytes >> 10),
            "add `@realtime - memlock unlimited` to /etc/security/limits.conf and this user to the group \
             realtime, or LimitMEMLOCK=infinity to the systemd unit",
        ),
    }
}
