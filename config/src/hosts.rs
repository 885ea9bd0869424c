//! Which computer each service runs on, where a team has more than one.

use crate::scenario::Scenario;
use mikoshi_ipc_types::ServiceId;
use serde::{Deserialize, Serialize};

/// One computer of the team.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Host {
    /// Name, unique in the team: its certificate bears it.
    pub name: String,
    /// What runs there: `bridge`, `coordinator`, and servos by the names of their robots.
    pub services: Vec<String>,
    /// For whom it stands by, should their host be lost. `coordinator`: a second one is ready here, and takes over. The
    /// name of a robot: what its servo needs to go on is kept here for the machine that takes the place of its own.
    #[serde(default)]
    pub standbys: Vec<String>,
    /// Where its link listens to the others, as `ADDRESS:PORT`.
    pub listen: String,
}

/// What the bridge is called in [`Host::services`].
pub const BRIDGE: &str = "bridge";
/// What the coordinator is called there.
pub const COORDINATOR: &str = "coordinator";

/// How frames travel between hosts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Link {
    /// By the clock: how often each frame is sent again, in case it was lost. Nothing else brings it back in time.
    pub repeats: u8,
    /// How long after the last time \[µs\]: what loses one datagram loses the next one, too.
    pub repeat_after_us: u32,
    /// The host whose tick is the clock; that of the bridge when absent, as it must be where the bridge owns the
    /// world.
    pub clock: Option<String>,
}

impl Default for Link {
    fn default() -> Self {
        Self { repeats: 1, repeat_after_us: 1000, clock: None }
    }
}

impl Scenario {
    /// The service that people call so.
    pub fn service_called(&self, name: &str) -> Option<ServiceId> {
        match name {
            BRIDGE => Some(ServiceId::Bridge),
            COORDINATOR => Some(ServiceId::Coordinator),
            robot => self.robots.iter().position(|member| member.name == robot).map(ServiceId::Servo),
        }
    }

    /// The index of the host of this service; none where all is on one.
    pub fn host_of(&self, service: ServiceId) -> Option<usize> {
        let runs_there =
            |host: &Host| host.services.iter().any(|name| self.service_called(name) == Some(service));
        self.hosts.iter().position(runs_there)
    }

    /// The index of the host that stands by for this service, if one does.
    pub fn standby_of(&self, service: ServiceId) -> Option<usize> {
        let stands_by =
            |host: &Host| host.standbys.iter().any(|name| self.service_called(name) == Some(service));
        self.hosts.iter().position(stands_by)
    }

    /// The indices of the hosts on which this service may be in charge, its own first. A robot's servo is where its
    /// robot is.
    pub fn places_of(&self, service: ServiceId) -> impl Iterator<Item = usize> + use<> {
        let standby = self.standby_of(service).filter(|_| service == ServiceId::Coordinator);
        self.host_of(service).into_iter().chain(standby)
    }

    /// The index of the host whose tick is the clock.
    pub fn clock_host(&self) -> Option<usize> {
        match &self.link.clock {
            Some(name) => self.hosts.iter().position(|host| host.name == *name),
            None => self.host_of(ServiceId::Bridge),
        }
    }
}
