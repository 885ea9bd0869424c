//! What the team does to its surroundings.

use mikoshi_tests::run::{Results, run};
use mikoshi_tests::scenarios::of_project;

/// The force of the wall on the object in the end, in the world's axes.
fn push_wall(arguments: &[&str]) -> [f64; 3] {
    let results = Results::new();
    let said = run(&of_project("push_wall"), &[&["--in-process"], arguments].concat(), &results);
    assert_eq!(said.status, Some(0), "{said:#?}: {:#}", results.summary()["failures"]);
    let summary = results.summary();
    core::array::from_fn(|axis| summary["object"]["support_force_end_n"][axis].as_f64().expect("a force"))
}

#[test]
fn four_robots_press_an_object_against_a_wall_with_40_n() {
    let [x, y, z] = push_wall(&[]);
    assert!((y + 40.0).abs() < 1.0, "{y}");
    // What friction bears along the wall is not asked for.
    assert!(x.abs() < 10.0 && z.abs() < 10.0, "{x} {z}");
}

#[test]
fn whatever_they_are_asked_to_press_with_they_do() {
    let [_, y, _] = push_wall(&["--seed", "1", "--set", "hybrid.axes.0.reference=15"]);
    assert!((y + 15.0).abs() < 1.0, "{y}");
}

#[test]
fn a_wall_out_of_reach_is_not_pressed() {
    let results = Results::new();
    let away = ["--in-process", "--set", "duration_s=10", "--set", "world.boxes.0.position_m.1=0.9"];
    let said = run(&of_project("push_wall"), &away, &results);
    assert_eq!(said.status, Some(1), "{said:#?}");
    let failures = results.summary()["failures"].to_string();
    assert!(failures.contains("y of object: 0.000 N at the end, expected 40 N within 1 N"), "{failures}");
}
