//! Which services a scenario wants, and where: what systemd's generator writes down at boot and at each reload. The
//! scenario is the one place where cores and priorities are chosen.

use super::escape::instance;
use super::files::{HARDWARE_BRIDGE, SCENARIO, UNITS};
use super::run::host_of;
use crate::failure::Failure;
use core::fmt::Write as _;
use mikoshi_config::load_scenario;
use mikoshi_config::scenario::Scenario;
use mikoshi_ipc_types::ServiceId;
use mikoshi_resolution::placement_of;
use std::env;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// One unit that the target wants.
#[derive(Debug, PartialEq, Eq)]
struct Enlisted {
    /// Its name.
    unit: String,
    /// The file in which it is described.
    file: &'static str,
    /// What it is told beside that.
    placement: String,
}

/// Writes into `folder` what the target wants, and what each of that is granted.
///
/// # Errors
/// The scenario is wrong; a file can't be written. That there is no scenario is no error: then nothing is wanted.
pub fn generate(folder: &Path) -> Result<(), Failure> {
    let scenario = Path::new(SCENARIO);
    if !scenario.exists() {
        return Ok(());
    }
    let loaded = load_scenario(scenario, &[], None).map_err(Failure::usage)?;
    let here = env::current_exe().map_err(Failure::fault)?;
    let units = here.parent().and_then(Path::parent).unwrap_or(Path::new("/usr")).join(UNITS);
    let write = |path: PathBuf, text: &str| {
        let made = path.parent().map_or(Ok(()), fs::create_dir_all);
        made.and_then(|()| fs::write(&path, text))
            .map_err(|error| Failure::fault(error).context(path.display()))
    };
    let wants = folder.join("mikoshi.target.wants");
    fs::create_dir_all(&wants).map_err(|error| Failure::fault(error).context(wants.display()))?;
    let has_hardware = Path::new(HARDWARE_BRIDGE).exists();
    let host = host_of(&loaded.scenario, None)?;
    for Enlisted { unit, file, placement } in enlisted(&loaded.scenario, has_hardware, host) {
        let link = wants.join(&unit);
        symlink(units.join(file), &link).map_err(|error| Failure::fault(error).context(link.display()))?;
        if !placement.is_empty() {
            write(folder.join(format!("{unit}.d/10-placement.conf")), &placement)?;
        }
    }
    Ok(())
}

/// All units of this scenario; where there is hardware its bridge, which bears the first robot's name, comes in place
/// of the simulated world. On one host of several, those of its services, and the link.
fn enlisted(scenario: &Scenario, has_hardware: bool, host: Option<usize>) -> Vec<Enlisted> {
    let is_here = |service| host.is_none_or(|host| scenario.places_of(service).any(|place| place == host));
    let placement = |service| placement_text(scenario, service);
    let robots: Vec<_> = scenario.robots.iter().map(|robot| instance(&robot.name)).enumerate().collect();
    let hardware = robots.first().filter(|_| has_hardware);
    let (bridge, bridge_file) = match hardware {
        Some((_, robot)) => {
            (format!("mikoshi-hardware-bridge@{robot}.service"), "mikoshi-hardware-bridge@.service")
        }
        None => ("mikoshi-bridge.service".to_owned(), "mikoshi-bridge.service"),
    };
    let mut all = vec![];
    let named = |name: &'static str, placement| Enlisted { unit: name.to_owned(), file: name, placement };
    if host.is_some() {
        // The thread that carries frames has the priority of services; those that receive them have not.
        let right = scenario.placement.fifo_priority.map(|priority| {
            format!("# From {SCENARIO}, section [placement].\n[Service]\nLimitRTPRIO={priority}\n")
        });
        all.push(named("mikoshi-link.service", right.unwrap_or_default()));
        // Whoever starts the other hosts takes his time.
        let patience = "# There are several hosts.\n[Service]\nTimeoutStartSec=infinity\n";
        all.push(named("mikoshi-team.service", patience.to_owned()));
    }
    if is_here(ServiceId::Bridge) {
        // Everything is seen there.
        all.push(named("mikoshi-recorder.service", String::new()));
        all.push(Enlisted { unit: bridge, file: bridge_file, placement: placement(ServiceId::Bridge) });
    }
    let mut enlist_team = |coordinator: &'static str, servo: &'static str| {
        all.extend(
            is_here(ServiceId::Coordinator).then(|| named(coordinator, placement(ServiceId::Coordinator))),
        );
        let here = robots.iter().filter(|(index, _)| is_here(ServiceId::Servo(*index)));
        all.extend(here.map(|(index, robot)| Enlisted {
            unit: servo.replace('@', &format!("@{robot}")),
            file: servo,
            placement: placement(ServiceId::Servo(*index)),
        }));
    };
    enlist_team("mikoshi-coordinator.service", "mikoshi-servo@.service");
    if scenario.supervision.standby {
        enlist_team("mikoshi-coordinator-standby.service", "mikoshi-servo-standby@.service");
    }
    all
}

