//! `mikoshi-bridge`: the physical world as a process.

use clap::Parser;
use mikoshi_ipc_types::ServiceId;
use mikoshi_process::{ServeError, ServiceArguments, serve};
use mikoshi_sim_bridge::{BridgeParticipant, BuildBridgeError};
use std::process::ExitCode;

fn main() -> ExitCode {
    let ServiceArguments { run: directory } = ServiceArguments::parse();
    serve(
        &directory,
        |_| Ok(ServiceId::Bridge),
        |run, transport| {
            BridgeParticipant::new(run, transport).map_err(|error| match error {
                BuildBridgeError::World(problem) => ServeError::configuration(problem),
                BuildBridgeError::Connect(problem) => ServeError::fault(problem),
            })
        },
    )
}
