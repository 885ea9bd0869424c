//! `mikoshi-servo`: one robot's controller as a process.

use clap::Parser;
use mikoshi_ipc_types::ServiceId;
use mikoshi_process::{RobotServiceArguments, ServeError, serve};
use mikoshi_runtime::CountingAllocator;
use mikoshi_servo::ServoParticipant;
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    let RobotServiceArguments { place, robot: name } = RobotServiceArguments::parse();
    let index_of = |run: &mikoshi_config::RunSpec| {
        run.robots.iter().position(|robot| robot.member.name == name).ok_or_else(|| {
            let known: Vec<&str> = run.robots.iter().map(|robot| robot.member.name.as_str()).collect();
            ServeError::configuration(format!(
                "there is no robot `{name}` in this run; expected one of {}",
                known.join(", ")
            ))
        })
    };
    serve(
        &place,
        |run| Ok(ServiceId::Servo(index_of(run)?)),
        |run, transport| {
            ServoParticipant::new(run, index_of(run)?, transport).map_err(ServeError::configuration)
        },
    )
}
