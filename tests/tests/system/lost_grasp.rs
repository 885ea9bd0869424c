//! A hand loses the object in the middle of a walk, or while the team stands: with physics, from the scenario to the
//! summary. The scenarios' own thresholds hold for those who are left.

use mikoshi_tests::log::Log;
use mikoshi_tests::run::{Results, run};
use mikoshi_tests::scenarios::of_project;
use serde_json::Value;

/// Runs a scenario in which B's left hand fails as told, in one thread.
fn failing(scenario: &str, failure: &str, arguments: &[&str]) -> (Option<i32>, Value, Results) {
    let failures = format!(r#"world.grasp_failures=[{{robot = "B", hand = "left", {failure}}}]"#);
    let results = Results::new();
    let said = run(&of_project(scenario), &[&["--set", failures.as_str()], arguments].concat(), &results);
    let summary = results.summary();
    (said.status, summary, results)
}

fn faults(summary: &Value) -> Vec<(u64, &str, &str)> {
    let faults = summary["faults"].as_array().expect("a list").iter();
    faults
        .map(|row| {
            let text = |key: &str| row[key].as_str().expect("a name");
            (row["tick"].as_u64().expect("a tick"), text("robot"), text("code"))
        })
        .collect()
}

fn largest(summary: &Value, key: &str) -> f64 {
    summary["object"][key]
        .as_array()
        .expect("axes")
        .iter()
        .map(|v| v.as_f64().expect("a figure"))
        .fold(0.0, f64::max)
}

/// A short walk, whose object need not get as far as in a long one.
const WALK: [&str; 14] = [
    "--in-process",
    "--no-log",
    "--set",
    "duration_s=20",
    "--set",
    "motion.random.duration_s=9",
    "--set",
    "motion.random.travel_m=[0.35, 0.1, 0.0]",
    "--set",
    "motion.random.travel_rad=[0.0, 0.0, 0.1]",
    "--set",
    "thresholds.object_travel_min_m=0.3",
    "--set",
    "thresholds.object_travel_min_rad=0.05",
];

#[test]
fn a_team_that_loses_a_hand_in_its_walk_carries_on_within_its_thresholds() {
    for how in
        [r#"kind = "open""#, r#"kind = "slip", friction_n = 3.0"#, r#"kind = "open", is_noticed = true"#]
    {
        let carry_on = ["--set", "safety.lost_grasp=carry-on"];
        let failure = format!("at_s = 7.0, {how}");
        let (status, summary, _) = failing("transport", &failure, &[&WALK[..], &carry_on].concat());
        assert_eq!(status, Some(0), "{how}: {:#}", summary["failures"]);
        let code = if how.contains("is_noticed") { "grasp-lost" } else { "grasp-slip" };
        let faults = faults(&summary);
        assert!(matches!(faults[..], [(1400..1600, "B", found)] if found == code), "{how}: {faults:?}");
        assert!(largest(&summary, "position_peak_m") < 0.008, "{how}");
    }
}

#[test]
fn by_the_other_policy_it_stops_with_the_object_in_its_hands() {
    for how in [r#"kind = "open""#, r#"kind = "slip", friction_n = 3.0"#] {
        let (status, summary, _) = failing("transport", &format!("at_s = 7.0, {how}"), &WALK);
        assert_eq!(status, Some(1), "it does not get there");
        let faults = faults(&summary);
        assert!(matches!(faults[..], [(1400..1600, "B", "grasp-slip")]), "{faults:?}");
        assert_eq!(summary["modes"].as_array().expect("a list").last().expect("one")["mode"], "safe stop");
        assert_eq!(summary["fell"], Value::Array(vec![]));
        assert!(largest(&summary, "position_peak_m") < 0.008);
        assert!(summary["object"]["speed_end_m_s"].as_f64().expect("a figure") < 1e-3);
    }
}

#[test]
fn a_standing_team_finds_a_hand_that_holds_nothing_and_its_internal_forces_go_to_zero() {
    let (_, summary, _) = failing(
        "hold",
        r#"at_s = 15.0, kind = "open""#,
        &["--in-process", "--no-log", "--set", "safety.lost_grasp=carry-on"],
    );
    let faults = faults(&summary);
    // The law drives it away by what it does not bear: by 10 mrad in half a second.
    assert!(matches!(faults[..], [(3000..3150, "B", "grasp-slip")]), "{faults:?}");
    for row in summary["internal"].as_array().expect("rows") {
        assert!(row["end_n"].as_f64().expect("a figure") < 0.1, "{row:#}");
    }
    assert!(largest(&summary, "position_peak_m") < 0.003);
}

#[test]
fn processes_and_one_thread_lose_a_hand_with_the_same_bytes() {
    let short = ["--set", "duration_s=4", "--set", "hybrid.start_s=1", "--set", "safety.lost_grasp=carry-on"];
    let failure = r#"at_s = 2.0, kind = "open""#;
    let (_, summary, threads) = failing("hold", failure, &[&short[..], &["--in-process"]].concat());
    assert_eq!(faults(&summary).len(), 1, "{summary:#}");
    let (_, _, processes) = failing("hold", failure, &short);
    assert_eq!(Log::read(&threads.log()).first_difference(&Log::read(&processes.log())), None);
}
