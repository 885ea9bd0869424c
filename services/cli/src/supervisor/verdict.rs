//! What is said of a run that failed: who was lost first, and why.

use super::Supervisor;
use crate::binaries;
use crate::failure::{Failure, Status};
use crate::outcome::{Outcome, fault_of, label_of};
use crate::service_process::ServiceProcess;
use core::time::Duration;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_observation::Fault;
use mikoshi_runtime::{FaultCode, Role, SlotStatus, State};

/// A run in which nothing moves any more.
pub(super) struct Stall {
    pub(super) lasted: Duration,
    pub(super) culprits: Vec<ServiceId>,
}

impl Supervisor {
    /// What was lost first, and why. One that died without a word is the cause of what others report.
    pub(super) fn diagnose(&self, run: &RunSpec) -> Outcome {
        let board = self.member.board().statuses();
        let status_of = |process: &ServiceProcess| {
            board.iter().find(|status| status.role == Role::Service(process.service))
        };
        let rank = |process: &&ServiceProcess| {
            let said = status_of(process).and_then(|status| status.fault.as_ref()).map(|(code, _)| *code);
            let is_consequence =
                matches!(said, Some(FaultCode::PeerLost | FaultCode::Stopped | FaultCode::SupervisorLost));
            let by_us = process.ended.is_some_and(|ended| ended.by_us);
            (by_us, is_consequence, said.is_some())
        };
        let has_failed = |process: &&ServiceProcess| process.ended.is_none() || process.has_failed();
        let Some(cause) = self.children.processes().iter().filter(has_failed).min_by_key(rank) else {
            let failure =
                Failure { status: Status::Fault, message: "a service failed and ended well".to_owned() };
            return Outcome::Fault { failure, faults: vec![] };
        };
        // The cause first.
        let others = self.children.processes().iter().filter(has_failed);
        let others = others.filter(|process| process.service != cause.service);
        let failed = core::iter::once(cause).chain(others).filter_map(status_of);
        let faults = failed.filter_map(|status| fault_in(run, status)).collect();
        let failure = describe(cause, status_of(cause));
        Outcome::Fault { failure, faults }
    }
}

/// One failed process in words.
fn describe(process: &ServiceProcess, status: Option<&SlotStatus>) -> Failure {
    let exit = process.ended.and_then(|ended| ended.status);
    let code = exit.and_then(|exit| exit.code());
    let (mut exit_status, mut message) = (Status::Fault, process.label.clone());
    // Who ends without a reason says so to the others, but not why: its last words do.
    let reason = status.and_then(|status| {
        let reason = status.fault.as_ref().filter(|(code, _)| *code != FaultCode::Aborted);
        reason.map(|(_, text)| (status.tick, text))
    });
    match reason {
        Some((tick, text)) => message += &format!(" failed in tick {tick}: {text}"),
        // It refused the run before it took its place.
        None if code == Some(2) => {
            exit_status = Status::Usage;
            message += " can't run this scenario";
        }
        // It says itself what failed.
        None if code == Some(3) => message += " failed",
        None => {
            if let Some(simulator) = binaries::simulator_version().err().filter(|_| code == Some(127)) {
                return simulator.context(message);
            }
            message += " died";
            if let Some(status) = status.filter(|status| status.state >= State::Running) {
                message += &format!(" in tick {}", status.tick);
            }
            if let Some(exit) = exit {
                message += &format!(": {exit}");
            }
        }
    }
    message += &process.last_words();
    Failure { status: exit_status, message }
}

/// `board` is what it said before anybody was asked to stop.
pub(super) fn stalled(run: &RunSpec, stall: &Stall, board: &[SlotStatus]) -> Outcome {
    let is_culprit = |status: &&SlotStatus| match status.role {
        Role::Service(service) => stall.culprits.contains(&service),
        _ => false,
    };
    let told = |status: &SlotStatus| {
        let Role::Service(service) = status.role else { return String::new() };
        match status.state {
            State::Running => format!("{} in tick {}", label_of(run, service), status.tick),
            state => format!("{}, {state}", label_of(run, service)),
        }
    };
    let culprits: Vec<_> = board.iter().filter(is_culprit).map(told).collect();
    let message = format!(
        "nothing moved for {:.1} s; all wait for {}: frozen, or too slow",
        stall.lasted.as_secs_f64(),
        culprits.join(" and ")
    );
    let faults = board.iter().filter(is_culprit).filter_map(|status| match status.role {
        Role::Service(service) => Some(fault_of(run, service, status.tick, "stalled".to_owned())),
        _ => None,
    });
    Outcome::Fault { failure: Failure { status: Status::Fault, message }, faults: faults.collect() }
}

fn fault_in(run: &RunSpec, status: &SlotStatus) -> Option<Fault> {
    let Role::Service(service) = status.role else { return None };
    let code = status.fault.as_ref().map_or("died".to_owned(), |(code, _)| code.to_string());
    Some(fault_of(run, service, status.tick, code))
}
