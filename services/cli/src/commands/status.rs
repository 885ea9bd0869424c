//! `mikoshi status`: which runs there are, and which processes they have.

use crate::arguments::StatusArguments;
use crate::binaries::kind_of;
use crate::failure::Failure;
use crate::print::{print_json, print_out};
use crate::table;
use mikoshi_config::RunSpec;
use mikoshi_resolution::read_run;
use mikoshi_runtime::{Board, FoundRun, Role, RunDirectory, SlotStatus, State};
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;

/// What a link writes, in the directory of its run.
const LINK: &str = "link.json";

/// Prints all runs of this user.
///
/// # Errors
/// The folder of the runs can't be read.
pub fn status(arguments: &StatusArguments) -> Result<(), Failure> {
    let runs = runs()?;
    if arguments.json {
        print_json(&runs)?;
    } else if runs.is_empty() {
        print_out("nothing runs\n");
    } else {
        print_out(&runs.iter().map(RunStatus::to_text).collect::<Vec<_>>().join("\n"));
    }
    Ok(())
}

/// One run.
#[derive(Debug, Serialize)]
struct RunStatus {
    run: String,
    scenario: Option<String>,
    seed: Option<u64>,
    ticks: Option<u64>,
    /// Whether any of its processes lives; otherwise it is left over.
    alive: bool,
    /// Whether its supervisor lives; otherwise it can be adopted.
    supervised: bool,
    processes: Vec<ProcessStatus>,
    /// What the link of this host says, if there are others.
    link: Option<Value>,
}

/// One process of a run.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct ProcessStatus {
    pub service: String,
    pub robot: Option<String>,
    pub pid: Option<u32>,
    pub alive: bool,
    pub epoch: u64,
    pub tick: u64,
    pub state: String,
    pub fault: Option<String>,
}

fn runs() -> Result<Vec<RunStatus>, Failure> {
    let found = RunDirectory::list(&RunDirectory::default_base()).map_err(Failure::fault)?;
    Ok(found.iter().map(RunStatus::of).collect())
}

impl RunStatus {
    fn of(found: &FoundRun) -> Self {
        // A run that is just being made, or just being removed, has less to tell.
        let run = read_run(&found.path).ok();
        let board = Board::open(&found.path).ok();
        let supervised = board.as_ref().is_some_and(Board::is_supervised);
        let board = board.map(|board| board.statuses()).unwrap_or_default();
        Self {
            run: found.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
            scenario: run.as_ref().map(|run| run.scenario.name.clone()),
            seed: run.as_ref().map(|run| run.scenario.seed),
            ticks: run.as_ref().map(|run| run.ticks),
            alive: found.alive,
            supervised,
            processes: board
                .iter()
                .filter(|slot| slot.state != State::Absent)
                .map(|slot| ProcessStatus::of(slot, run.as_ref()))
                .collect(),
            link: fs::read(found.path.join(LINK)).ok().and_then(|text| serde_json::from_slice(&text).ok()),
        }
    }

    /// What is known of the other hosts, one a line.
    fn of_hosts(&self) -> String {
        let Some(link) = &self.link else { return String::new() };
        let list = |of: &Value, key: &str| of[key].as_array().cloned().unwrap_or_default();
        let ms =
            |seconds: &Value| seconds.as_f64().map_or_else(|| "-".to_owned(), |s| format!("{:.2}", 1e3 * s));
        let refused_of = |host: &Value| {
            let of_host = list(link, "topics").into_iter().filter(|topic| topic["from"] == host["host"]);
            let mut refused = BTreeMap::<String, u64>::new();
            for (reason, count) in of_host.filter_map(|topic| topic["frames"].as_object().cloned()).flatten()
            {
                // That copies come is as it should be.
                if !["accepted", "repeated"].contains(&reason.as_str()) {
                    *refused.entry(reason).or_default() += count.as_u64().unwrap_or_default();
                }
            }
            let mut refused: Vec<_> =
                refused.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
            if host["is_of_another_run"] == true {
                refused.push("all: it carries out another run".to_owned());
            }
            if refused.is_empty() { "-".to_owned() } else { refused.join(", ") }
        };
        let cells = |host: &Value| {
            let name = host["host"].as_str().unwrap_or_default().to_owned();
            let [heard, way, ahead] =
                ["heard_s_ago", "round_trip_s", "clock_ahead_s"].map(|key| ms(&host[key]));
            vec![name, heard, way, ahead, refused_of(host)]
        };
        let titles = ["host", "heard [ms]", "there and back [ms]", "clock ahead [ms]", "refused"];
        let hosts = list(link, "hosts");
        let fits = match link["fitting_delay_ticks"].as_u64() {
            Some(ticks) => format!("coordination_delay_ticks that fits what was measured: {ticks}\n"),
            None => String::new(),
        };
        format!("{}{fits}", table::of_text(&titles, hosts.iter().map(cells)))
    }

    fn to_text(&self) -> String {
        let of_scenario = match (&self.scenario, self.seed, self.ticks) {
            (Some(scenario), Some(seed), Some(ticks)) => format!(": {scenario}, seed {seed}, {ticks} ticks"),
            _ => String::new(),
        };
        let hint = match (self.alive, self.supervised) {
            (true, true) => "",
            (true, false) => " (without a supervisor: `mikoshi adopt` looks after it)",
            (false, _) => " (left over: `mikoshi doctor --clean` removes it)",
        };
        let cells = |process: &ProcessStatus| {
            let dash = || "-".to_owned();
            let state = match (&process.fault, process.alive) {
                (Some(fault), _) => format!("{}: {fault}", process.state),
                (None, false) => format!("{}, gone", process.state),
                (None, true) => process.state.clone(),
            };
            vec![
                process.service.clone(),
                process.robot.clone().unwrap_or_else(dash),
                process.pid.map_or_else(dash, |pid| pid.to_string()),
                process.epoch.to_string(),
                process.tick.to_string(),
                state,
            ]
        };
        let titles = ["service", "robot", "pid", "epoch", "tick", "state"];
        let processes = table::of_text(&titles, self.processes.iter().map(cells));
        format!("run {}{of_scenario}{hint}\n{processes}{}", self.run, self.of_hosts())
    }
}

impl ProcessStatus {
    /// By its slot on the board of this run.
    pub fn of(slot: &SlotStatus, run: Option<&RunSpec>) -> Self {
        let (service, robot) = match slot.role {
            Role::Service(service) => (kind_of(service).to_owned(), service.robot()),
            other => (other.to_string(), None),
        };
        let name_of = |robot: usize| {
            let robots = run.map(|run| run.robots.as_slice()).unwrap_or_default();
            robots.get(robot).map_or_else(|| robot.to_string(), |robot| robot.member.name.clone())
        };
        Self {
            service,
            robot: robot.map(name_of),
            pid: slot.process.map(|process| process.pid),
            alive: slot.alive,
            epoch: slot.epoch,
            tick: slot.tick,
            state: slot.state.to_string(),
            fault: slot.fault.as_ref().map(|(_, text)| text.clone()),
        }
    }
}
