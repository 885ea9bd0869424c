//! Hosts: every service on one of them, and all of them to be found.

use super::checks::Checks;
use crate::hosts::{BRIDGE, COORDINATOR};
use crate::scenario::Scenario;
use mikoshi_ipc_types::{MAX_ROBOTS, ServiceId};

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
    standbys(checks, scenario);
    for (name, count) in places {
        let found = format_args!("no host of {name:?}").to_string();
        checks.require(count > 0, "hosts", found, "each service on one host");
    }
}

/// A service has one standby at most, on another host than its own.
fn standbys(checks: &mut Checks, scenario: &Scenario) {
    let mut seen: Vec<&str> = vec![];
    for (index, host) in scenario.hosts.iter().enumerate() {
        for (at, name) in host.standbys.iter().enumerate() {
            let key = format!("hosts.{index}.standbys.{at}");
            let found = format!("{name:?}");
            let service = scenario.service_called(name).filter(|service| *service != ServiceId::Bridge);
            let expected = "the coordinator, or a robot; nothing stands by for the world";
            checks.require(service.is_some(), &key, &found, expected);
            let is_elsewhere = !host.services.contains(name);
            checks.require(is_elsewhere, &key, format_args!("{found}, which runs there"), "another host's");
            let is_first = !seen.contains(&&**name);
            checks.require(is_first, &key, format_args!("{found} again"), "one standby for each");
            seen.push(name);
        }
    }
    let clock = scenario.link.clock.as_ref().and_then(|_| scenario.clock_host());
    let is_lasting = clock.is_none() || clock != scenario.host_of(ServiceId::Coordinator);
    let has_standby = scenario.standby_of(ServiceId::Coordinator).is_some();
    let found = "the host of a coordinator that has a standby";
    checks.require(is_lasting || !has_standby, "link.clock", found, "a clock that stays where it is");
}
