//! What a link is told.

use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_resolution::Crossing;
use mikoshi_runtime::{Clock, TickSchedule};
use std::collections::BTreeSet;
use std::path::Path;

/// What a link is told.
pub struct Task<'a> {
    /// The run's directory on this host.
    pub directory: &'a Path,
    /// The run.
    pub run: &'a RunSpec,
    /// Its schedule.
    pub schedule: &'a TickSchedule,
    /// All that goes from host to host.
    pub crossings: &'a [Crossing],
    /// The index of this host.
    pub host: usize,
}

impl Task<'_> {
    /// Whether frames are to come in time rather than all.
    pub(crate) fn is_by_the_clock(&self) -> bool {
        matches!(self.schedule.clock(), Clock::Wall { .. })
    }

    /// The host whose tick is the clock: in lockstep, where the world is.
    pub(crate) fn clock(&self) -> usize {
        let scenario = &self.run.scenario;
        let clock = match self.is_by_the_clock() {
            true => scenario.clock_host(),
            false => scenario.host_of(ServiceId::Bridge),
        };
        clock.unwrap_or_default()
    }

    /// Whether a service may be in charge on this host.
    pub(crate) fn may_be_here(&self, service: ServiceId) -> bool {
        self.run.scenario.places_of(service).any(|host| host == self.host)
    }

    /// The other of the two hosts of a service that has a standby, if this is one of them.
    pub(crate) fn other_host_of(&self, service: ServiceId) -> Option<usize> {
        let scenario = &self.run.scenario;
        let (home, standby) = (scenario.host_of(service)?, scenario.standby_of(service)?);
        match self.host {
            host if host == home => Some(standby),
            host if host == standby => Some(home),
            _ => None,
        }
    }

    pub(crate) fn hosts_of_others(&self) -> impl Iterator<Item = usize> {
        let own = self.host;
        (0..self.run.scenario.hosts.len()).filter(move |host| *host != own)
    }

    /// Pairs of hosts that have something to say to each other.
    pub fn pairs(&self) -> BTreeSet<(usize, usize)> {
        let clock = self.clock();
        let of_frames = self.crossings.iter().map(|crossing| (crossing.from_host, crossing.to_host));
        let of_clock = (0..self.run.scenario.hosts.len()).map(|host| (clock, host));
        let scenario = &self.run.scenario;
        let of_standbys = ServiceId::of_team(self.run.robots.len())
            .filter_map(|service| Some((scenario.host_of(service)?, scenario.standby_of(service)?)));
        let ordered = |(one, other): (usize, usize)| (one.min(other), one.max(other));
        of_frames
            .chain(of_clock)
            .chain(of_standbys)
            .map(ordered)
            .filter(|(one, other)| one != other)
            .collect()
    }
}
