//! `mikoshi-bridge-rapier`: a second physical world, as a process.
//!
//! ```sh
//! mikoshi run config/scenarios/hold.toml --bridge target/release/mikoshi-bridge-rapier
//! ```

use clap::Parser;
use mikoshi_bridge_rapier::World;
use mikoshi_ipc_types::ServiceId;
use mikoshi_physics::BridgeParticipant;
use mikoshi_process::{ServeError, ServiceArguments, serve};
use std::process::ExitCode;

fn main() -> ExitCode {
    let ServiceArguments { place } = ServiceArguments::parse();
    serve(
        &place,
        |_| Ok(ServiceId::Bridge),
        |run, transport| {
            BridgeParticipant::<_, World>::new(run, transport).map_err(|error| match error.is_fault() {
                true => ServeError::fault(error),
                false => ServeError::configuration(error),
            })
        },
    )
}