/// A core and a priority, and the right to it, as units have them.
fn placement_text(scenario: &Scenario, service: ServiceId) -> String {
    let core = placement_of(scenario).core_of(service);
    let mut text = String::new();
    // Writing to a string can't fail.
    if let Some(core) = core {
        let _ = writeln!(text, "CPUAffinity={core}");
    }
    if let Some(priority) = scenario.placement.fifo_priority {
        // The right to it only: with `CPUSchedulingPolicy=` systemd would set up its sandbox at this priority, and
        // the ticks of others on that core wait for it. The process takes it once it is set up.
        let _ = writeln!(text, "LimitRTPRIO={priority}");
    }
    if text.is_empty() { text } else { format!("# From {SCENARIO}, section [placement].\n[Service]\n{text}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scenario(set: &[(&str, &str)]) -> Scenario {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
        let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        let team = ("team".to_owned(), "two".to_owned());
        load_scenario(&file, &[vec![team], set].concat(), None).expect("a scenario").scenario
    }

    #[test]
    fn every_robot_has_a_servo_and_where_it_is_wished_a_standby() {
        let units = |scenario: &Scenario| {
            enlisted(scenario, false, None).into_iter().map(|one| one.unit).collect::<Vec<_>>()
        };
        let five = [
            "mikoshi-recorder.service",
            "mikoshi-bridge.service",
            "mikoshi-coordinator.service",
            "mikoshi-servo@A.service",
            "mikoshi-servo@B.service",
        ];
        assert_eq!(units(&scenario(&[("supervision.standby", "false")])), five);
        let standbys = [
            "mikoshi-coordinator-standby.service",
            "mikoshi-servo-standby@A.service",
            "mikoshi-servo-standby@B.service",
        ];
        assert_eq!(units(&scenario(&[("supervision.standby", "true")])), [&five[..], &standbys].concat());
        let hardware = enlisted(&scenario(&[]), true, None);
        assert_eq!(hardware[1].unit, "mikoshi-hardware-bridge@A.service");
        assert_eq!(hardware.len(), five.len());
    }

    #[test]
    fn a_host_of_several_has_its_own_services_and_a_link() {
        let host = |name: &str, services: &str, number: usize| {
            format!("{{ name = \"{name}\", services = [{services}], listen = \"10.0.0.{number}:7447\" }}")
        };
        let hosts =
            [host("stage", "\"bridge\", \"coordinator\"", 1), host("b", "\"B\"", 2), host("a", "\"A\"", 3)];
        let scenario =
            scenario(&[("hosts", &format!("[{}]", hosts.join(", "))), ("supervision.standby", "true")]);
        let units = |name: &str| {
            let host = host_of(&scenario, Some(name)).expect("it is one of them");
            enlisted(&scenario, false, host).into_iter().map(|one| one.unit).collect::<Vec<_>>()
        };
        let stage = ["link", "team", "recorder", "bridge", "coordinator", "coordinator-standby"];
        assert_eq!(units("stage"), stage.map(|name| format!("mikoshi-{name}.service")));
        let of_b =
            ["link", "team", "servo@B", "servo-standby@B"].map(|name| format!("mikoshi-{name}.service"));
        assert_eq!(units("b"), of_b);
        assert!(host_of(&scenario, Some("c")).is_err());
    }

    #[test]
    fn a_unit_has_the_core_and_the_priority_of_the_scenario() {
        let plain = enlisted(&scenario(&[]), false, None);
        assert!(plain.iter().all(|one| one.placement.is_empty()), "{plain:?}");
        let placed = scenario(&[("placement.servo_cores", "[2, 3]"), ("placement.fifo_priority", "20")]);
        let placed = enlisted(&placed, false, None);
        assert!(placed[1].placement.ends_with("[Service]\nLimitRTPRIO=20\n"));
        assert!(placed[4].placement.contains("\nCPUAffinity=3\n"), "{}", placed[4].placement);
    }
}
