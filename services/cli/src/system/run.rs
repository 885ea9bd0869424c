//! The run that the services take part in: made before the first of them, removed after the last.

use super::RUN;
use crate::arguments::PrepareArguments;
use crate::failure::Failure;
use crate::prepare::prepare_paced;
use crate::wall_clock::pause;
use core::time::Duration;
use mikoshi_config::Scenario;
use mikoshi_ipc_types::ServiceId;
use mikoshi_resolution::{services_on_board, write_run};
use mikoshi_runtime::{Board, Clock, Domain, Role, RunDirectory, State, required_bytes};
use std::path::PathBuf;

/// How often it is looked whether the team goes.
const LOOK: Duration = Duration::from_millis(20);

/// Makes the run of a scenario. Ticks are paced by the clock, and whoever dies gets a successor.
///
/// # Errors
/// Whatever is wrong with the scenario: bad usage. There is no room for it; it is carried out already.
pub fn prepare(arguments: &PrepareArguments) -> Result<(), Failure> {
    let prepared = prepare_paced(&arguments.scenario, !arguments.lockstep)?;
    let host = host_of(&prepared.run.scenario, arguments.host.as_deref())?;
    Domain::check_space(required_bytes(&prepared.schedule)).map_err(Failure::fault)?;
    let directory = RunDirectory::keep(&RunDirectory::default_base(), RUN).map_err(Failure::fault)?;
    write_run(directory.path(), &prepared.run).map_err(Failure::fault)?;
    // The recorder comes and goes: nobody waits for one that is not there.
    let board = match host {
        Some(host) => {
            let services = services_on_board(&prepared.run, &prepared.schedule, host);
            let has_standby = |service: &ServiceId| prepared.run.scenario.standby_of(*service).is_some();
            let reserved: Vec<_> = services.iter().copied().filter(has_standby).collect();
            Board::create_for_host(directory.path(), &services, &reserved)
        }
        None => Board::create(directory.path(), &prepared.schedule.services(), false),
    };
    let board = board.map_err(Failure::fault)?;
    board.set_succession(true);
    if matches!(prepared.schedule.clock(), Clock::Wall { .. }) {
        board.set_paced();
    }
    directory.leave_as_it_is();
    Ok(())
}

/// The index of the host that this machine is, by this name or its own; none if the run has one host.
///
/// # Errors
/// It is none of them, or there are none: bad usage.
pub fn host_of(scenario: &Scenario, name: Option<&str>) -> Result<Option<usize>, Failure> {
    let hosts = &scenario.hosts;
    if hosts.is_empty() {
        return match name {
            Some(name) => Err(Failure::usage(format!("--host {name}: this scenario has no hosts"))),
            None => Ok(None),
        };
    }
    let own = rustix::system::uname().nodename().to_string_lossy().into_owned();
    let name = name.unwrap_or(&own);
    let found = hosts.iter().position(|host| host.name == name);
    let known = || hosts.iter().map(|host| host.name.as_str()).collect::<Vec<_>>().join(", ");
    found.map(Some).ok_or_else(|| {
        Failure::usage(format!("found a host called {name:?}, expected one of {} (--host)", known()))
    })
}

/// Removes it.
///
/// # Errors
/// A file can't be removed.
pub fn clear() -> Result<(), Failure> {
    RunDirectory::remove_kept(&path()).map_err(Failure::fault)
}

/// Waits until every service executes ticks, or has executed all.
///
/// # Errors
/// There is no such run.
pub fn wait_until_it_goes() -> Result<(), Failure> {
    let board = Board::open(&path()).map_err(Failure::fault)?;
    let goes = |(role, state): (Role, State)| match role {
        Role::Service(_) => matches!(state, State::Running | State::Done),
        Role::Supervisor | Role::Tap | Role::Link => true,
    };
    while !board.states().all(goes) {
        pause(LOOK);
    }
    Ok(())
}

/// Where it is.
pub fn path() -> PathBuf {
    RunDirectory::default_base().join(RUN)
}
