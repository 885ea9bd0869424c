//! Cables that are cut, and hosts that are lost.

use crate::or_skip;
use crate::team::{HEAD, STAGE, Team, robot_host};
use crate::walk::{stopped_by, tell, walk};
use crate::wire::Way;
use serde_json::Value;

#[test]
fn a_cut_of_two_seconds_stops_the_team_and_it_goes_on_when_it_is_told_to() {
    let summary = stopped_by(&["input-stale"], is_cut_for_two_seconds);
    if !summary.is_null() {
        assert_eq!(summary["ticks"], 4800);
    }
}

fn is_cut_for_two_seconds() -> Value {
    let plan = walk(2, 0.06, &["duration_s=24"]);
    let mut team = or_skip!(Team::gather(&plan), Value::Null);
    let head = team.cluster.index_of(HEAD);
    team.cluster.wire.set(head, 0..4, |way| *way = Way::bad(2.0));
    team.start();
    team.wait_for_tick(1500);
    team.cluster.wire.set(head, 0..4, |way| way.is_cut = true);
    // Two seconds, as the clock of this walk goes.
    let cut_at = team.tick(STAGE);
    team.wait_for_tick(cut_at + 200);
    team.cluster.wire.set(head, 0..4, |way| way.is_cut = false);
    let cut_until = team.tick(STAGE);
    // The team stands by then, and the operator is on the coordinator's host.
    team.wait_for_tick(cut_until + 1000);
    team.host(HEAD).run(&crate::team::program("mikoshi"), &["resume"]);
    team.wait_for_tick(4700);
    for host in [STAGE, HEAD, &robot_host("A"), &robot_host("B")] {
        let report = tell(&team, host);
        no_stale_frame_was_used(&report);
    }
    let summary = team.finish();
    eprintln!("{}\n{}\n{}", summary["faults"], summary["object"], summary["timing"]);
    summary
}

/// What is let through is used in its tick or passed over: each tick's frame came once at most.
fn no_stale_frame_was_used(report: &Value) {
    for topic in report["topics"].as_array().expect("a list") {
        let accepted = topic["frames"]["accepted"].as_u64().expect("a number");
        assert!(accepted > 0 && accepted <= topic["newest_tick"].as_u64().expect("a number") + 1, "{topic}");
    }
}

#[test]
fn a_link_that_is_killed_and_started_anew_carries_on() {
    let plan = walk(2, 0.06, &[]);
    let mut team = or_skip!(Team::gather(&plan));
    let head = team.cluster.index_of(HEAD);
    team.cluster.wire.set(head, 0..4, |way| *way = Way::bad(2.0));
    team.start();
    team.wait_for_tick(1200);
    team.kill(HEAD, "mikoshi-link");
    team.start_link(HEAD);
    team.wait_for_tick(1900);
    team.host(HEAD).run(&crate::team::program("mikoshi"), &["resume"]);
    team.wait_for_tick(2700);
    tell(&team, HEAD);
    let summary = team.finish();
    eprintln!("{}\n{}", summary["faults"], summary["object"]);
    assert_eq!(summary["fell"], Value::Array(vec![]));
    assert_eq!(summary["ticks"], 2800);
}

/// Walks, loses all processes of a host, and must not fall.
fn loses(host: &str) -> Value {
    let plan = walk(2, 0.06, &[]);
    let mut team = or_skip!(Team::gather(&plan), Value::Null);
    let head = team.cluster.index_of(HEAD);
    team.cluster.wire.set(head, 0..4, |way| *way = Way::bad(2.0));
    team.start();
    team.wait_for_tick(1300);
    for name in ["mikoshi-link", "mikoshi-servo", "mikoshi-coordinator"] {
        team.kill(host, name);
    }
    team.wait_for_tick(2790);
    for other in [STAGE, HEAD].into_iter().filter(|other| *other != host) {
        tell(&team, other);
    }
    let summary = team.finish();
    eprintln!("without {host}: {} {}", summary["faults"], summary["object"]);
    assert_eq!(summary["fell"], Value::Array(vec![]));
    assert_eq!(summary["ticks"], 2800);
    summary
}

#[test]
fn a_team_that_loses_a_robots_host_stops_and_stands() {
    stopped_by(&["input-stale"], || loses(&robot_host("B")));
}

#[test]
fn a_team_that_loses_its_coordinators_host_stands() {
    loses(HEAD);
}
