//! Hosts of a team: every service on one of them, each of which can be found.

use mikoshi_config::{LoadConfigError, LoadedScenario, load_scenario};
use mikoshi_ipc_types::ServiceId;
use std::path::Path;

const STAGE: &str = r#"{ name = "stage", services = ["bridge", "coordinator"], listen = "10.0.0.1:7447" }"#;
const ROBOTS: &str = r#"{ name = "robots", services = ["A", "B"], listen = "[fd00::2]:7447" }"#;

fn load(hosts: &[&str], more: &[(&str, &str)]) -> Result<LoadedScenario, LoadConfigError> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/hold.toml");
    let hosts = format!("[{}]", hosts.join(", "));
    let set = [("team", "two"), ("hosts", &*hosts)];
    let set: Vec<_> =
        set.iter().chain(more).map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    load_scenario(&file, &set, None)
}

#[test]
fn services_are_found_on_their_hosts_and_the_worlds_is_the_clock() {
    let scenario = load(&[STAGE, ROBOTS], &[]).expect("it is right").scenario;
    let hosts = ServiceId::of_team(2).map(|service| scenario.host_of(service)).collect::<Vec<_>>();
    assert_eq!(hosts, [Some(0), Some(1), Some(1), Some(0)]);
    assert_eq!(scenario.clock_host(), Some(0));
    let other = load(&[STAGE, ROBOTS], &[("link.clock", "robots")]).expect("it is right").scenario;
    assert_eq!(other.clock_host(), Some(1));
    let alone = load(&[], &[]).expect("it is right").scenario;
    assert_eq!((alone.host_of(ServiceId::Bridge), alone.clock_host()), (None, None));
}

#[test]
fn what_is_wrong_with_hosts_is_said_by_key() {
    let host = |name: &str, services: &str, listen: &str| {
        format!("{{ name = \"{name}\", services = [{services}], listen = \"{listen}\" }}")
    };
    let at = "10.0.0.1:7447";
    for (hosts, key, problem) in [
        (vec![STAGE.to_owned()], "hosts", "no host of \"A\""),
        (vec![STAGE.to_owned(), host("robots", r#""A", "B", "A""#, at)], "hosts.1.services.2", "\"A\" again"),
        (
            vec![STAGE.to_owned(), host("robots", r#""A", "B", "bridge""#, at)],
            "hosts.1.services.2",
            "\"bridge\" again",
        ),
        (
            vec![STAGE.to_owned(), host("robots", r#""A", "B", "C""#, at)],
            "hosts.1.services.2",
            "one of bridge",
        ),
        (vec![STAGE.to_owned(), host("stage", r#""A", "B""#, at)], "hosts.1.name", "\"stage\" again"),
        (vec![STAGE.to_owned(), host("a/b", r#""A", "B""#, at)], "hosts.1.name", "letters, digits"),
        (vec![STAGE.to_owned(), host("robots", r#""A", "B""#, "10.0.0.1")], "hosts.1.listen", "ADDRESS:PORT"),
        (
            vec![STAGE.to_owned(), host("robots", r#""A", "B""#, "10.0.0.1:0")],
            "hosts.1.listen",
            "ADDRESS:PORT",
        ),
        (
            vec![STAGE.to_owned(), host("robots", r#""A", "B""#, "x?rel=0:1")],
            "hosts.1.listen",
            "ADDRESS:PORT",
        ),
    ] {
        let hosts: Vec<_> = hosts.iter().map(String::as_str).collect();
        let error = load(&hosts, &[]).err().unwrap_or_else(|| panic!("{hosts:?} is refused")).to_string();
        assert!(error.contains(key) && error.contains(problem), "{error} lacks {key} or {problem}");
    }
    for (key, value) in [("link.clock", "nobody"), ("link.repeats", "9"), ("slow_motion", "0.5")] {
        let error = load(&[STAGE, ROBOTS], &[(key, value)]).expect_err("it is refused").to_string();
        assert!(error.contains(key), "{error}");
    }
}

#[test]
fn a_host_stands_by_for_services_of_others() {
    let with = |standbys: [&str; 2], more: &[(&str, &str)]| {
        let host = |host: &str, standbys: &str| host.replace(" }", &format!(", standbys = [{standbys}] }}"));
        load(&[&host(STAGE, standbys[0]), &host(ROBOTS, standbys[1])], more)
    };
    let scenario = with([r#""A""#, r#""coordinator""#], &[]).expect("it is right").scenario;
    let standbys = ServiceId::of_team(2).map(|service| scenario.standby_of(service)).collect::<Vec<_>>();
    assert_eq!(standbys, [None, Some(0), None, Some(1)]);
    let places = |service| scenario.places_of(service).collect::<Vec<_>>();
    assert_eq!(places(ServiceId::Coordinator), [0, 1]);
    assert_eq!(places(ServiceId::Servo(0)), [1], "a servo is where its robot is");
    for (standbys, key, problem) in [
        ([r#""bridge""#, ""], "hosts.0.standbys.0", "nothing stands by for the world"),
        ([r#""C""#, ""], "hosts.0.standbys.0", "the coordinator, or a robot"),
        ([r#""coordinator""#, ""], "hosts.0.standbys.0", "which runs there"),
        ([r#""A", "A""#, ""], "hosts.0.standbys.1", "one standby for each"),
    ] {
        let error = with(standbys, &[]).expect_err("it is refused").to_string();
        assert!(error.contains(key) && error.contains(problem), "{error} lacks {key} or {problem}");
    }
    let clock = with(["", r#""coordinator""#], &[("link.clock", "stage")]).expect_err("it would stand still");
    assert!(clock.to_string().contains("link.clock"), "{clock}");
}
