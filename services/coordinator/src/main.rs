//! `mikoshi-coordinator`: the team's controller as a process.

use clap::Parser;
use mikoshi_coordinator::CoordinatorParticipant;
use mikoshi_ipc_types::ServiceId;
use mikoshi_process::{ServeError, ServiceArguments, serve};
use mikoshi_runtime::CountingAllocator;
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    let arguments = ServiceArguments::parse();
    serve(
        &arguments.place,
        |_| Ok(ServiceId::Coordinator),
        |run, transport| CoordinatorParticipant::new(run, transport).map_err(ServeError::configuration),
    )
}
