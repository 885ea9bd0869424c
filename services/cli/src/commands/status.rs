//! `mikoshi status`: which runs there are, and which processes they have.

use crate::arguments::StatusArguments;
use crate::binaries::kind_of;
use crate::failure::Failure;
use crate::print::print_out;
use crate::table;
use mikoshi_config::RunSpec;
use mikoshi_resolution::read_run;
use mikoshi_runtime::{Board, FoundRun, Role, RunDirectory, SlotStatus, State};
use serde::Serialize;

/// Prints all runs of this user.
///
/// # Errors
/// The folder of the runs can't be read.
pub fn status(arguments: &StatusArguments) -> Result<(), Failure> {
    let runs = runs()?;
    if arguments.json {
        let mut text = serde_json::to_string_pretty(&runs).map_err(Failure::fault)?;
        text.push('\n');
        print_out(&text);
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
}

/// One process of a run.
#[derive(Debug, Serialize)]
struct ProcessStatus {
    service: String,
    robot: Option<String>,
    pid: Option<u32>,
    alive: bool,
    epoch: u64,
    tick: u64,
    state: String,
    fault: Option<String>,
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
        }
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
        format!("run {}{of_scenario}{hint}\n{processes}", self.run)
    }
}

impl ProcessStatus {
    fn of(slot: &SlotStatus, run: Option<&RunSpec>) -> Self {
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
