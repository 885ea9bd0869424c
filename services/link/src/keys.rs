//! Under which keys hosts speak: what a host may say is told by the beginning of the key.

use mikoshi_config::RunSpec;
use mikoshi_config::hosts::{BRIDGE, COORDINATOR};
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::Topic;

/// The keys of a run.
pub struct Keys {
    run: String,
    robots: Vec<String>,
    /// By index.
    hosts: Vec<Host>,
    /// By service, in canonical order: the host where it lives.
    homes: Vec<(ServiceId, Option<usize>)>,
}

struct Host {
    name: String,
    /// Whose words may come from there.
    services: Vec<ServiceId>,
}

impl Keys {
    /// Of this run.
    pub fn of(run: &RunSpec) -> Self {
        let robots = run.robots.iter().map(|robot| robot.member.name.clone()).collect();
        let scenario = &run.scenario;
        let services = || ServiceId::of_team(run.robots.len());
        let of_host = |host: usize| {
            let speaks = |service: &ServiceId| {
                scenario.host_of(*service) == Some(host) || scenario.standby_of(*service) == Some(host)
            };
            Host { name: scenario.hosts[host].name.clone(), services: services().filter(speaks).collect() }
        };
        Self {
            run: scenario.name.clone(),
            robots,
            hosts: (0..scenario.hosts.len()).map(of_host).collect(),
            homes: services().map(|service| (service, scenario.host_of(service))).collect(),
        }
    }

    /// Below which a service speaks on a host. Where that only stands by for it, the key says so.
    fn root_of(&self, service: ServiceId, host: usize) -> String {
        let Self { run, robots, hosts, homes } = self;
        let is_home = homes.contains(&(service, Some(host)));
        let run = if is_home { run.clone() } else { format!("{run}/standby/{}", hosts[host].name) };
        match service {
            ServiceId::Bridge => format!("mikoshi/{run}/{BRIDGE}"),
            ServiceId::Coordinator => format!("mikoshi/{run}/{COORDINATOR}"),
            ServiceId::Servo(robot) => format!("mikoshi/{run}/servo/{}", robots[robot]),
        }
    }

    /// Of what a service keeps on one host for its successor on another.
    pub fn of_checkpoint(&self, service: ServiceId, from: usize, to: usize) -> String {
        format!("{}/checkpoint/{}", self.root_of(service, from), self.hosts[to].name)
    }

    /// Of what a service on a host says about a robot, or the team, to another host.
    pub fn of_topic(&self, service: ServiceId, from: usize, topic: Topic, to: &str) -> String {
        let root = self.root_of(service, from);
        match (service, topic.payload) {
            (ServiceId::Servo(_), payload) => format!("{root}/{payload}/{to}"),
            (_, payload) if payload.starts_with("team-state") => format!("{root}/team/{payload}/{to}"),
            (_, payload) => format!("{root}/{}/{payload}/{to}", self.robots[topic.robot]),
        }
    }

    /// Of the beat of the clock.
    pub fn beat(&self, host: &str) -> String {
        format!("mikoshi/{}/host/{host}/beat", self.run)
    }

    /// Of what a host says of itself.
    pub fn hello(&self, host: &str) -> String {
        format!("mikoshi/{}/host/{host}/hello", self.run)
    }

    /// All that a host may say.
    pub fn all_of(&self, host: usize) -> Vec<String> {
        let Host { name, services } = &self.hosts[host];
        let of_services = services.iter().map(|service| format!("{}/**", self.root_of(*service, host)));
        of_services.chain([format!("mikoshi/{}/host/{name}/**", self.run)]).collect()
    }
}
