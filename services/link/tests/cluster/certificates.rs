//! A certificate that ends while a team walks, and a new one.

use crate::or_skip;
use crate::team::{HEAD, STAGE, Team, program, robot_host};
use crate::walk::{faults, tell, walk};
use serde_json::Value;

/// How long the one that ends is good [s]: until the team walks, and no longer than it does.
const GOOD_FOR_S: f64 = 18.0;
/// Of a host of which so long nothing is heard the session has ended: hellos come every 50 ms.
const SILENT_S: f64 = 1.0;
/// Between two words of the operator.
const WORD_TICKS: u64 = 100;

/// For how long nothing was heard of a host, as another one knows it.
fn silence_s(team: &Team<'_>, host: &str, of: &str) -> f64 {
    let report = team.report(host);
    let hosts = report["hosts"].as_array().expect("a list").clone();
    let other = hosts.iter().find(|other| other["host"] == of).expect("it knows it");
    other["heard_s_ago"].as_f64().unwrap_or(f64::INFINITY)
}

/// The operator lets the team go on, again and again, as it is not heard before the team stands.
fn goes_on(team: &mut Team<'_>, words: u64) {
    for _ in 0..words {
        team.host(HEAD).run(&program("mikoshi"), &["resume"]);
        let said = team.tick(STAGE);
        team.wait_for_tick(said + WORD_TICKS);
    }
}

#[test]
fn a_certificate_that_ends_during_a_walk_stops_the_team_and_with_a_new_one_it_goes_on() {
    let b = robot_host("B");
    let plan = walk(2, 0.06, &["duration_s=18", "motion.random.duration_s=12"]);
    let mut team = or_skip!(Team::gather(&plan));
    plan.certify(&["--host", &b, "--days", &(GOOD_FOR_S / 86_400.0).to_string()]);
    team.start();
    team.wait_for_tick(600);
    assert!(team.words().contains(&format!("{b}.pem ends within a day")), "{}", team.words());
    let is_silent = || silence_s(&team, HEAD, &b) > SILENT_S;
    team.wait_until(2000, is_silent);
    let ended = team.tick(STAGE);
    assert!(is_silent(), "the session goes on in tick {ended}\n{}", team.words());
    // Its link lives, and is refused until it has a certificate that is good.
    plan.certify(&["--host", &b]);
    team.kill(&b, "mikoshi-link");
    team.start_link(&b);
    let is_heard = || silence_s(&team, HEAD, &b) < SILENT_S;
    team.wait_until(1000, is_heard);
    let heard = team.tick(STAGE);
    assert!(is_heard(), "not heard in tick {heard}\n{}", team.words());
    eprintln!("the session had ended in tick {ended}, with a new certificate it is heard in tick {heard}");
    goes_on(&mut team, 11);
    // It stops only if it had gone on.
    team.host(HEAD).run(&program("mikoshi"), &["stop"]);
    tell(&team, HEAD);
    let summary = team.finish();
    eprintln!("{} {}", summary["faults"], summary["object"]);
    assert_eq!(summary["fell"], Value::Array(vec![]));
    let faults = faults(&summary);
    assert!(faults.first() == Some(&"input-stale") && faults.last() == Some(&"operator-stop"), "{faults:?}");
}
