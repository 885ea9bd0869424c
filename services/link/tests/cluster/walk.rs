//! By the clock a team walks over ways that are long and lose packets.

use crate::or_skip;
use crate::team::{HEAD, Plan, STAGE, Team, robot_host};
use crate::wire::Way;
use serde_json::Value;

/// Two robots walk and carry for a while.
pub const WALK: [&str; 8] = [
    "team=two",
    "duration_s=14",
    "motion.random.duration_s=9",
    "supervision.standby=false",
    "placement.fifo_priority=",
    "placement.keep_awake=never",
    "slow_motion=2",
    "thresholds.internal_peak_n=",
];

/// A plan for that, by commands of this age and this loop gain.
pub fn walk(delay_ticks: u64, loop_gain: f64, more: &[&str]) -> Plan {
    let delay = format!("coordination_delay_ticks={delay_ticks}");
    let gain = format!("hybrid.loop_gain={loop_gain}");
    let settings = [&WALK[..], &[&delay, &gain], more].concat();
    Plan::of("service.toml", &["A", "B"], &settings, false)
}

/// Says what a link has measured, for the reader of the test.
pub fn tell(team: &Team<'_>, host: &str) -> Value {
    let report = team.report(host);
    for topic in report["topics"].as_array().expect("a list") {
        let ms = |of: &str, key: &str| topic[of][key].as_f64().map_or(f64::NAN, |s| 1e3 * s);
        eprintln!(
            "{host:8} {:18} of {:8} one way {:.3} {:.3} {:.3} ms, there and back {:.3} {:.3} {:.3} ms, {}",
            topic["topic"].as_str().unwrap_or_default(),
            topic["from"].as_str().unwrap_or_default(),
            ms("one_way", "p50_s"),
            ms("one_way", "p99_s"),
            ms("one_way", "p999_s"),
            ms("round_trip", "p50_s"),
            ms("round_trip", "p99_s"),
            ms("round_trip", "p999_s"),
            topic["frames"]
        );
    }
    eprintln!("{host:8} fits: {} ticks; {}", report["fitting_delay_ticks"], report["hosts"]);
    report
}

fn completes(delay_ms: f64, delay_ticks: u64, loop_gain: f64, more: &[&str]) {
    let plan = walk(delay_ticks, loop_gain, more);
    let mut team = or_skip!(Team::gather(&plan));
    let head = team.cluster.index_of(HEAD);
    team.cluster.wire.set(head, 0..4, |way| *way = Way::bad(delay_ms));
    team.start();
    team.wait_for_tick(2700);
    for host in [STAGE, HEAD, &robot_host("A"), &robot_host("B")] {
        tell(&team, host);
    }
    let summary = team.finish();
    eprintln!("{delay_ms} ms, {delay_ticks} ticks: {}\n{}", summary["failures"], summary["object"]);
    eprintln!("{} {}", summary["timing"], summary["faults"]);
    assert_eq!(summary["fell"], Value::Array(vec![]));
    assert_eq!(summary["faults"], Value::Array(vec![]));
    assert_eq!(summary["ticks"], 2800);
}

#[test]
fn a_team_walks_over_a_fifth_of_a_millisecond() {
    completes(0.2, 1, 0.06, &[]);
}

#[test]
fn a_team_walks_over_two_milliseconds() {
    completes(2.0, 2, 0.06, &[]);
}

#[test]
fn a_team_walks_over_ten_milliseconds() {
    completes(10.0, 6, 0.03, &[]);
}

#[test]
fn a_team_whose_clock_is_the_coordinators_walks() {
    completes(0.2, 2, 0.06, &["link.clock=head"]);
}
