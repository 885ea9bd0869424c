//! In lockstep a run over several hosts is the run of one.

use crate::or_skip;
use crate::team::{Plan, Team, program};
use std::process::Command;

#[test]
fn over_several_hosts_every_byte_is_what_it_is_in_one_thread() {
    let settings = ["duration_s=3", "hybrid.start_s=1", "thresholds.internal_start_min_n="];
    let plan = Plan::of("hold.toml", &["A", "B"], &settings, true);
    let mut team = or_skip!(Team::gather(&plan));
    team.start();
    let over_hosts = team.finish();
    let results = plan.folder().join("alone");
    let mut alone = Command::new(program("mikoshi"));
    alone.args(["run", "--in-process", "--quiet", "--out"]).arg(&results).arg(plan.scenario());
    alone.args(settings.iter().flat_map(|set| ["--set", set]));
    let _ = alone.status().expect("it can be started");
    let text = std::fs::read_to_string(results.join("summary.json")).expect("it has ended");
    let alone: serde_json::Value = serde_json::from_str(&text).expect("a summary is JSON");
    assert_eq!(over_hosts["log_hash"], alone["log_hash"]);
    assert_eq!((&over_hosts["ticks"], &alone["ticks"]), (&600.into(), &600.into()));
}
