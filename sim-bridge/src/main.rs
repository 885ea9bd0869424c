//! `mikoshi-bridge`: the physical world as a process.

use clap::Parser;
use mikoshi_ipc_types::ServiceId;
use mikoshi_physics::BridgeParticipant;
use mikoshi_process::{ServeError, ServiceArguments, serve};
use mikoshi_resolution::write_world;
use mikoshi_runtime::CountingAllocator;
use mikoshi_sim_bridge::{World, world_xml};
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    let ServiceArguments { place } = ServiceArguments::parse();
    serve(
        &place,
        |_| Ok(ServiceId::Bridge),
        |run, transport| {
            // Before the simulator sees it: if it rejects the world, one wants to look at it.
            let xml = world_xml(run).map_err(ServeError::configuration)?;
            write_world(place.run(), &xml).map_err(ServeError::fault)?;
            BridgeParticipant::<_, World>::new(run, transport).map_err(|error| match error.is_fault() {
                true => ServeError::fault(error),
                false => ServeError::configuration(error),
            })
        },
    )
}
