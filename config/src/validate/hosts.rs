//! Hosts: every service on one of them, and all of them to be found.

use super::checks::Checks;
use crate::hosts::{BRIDGE, COORDINATOR};
use crate::scenario::Scenario;
use mikoshi_ipc_types::MAX_ROBOTS;

/// A service on each.
const MAX_HOSTS: usize = MAX_ROBOTS + 2;
/// More would only be in each other's way.
const MAX_REPEATS: u8 = 4;

pub(super) fn hosts(checks: &mut Checks, scenario: &Scenario) {
    let link = &scenario.link;
    let expected = format!("at most {MAX_REPEATS}");
    checks.require(link.repeats <= MAX_REPEATS, "link.repeats", link.repeats, expected);
    if let Some(clock) = &link.clock {
        let is_known = scenario.hosts.iter().any(|host| host.name == *clock);
        checks.require(is_known, "link.clock", format_args!("{clock:?}"), "the name of a host");
    }
    if scenario.hosts.is_empty() {
        return;
    }
    checks.count("hosts", scenario.hosts.len(), MAX_HOSTS, "hosts");
    checks
        .unique(scenario.hosts.iter().map(|host| host.name.as_str()), |index| format!("hosts.{index}.name"));
    let mut places: Vec<(&str, usize)> = [BRIDGE, COORDINATOR].map(|name| (name, 0)).into();
    places.extend(scenario.robots.iter().map(|member| (member.name.as_str(), 0)));
    let known = places.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    for (index, host) in scenario.hosts.iter().enumerate() {
        checks.name(format_args!("hosts.{index}.name"), &host.name);
        let is_address = host.listen.rsplit_once(':').is_some_and(|(address, port)| {
            let is_plain = |c: char| c.is_ascii_alphanumeric() || ".-:[]".contains(c);
            !address.is_empty()
                && address.chars().all(is_plain)
                && port.parse::<u16>().is_ok_and(|port| port > 0)
        });
        let found = format_args!("{:?}", host.listen).to_string();
        checks.require(is_address, format_args!("hosts.{index}.listen"), found, "ADDRESS:PORT");
        for (at, service) in host.services.iter().enumerate() {
            let key = format!("hosts.{index}.services.{at}");
            match places.iter_mut().find(|(name, _)| name == service) {
                Some((_, count)) => {
                    *count += 1;
                    let found = format_args!("{service:?} again").to_string();
                    checks.require(*count == 1, key, found, "each service on one host");
                }
                None => {
                    let found = format_args!("{service:?}").to_string();
                    checks.require(false, key, found, format_args!("one of {known}"));
                }
            }
        }
    }
    for (name, count) in places {
        let found = format_args!("no host of {name:?}").to_string();
        checks.require(count > 0, "hosts", found, "each service on one host");
    }
}
