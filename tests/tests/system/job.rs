//! The whole job: approach, grasp, lift, carry, lower, release.

use mikoshi_tests::log::Log;
use mikoshi_tests::run::{Results, run};
use mikoshi_tests::scenarios::of_project;
use serde_json::Value;

fn pick_and_place(arguments: &[&str]) -> (Option<i32>, Results) {
    let results = Results::new();
    let said = run(&of_project("pick_and_place"), arguments, &results);
    (said.status, results)
}

fn modes(summary: &Value) -> Vec<&str> {
    let entries = summary["modes"].as_array().expect("a list");
    entries.iter().map(|entry| entry["mode"].as_str().expect("a name")).collect()
}

#[test]
fn four_robots_pick_an_object_up_carry_it_and_set_it_down_where_it_belongs() {
    let (status, results) = pick_and_place(&["--in-process"]);
    let summary = results.summary();
    assert_eq!(status, Some(0), "{:#}", summary["failures"]);
    let whole = ["hold", "approach", "grasp", "lift", "carry", "lower", "release", "hold"];
    assert_eq!(modes(&summary), whole);
    let number = |key: &str, axis: usize| summary["object"][key][axis].as_f64().expect("a figure");
    assert!(number("travel_m", 1) > 1.09 && (number("travel_rad", 2) - 0.5).abs() < 0.005);
    // It rests, and nobody but its pedestal holds it.
    assert!((number("support_force_end_n", 2) - 3.0 * 9.81).abs() < 0.01);
    assert!(summary["object"]["speed_end_m_s"].as_f64().expect("a figure") < 1e-5);
}

#[test]
fn hands_that_find_nothing_stop_the_team_and_the_run_says_so() {
    let (status, results) = pick_and_place(&[
        "--in-process",
        "--set",
        "world.boxes=[]",
        "--set",
        "motion=",
        "--set",
        "duration_s=30",
    ]);
    assert_eq!(status, Some(1));
    let summary = results.summary();
    assert_eq!(modes(&summary), ["hold", "approach", "grasp", "safe stop"]);
    let failures = summary["failures"].to_string();
    assert!(failures.contains("the job failed: the team stopped after 8.50 s, in grasp"), "{failures}");
    assert_eq!(summary["fell"], Value::Array(vec![]), "who stops stands");
}

#[test]
fn processes_and_one_thread_grasp_and_lift_with_the_same_bytes() {
    let short = ["--set", "motion=", "--set", "duration_s=20", "--set", "job.settle_s=1.0"];
    let (_, threads) = pick_and_place(&[&short[..], &["--in-process"]].concat());
    let (_, processes) = pick_and_place(&short);
    assert_eq!(Log::read(&threads.log()).first_difference(&Log::read(&processes.log())), None);
    let whole = ["hold", "approach", "grasp", "lift", "carry", "lower", "release", "hold"];
    assert_eq!(modes(&threads.summary()), whole);
}
