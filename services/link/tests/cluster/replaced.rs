//! Hosts that are lost for good, and who goes on in their place.

use crate::or_skip;
use crate::team::{HEAD, STAGE, Team, program, robot_host};
use crate::walk::{stopped_by, tell, walk_with};
use crate::wire::Way;
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::State;
use serde_json::Value;
use std::process::{Command, Stdio};

/// In it the team walks.
const LOST_TICK: u64 = 900;
/// Ticks in which the team has come to stand.
const STAND_TICKS: u64 = 600;
/// Ticks in which what must happen has long happened.
const AMPLE_TICKS: u64 = 1500;

/// It stopped, went on, and stopped.
const STOPS: [&str; 2] = ["input-stale", "operator-stop"];

/// Lets the team go on, and stops it: it stops only if it had gone on.
fn goes_on_and_stops(team: &mut Team<'_>, operator: &str) {
    // It is heard when the team stands.
    for _ in 0..3 {
        team.host(operator).run(&program("mikoshi"), &["resume"]);
        let said = team.tick(STAGE);
        team.wait_for_tick(said + 100);
    }
    team.host(operator).run(&program("mikoshi"), &["stop"]);
}

/// Waits until a service executes ticks on a host, and is in the present one.
fn wait_until_it_goes(team: &Team<'_>, host: &str, service: ServiceId) {
    let goes = || {
        let (state, tick) = team.state(host, service);
        state == State::Running && tick + 8 > team.tick(host)
    };
    team.wait_until(AMPLE_TICKS, goes);
    assert!(
        goes(),
        "{service} on {host}: {:?} of {}\n{}",
        team.state(host, service),
        team.tick(host),
        team.words()
    );
}

/// What the old host of the coordinator would say to robot B, with its own certificate.
fn says_late(team: &Team<'_>, certificates: &std::path::Path) -> Value {
    let incarnation = team.report(HEAD)["incarnation"].to_string();
    let mut hostile: Command = team.host(HEAD).command(&program("examples/hostile"));
    hostile.arg("--certificates").arg(certificates).args(["--host", HEAD, "--connect", "10.77.0.4:7447"]);
    hostile.args(["--key", "mikoshi/service/coordinator/B/team-command/robot-b", "--kind", "replay"]);
    hostile.args(["--run", crate::team::RUN, "--robot", "1", "--incarnation", &incarnation]);
    let said = hostile.stderr(Stdio::null()).output().expect("it can be started");
    serde_json::from_slice(&said.stdout).expect("it says what it did")
}

#[test]
fn a_coordinator_whose_host_is_lost_has_a_successor_on_another_and_the_old_one_is_refused() {
    stopped_by(&STOPS, loses_the_coordinators_host);
}

fn loses_the_coordinators_host() -> Value {
    let (a, b) = (robot_host("A"), robot_host("B"));
    let plan = walk_with(2, 0.06, &["slow_motion=3"], &[(&a, "coordinator")]);
    let mut team = or_skip!(Team::gather(&plan), Value::Null);
    let head = team.cluster.index_of(HEAD);
    team.cluster.wire.set(head, 0..4, |way| *way = Way::bad(2.0));
    team.start();
    team.wait_for_tick(LOST_TICK);
    // It is not dead, only of no use: whether it comes back nobody knows.
    team.signal(HEAD, libc::SIGSTOP);
    let has_moved = || team.moves(&a, ServiceId::Coordinator) == 1;
    team.wait_until(AMPLE_TICKS, has_moved);
    assert!(has_moved(), "{}\n{}", team.standby(&a, "coordinator"), team.words());
    wait_until_it_goes(&team, &a, ServiceId::Coordinator);
    let lost_ticks = team.tick(STAGE) - LOST_TICK;
    team.signal(HEAD, libc::SIGCONT);
    let status = team.wait_for_end(HEAD, "mikoshi-coordinator");
    eprintln!("in charge again after {lost_ticks} ticks; the old one ended with {status:?}");
    assert_eq!(status, Some(75), "it finds itself fenced");
    let refused = || {
        let report = team.report(&b);
        let topics = report["topics"].as_array().expect("a list").clone();
        let of_head =
            topics.iter().find(|topic| topic["topic"] == "team-command[1]" && topic["from"] == HEAD);
        of_head.expect("it may come")["frames"]["epoch"].as_u64().unwrap_or(0)
    };
    let before = refused();
    let said = says_late(&team, &plan.certificates());
    let sent = said["sent"].as_u64().expect("a number");
    team.wait_until(AMPLE_TICKS, || refused() - before > sent / 2);
    eprintln!("{said}: {} refused by epoch", refused() - before);
    assert!(sent > 0 && refused() - before > sent / 2);
    team.wait_for_tick(LOST_TICK + lost_ticks + STAND_TICKS);
    goes_on_and_stops(&mut team, &a);
    for host in [STAGE, HEAD, &a, &b] {
        tell(&team, host);
        let coordinator = team.standby(host, "coordinator");
        eprintln!("{host}: {coordinator}");
        assert!(coordinator == Value::Null || coordinator["in_charge"] == a);
    }
    let summary = team.finish();
    eprintln!("{} {}", summary["faults"], summary["object"]);
    summary
}

#[test]
fn a_machine_in_the_place_of_a_robots_goes_on_from_what_was_kept_elsewhere() {
    stopped_by(&STOPS, has_another_machine_for_a_robot);
}

fn has_another_machine_for_a_robot() -> Value {
    let b = robot_host("B");
    let plan = walk_with(2, 0.06, &["slow_motion=3"], &[(HEAD, "B")]);
    let mut team = or_skip!(Team::gather(&plan), Value::Null);
    let head = team.cluster.index_of(HEAD);
    team.cluster.wire.set(head, 0..4, |way| *way = Way::bad(2.0));
    team.start();
    team.wait_for_tick(LOST_TICK);
    for name in ["mikoshi-link", "mikoshi-servo"] {
        team.kill(&b, name);
    }
    // Until its robot has played its plan for that, and stands.
    team.wait_for_tick(LOST_TICK + STAND_TICKS);
    team.replace(&b);
    wait_until_it_goes(&team, &b, ServiceId::Servo(1));
    let (since, now) = (team.standby(&b, "servo-1"), team.tick(STAGE));
    eprintln!("back in tick {now}: {since}");
    // It stands with the others.
    team.wait_for_tick(now + STAND_TICKS);
    goes_on_and_stops(&mut team, HEAD);
    for host in [STAGE, HEAD, &b] {
        tell(&team, host);
    }
    let summary = team.finish();
    eprintln!("{} {}", summary["faults"], summary["object"]);
    summary
}
