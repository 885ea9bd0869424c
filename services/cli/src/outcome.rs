//! How carrying out a run ended.

use crate::binaries::kind_of;
use crate::failure::Failure;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_observation::{Fault, Swap};
use mikoshi_runtime::RunFault;

/// How carrying out a run ended.
#[derive(Debug)]
pub enum Outcome {
    /// All ticks were executed and observed.
    Completed,
    /// This signal asked for an end.
    Interrupted(u8),
    /// Something failed.
    Fault {
        /// For people.
        failure: Failure,
        /// For scripts.
        faults: Vec<Fault>,
    },
}

impl Outcome {
    /// The fault of one service.
    pub fn of_run_fault(run: &RunSpec, fault: &RunFault) -> Self {
        let RunFault { service, tick, error } = *fault;
        Self::Fault {
            failure: Failure::fault(format!("{} failed in tick {tick}: {error}", label_of(run, service))),
            faults: vec![fault_of(run, service, tick, error.code().to_string())],
        }
    }
}

/// What people call a service: `bridge`, `servo of robot A`.
pub(crate) fn label_of(run: &RunSpec, service: ServiceId) -> String {
    robot_name(run, service).map_or_else(|| service.to_string(), |robot| format!("servo of robot {robot}"))
}

/// The service that people call so: `bridge`, `coordinator`, or a robot's name for its servo.
///
/// # Errors
/// What there is, in words.
pub(crate) fn service_named(run: &RunSpec, name: &str) -> Result<ServiceId, String> {
    let services = || ServiceId::of_team(run.robots.len());
    let name_of = |service| robot_name(run, service).map_or_else(|| service.to_string(), str::to_owned);
    services().find(|service| name_of(*service) == name).ok_or_else(|| {
        let expected: Vec<_> = services().map(name_of).collect();
        format!("there is no service {name:?}; expected one of {}", expected.join(", "))
    })
}

/// What summaries say of a fault.
pub(crate) fn fault_of(run: &RunSpec, service: ServiceId, tick: u64, code: String) -> Fault {
    let robot = robot_name(run, service).map(str::to_owned);
    Fault { tick, service: kind_of(service).to_owned(), robot, code }
}

/// What summaries say of a process that was replaced. In lockstep the others wait: no tick is lost.
pub(crate) fn swap_of(run: &RunSpec, service: ServiceId, tick: u64, cause: String) -> Swap {
    let robot = robot_name(run, service).map(str::to_owned);
    Swap { tick, service: kind_of(service).to_owned(), robot, cause, ticks_lost: 0 }
}

/// The name of the robot that a service controls.
pub(crate) fn robot_name(run: &RunSpec, service: ServiceId) -> Option<&str> {
    service.robot().and_then(|robot| run.robots.get(robot)).map(|robot| robot.member.name.as_str())
}
