//! What goes from host to host, and who has a place on which.

use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{Output, TickSchedule};
use std::collections::BTreeSet;

/// A frame that goes from one host to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Crossing {
    /// What.
    pub output: Output,
    /// Whose.
    pub from: ServiceId,
    /// The host on which that lives.
    pub from_host: usize,
    /// The host to which it goes.
    pub to_host: usize,
    /// Whether a service there waits for it, and not only an observer.
    pub is_awaited: bool,
}

/// All that goes from host to host in a tick: what services elsewhere wait for; and to the host of the bridge, where a
/// run is recorded, everything. What is true of the world stays there. A service that has places on two hosts says it on
/// one of them, and hears it on both.
pub fn crossings(run: &RunSpec, schedule: &TickSchedule) -> Vec<Crossing> {
    let scenario = &run.scenario;
    let recording = scenario.host_of(ServiceId::Bridge);
    let of_output = |(from, output): (ServiceId, &Output)| {
        let consumers =
            schedule.consumers_of(output.topic).flat_map(|(consumer, _)| scenario.places_of(consumer));
        let consumers: BTreeSet<usize> = consumers.collect();
        let hosts: BTreeSet<usize> = consumers.iter().copied().chain(recording).collect();
        let from_host = |from_host: usize| {
            let others = hosts.iter().copied().filter(move |host| *host != from_host);
            let is_awaited = |host| consumers.contains(&host);
            others.map(move |to_host| Crossing {
                output: *output,
                from,
                from_host,
                to_host,
                is_awaited: is_awaited(to_host),
            })
        };
        scenario.places_of(from).flat_map(from_host).collect::<Vec<_>>()
    };
    schedule.outputs().flat_map(of_output).collect()
}

/// The services that have a place on the board of this host: those that live there, those whose words come there, and
/// the bridge, by whose tick all go. In the order of the schedule.
pub fn services_on_board(run: &RunSpec, schedule: &TickSchedule, host: usize) -> Vec<ServiceId> {
    let crossings = crossings(run, schedule);
    let comes = |service: &ServiceId| {
        crossings.iter().any(|crossing| crossing.from == *service && crossing.to_host == host)
    };
    let has_place = |service: &ServiceId| {
        *service == ServiceId::Bridge
            || run.scenario.places_of(*service).any(|place| place == host)
            || comes(service)
    };
    schedule.services().into_iter().filter(has_place).collect()
}
