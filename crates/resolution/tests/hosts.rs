//! What goes from host to host follows from who waits for what.

use mikoshi_config::load_scenario;
use mikoshi_ipc_types::ServiceId;
use mikoshi_resolution::{crossings, resolve, services_on_board, tick_schedule};
use std::path::Path;

#[test]
fn a_frame_goes_to_those_who_wait_for_it_and_to_where_the_run_is_recorded() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
    let host = |name: &str, service: &str| {
        format!("{{ name = \"{name}\", services = [\"{service}\"], listen = \"{name}:7447\" }}")
    };
    let hosts = [host("stage", "bridge"), host("head", "coordinator"), host("a", "A"), host("b", "B")];
    let set = [("team", "two".to_owned()), ("hosts", format!("[{}]", hosts.join(", ")))];
    let set = set.map(|(key, value)| (key.to_owned(), value));
    let run = resolve(&load_scenario(&file, &set, None).expect("it is right")).expect("it can be run");
    let schedule = tick_schedule(&run).expect("it can be scheduled");
    let found: Vec<_> = crossings(&run, &schedule)
        .iter()
        .map(|crossing| {
            let is_awaited = if crossing.is_awaited { "" } else { " to be seen" };
            format!("{} {}>{}{is_awaited}", crossing.output.topic, crossing.from_host, crossing.to_host)
        })
        .collect();
    assert_eq!(
        found,
        [
            "sensors[0] 0>2",
            "sensors[1] 0>3",
            "robot-state[0] 2>0 to be seen",
            "robot-state[0] 2>1",
            "robot-state[1] 3>0 to be seen",
            "robot-state[1] 3>1",
            "team-command[0] 1>0 to be seen",
            "team-command[0] 1>2",
            "team-command[1] 1>0 to be seen",
            "team-command[1] 1>3",
            "team-state[0] 1>0 to be seen",
            "joint-command[0] 2>0",
            "joint-command[1] 3>0",
        ],
        "what is true of the world stays where it is"
    );
    let (bridge, head) = (ServiceId::Bridge, ServiceId::Coordinator);
    let [a, b] = [0, 1].map(ServiceId::Servo);
    let boards = [0, 1, 2, 3].map(|host| services_on_board(&run, &schedule, host));
    assert_eq!(
        boards,
        [vec![bridge, a, b, head], vec![bridge, a, b, head], vec![bridge, a, head], vec![bridge, b, head]]
    );
}

#[test]
fn what_a_coordinator_hears_and_says_goes_to_and_from_the_host_that_stands_by_for_it_too() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
    let host = |name: &str, service: &str, standbys: &str| {
        format!(
            "{{ name = \"{name}\", services = [\"{service}\"], listen = \"{name}:7447\", standbys = [{standbys}] }}"
        )
    };
    let hosts = [
        host("stage", "bridge", ""),
        host("head", "coordinator", "\"B\""),
        host("a", "A", "\"coordinator\""),
        host("b", "B", ""),
    ];
    let set = [("team", "two".to_owned()), ("hosts", format!("[{}]", hosts.join(", ")))];
    let set = set.map(|(key, value)| (key.to_owned(), value));
    let run = resolve(&load_scenario(&file, &set, None).expect("it is right")).expect("it can be run");
    let schedule = tick_schedule(&run).expect("it can be scheduled");
    let found: Vec<_> = crossings(&run, &schedule)
        .iter()
        .filter(|crossing| crossing.from_host == 2 || crossing.to_host == 2)
        .map(|crossing| format!("{} {}>{}", crossing.output.topic, crossing.from_host, crossing.to_host))
        .collect();
    assert_eq!(
        found,
        [
            "sensors[0] 0>2",
            "robot-state[0] 2>0",
            "robot-state[0] 2>1",
            "robot-state[1] 3>2",
            "team-command[0] 1>2",
            "team-command[0] 2>0",
            "team-command[1] 2>0",
            "team-command[1] 2>3",
            "team-state[0] 2>0",
            "joint-command[0] 2>0",
        ]
    );
    let (bridge, head) = (ServiceId::Bridge, ServiceId::Coordinator);
    let [a, b] = [0, 1].map(ServiceId::Servo);
    assert_eq!(services_on_board(&run, &schedule, 2), [bridge, a, b, head]);
}
