//! Under which keys hosts speak: what a host may say is told by the beginning of the key.

use mikoshi_config::RunSpec;
use mikoshi_config::hosts::{BRIDGE, COORDINATOR};
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::Topic;

/// The keys of a run.
pub struct Keys {
    run: String,
    robots: Vec<String>,
}

impl Keys {
    /// Of this run.
    pub fn of(run: &RunSpec) -> Self {
        let robots = run.robots.iter().map(|robot| robot.member.name.clone()).collect();
        Self { run: run.scenario.name.clone(), robots }
    }

    /// Below which a service speaks.
    fn root_of(&self, service: ServiceId) -> String {
        let Self { run, robots } = self;
        match service {
            ServiceId::Bridge => format!("mikoshi/{run}/{BRIDGE}"),
            ServiceId::Coordinator => format!("mikoshi/{run}/{COORDINATOR}"),
            ServiceId::Servo(robot) => format!("mikoshi/{run}/servo/{}", robots[robot]),
        }
    }

    /// Of what a service says about a robot, or the team, to a host.
    pub fn of_topic(&self, service: ServiceId, topic: Topic, to: &str) -> String {
        let root = self.root_of(service);
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
    pub fn all_of(&self, host: &str, services: impl Iterator<Item = ServiceId>) -> Vec<String> {
        let mut all: Vec<_> = services.map(|service| format!("{}/**", self.root_of(service))).collect();
        all.push(format!("mikoshi/{}/host/{host}/**", self.run));
        all
    }
}
