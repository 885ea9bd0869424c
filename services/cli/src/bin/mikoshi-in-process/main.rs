//! `mikoshi-in-process`: all services of a run in one thread. `mikoshi run --in-process`,
//! `mikoshi replay` and `mikoshi render` become it.

mod render;

use core::ops::ControlFlow;
use mikoshi::arguments::{ReplayArguments, RunArguments};
use mikoshi::commands::run::run;
use mikoshi::failure::{Failure, Status};
use mikoshi::interrupts::Interrupts;
use mikoshi::observer::RunObserver;
use mikoshi::outcome::Outcome;
use mikoshi::output_directory::OutputDirectory;
use mikoshi::prepare::Prepared;
use mikoshi::replay::replay;
use mikoshi_config::RunSpec;
use mikoshi_coordinator::CoordinatorParticipant;
use mikoshi_ipc_types::ServiceId;
use mikoshi_observation::{Observation, TeamTap};
use mikoshi_physics::{BridgeParticipant, BuildBridgeError};
use mikoshi_runtime::{Clock, InMemoryHub, InMemoryTransport, Replaceable, run_in_one_thread};
use mikoshi_servo::ServoParticipant;
use mikoshi_sim_bridge::{World, world_xml};
use mujoco_rs::mujoco_version;
use std::fs;
use std::process::ExitCode;

fn main() -> ExitCode {
    mikoshi::main_of_in_process(
        &format!("MuJoCo {}", mujoco_version()),
        run_in_process,
        replay_in_process,
        render::render,
    )
}

fn replay_in_process(arguments: &ReplayArguments) -> Result<Status, Failure> {
    replay(arguments, participant)
}

fn run_in_process(arguments: &RunArguments) -> Result<Status, Failure> {
    run(arguments, execute)
}

fn execute(
    prepared: &Prepared,
    out: &OutputDirectory,
    observer: &mut RunObserver,
) -> Result<Outcome, Failure> {
    let interrupts = Interrupts::listen().map_err(Failure::fault)?;
    let (run, hub) = (&prepared.run, InMemoryHub::new(prepared.schedule.clone()));
    let xml = world_xml(run).map_err(Failure::usage)?;
    fs::write(out.world(), xml).map_err(|error| Failure::fault(error).context(out.world().display()))?;
    let mut team_tap = TeamTap::new(&hub.tap(), run.robots.len(), Clock::Lockstep).map_err(Failure::fault)?;
    let mut participants = match participants(prepared, &hub) {
        Ok(participants) => participants,
        // Whoever looks for the reason needs what there is: the world, for one.
        Err(failure) if failure.status == Status::Fault => {
            return Ok(Outcome::Fault { failure, faults: vec![] });
        }
        Err(failure) => return Err(failure),
    };
    let mut observation = Observation::for_team(run.robots.len());

    let mut early_end = None;
    let ended = run_in_one_thread(&prepared.schedule, &mut participants, run.ticks, |_| {
        let observed = match team_tap.try_take_tick(&mut observation) {
            Ok(true) => {
                observer.observe(&observation);
                Ok(())
            }
            Ok(false) => Err(Failure::fault("a tick without all of its frames")),
            Err(error) => Err(Failure::fault(error)),
        };
        early_end = match (observed, interrupts.received()) {
            (Err(failure), _) => Some(Outcome::Fault { failure, faults: vec![] }),
            (Ok(()), signal) => signal.map(Outcome::Interrupted),
        };
        if early_end.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    Ok(match (ended, early_end) {
        (Err(fault), _) => Outcome::of_run_fault(run, &fault),
        (Ok(_), Some(outcome)) => outcome,
        (Ok(_), None) => Outcome::Completed,
    })
}

fn participants(prepared: &Prepared, hub: &InMemoryHub) -> Result<Vec<Box<dyn Replaceable>>, Failure> {
    let services = prepared.schedule.services().into_iter();
    services.map(|service| participant(&prepared.run, service, &hub.transport(service))).collect()
}

fn participant(
    run: &RunSpec,
    service: ServiceId,
    transport: &InMemoryTransport,
) -> Result<Box<dyn Replaceable>, Failure> {
    Ok(match service {
        ServiceId::Bridge => Box::new(BridgeParticipant::<_, World>::new(run, transport).map_err(
            |error: BuildBridgeError| {
                if error.is_fault() { Failure::fault(error) } else { Failure::usage(error) }
            },
        )?),
        ServiceId::Coordinator => {
            Box::new(CoordinatorParticipant::new(run, transport).map_err(Failure::usage)?)
        }
        ServiceId::Servo(robot) => {
            Box::new(ServoParticipant::new(run, robot, transport).map_err(Failure::usage)?)
        }
    })
}
