//! `mikoshi-empty`: any service of a run, without what it computes: what remains is the exchange of frames.

use clap::Parser;
use mikoshi_ipc_types::ServiceId;
use mikoshi_process::{Place, ServeError, serve};
use mikoshi_resolution::tick_schedule;
use mikoshi_runtime::{CountingAllocator, Double};
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// A service that only passes numbers on.
#[derive(Debug, Parser)]
struct Arguments {
    #[command(flatten)]
    place: Place,
    /// Name of the robot, for its servo
    #[arg(long, value_name = "NAME")]
    robot: Option<String>,
    /// Which service, if it is no servo: bridge or coordinator
    #[arg(long, value_name = "NAME", required_unless_present = "robot")]
    service: Option<String>,
}

fn main() -> ExitCode {
    let Arguments { place, robot, service } = Arguments::parse();
    let of_run = |run: &mikoshi_config::RunSpec| {
        let name_of = |id: &ServiceId| match id.robot() {
            Some(robot) => run.robots[robot].member.name.clone(),
            None => id.to_string(),
        };
        let wanted = robot.as_deref().or(service.as_deref()).unwrap_or_default();
        let found = ServiceId::of_team(run.robots.len()).find(|id| name_of(id) == wanted);
        found.ok_or_else(|| ServeError::configuration(format!("this run has no service `{wanted}`")))
    };
    serve(&place, of_run, |run, transport| {
        let schedule = tick_schedule(run).map_err(ServeError::configuration)?;
        Double::new(&schedule, transport, of_run(run)?).map_err(ServeError::configuration)
    })
}
