//! Heavy objects, objects whose mass changes, and fast ones: judged by their scenarios, and by what the team knows.

use mikoshi_tests::run::{Results, run, say_mikoshi};
use mikoshi_tests::scenarios::of_project;
use serde_json::Value;

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

#[test]
fn forty_kilograms_are_carried_and_known_within_a_second() {
    let results = Results::new();
    let short = ["motion.segments.0.duration_s=7", "duration_s=17", "thresholds.object_travel_min_m=0.3"];
    let sets = short.iter().chain(&["object.mass_kg=40", "object.com_m=[0.03, -0.1, 0.0]"]);
    let arguments: Vec<&str> = sets.flat_map(|set| ["--set", *set]).chain(["--in-process"]).collect();
    let said = run(&of_project("heavy"), &arguments, &results);
    let summary = results.summary();
    assert_eq!(said.status, Some(0), "{:#}", summary["failures"]);
    let load = &summary["load"];
    assert!((number(&load["mass_kg"]) - 40.0).abs() < 0.03 * 40.0, "{load:#}");
    assert!(number(&load["mass_stays_since_s"]) < 1.0, "{load:#}");
    let com_m = [0, 1].map(|axis| number(&load["com_m"][axis]));
    assert!((com_m[0] - 0.03).abs() < 0.01 && (com_m[1] + 0.1).abs() < 0.01, "{load:#}");
    // What nothing tells of is said to be unknown.
    assert!(number(&load["inertia_std_kg_m2"][0]) > 1.0, "{load:#}");
}

#[test]
fn five_kilograms_more_and_less_in_mid_carry_neither_tip_a_robot_nor_move_the_object() {
    let results = Results::new();
    let said = run(&of_project("load_change"), &["--in-process"], &results);
    let summary = results.summary();
    assert_eq!(said.status, Some(0), "{:#}", summary["failures"]);
    let load = &summary["load"];
    assert!((number(&load["mass_kg"]) - 20.0).abs() < 0.03 * 20.0, "{load:#}");
    // It was taken out at 14 s.
    let since_s = number(&load["mass_stays_since_s"]);
    assert!((14.0..16.5).contains(&since_s), "{load:#}");
}

#[test]
fn an_object_is_carried_at_a_fifth_of_a_metre_per_second_with_the_torques_that_there_are() {
    let results = Results::new();
    let short = ["motion.segments.0.duration_s=9", "duration_s=15", "thresholds.object_travel_min_m=0.9"];
    let arguments: Vec<&str> = short.iter().flat_map(|set| ["--set", *set]).chain(["--in-process"]).collect();
    let said = run(&of_project("fast"), &arguments, &results);
    assert_eq!(said.status, Some(0), "{:#}", results.summary()["failures"]);
}

#[test]
fn what_robots_can_hardly_bear_is_said_before_they_lift_it() {
    let heavy = of_project("heavy");
    let plan = |mass: &str| {
        let arguments = ["plan".as_ref(), heavy.as_os_str(), "--set".as_ref(), mass.as_ref()];
        say_mikoshi(arguments)
    };
    let light = plan("object.mass_kg=20");
    assert!(light.status == Some(0) && !light.error.contains("can hardly bear"), "{}", light.error);
    let too_heavy = plan("object.mass_kg=120");
    assert!(too_heavy.status == Some(0), "{}", too_heavy.error);
    assert!(
        too_heavy.error.contains("robot A can hardly bear 294 N: at rest CHEST_JOINT1"),
        "{}",
        too_heavy.error
    );
}
