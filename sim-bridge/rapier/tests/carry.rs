//! Teams that have never seen this engine carry in it, with the thresholds of the other one.

#![allow(missing_docs)]

use mikoshi_tests::programs::mikoshi;
use mikoshi_tests::run::{Results, run};
use mikoshi_tests::scenarios::of_project;
use std::path::Path;

fn carries(scenario: &str, arguments: &[&str]) -> serde_json::Value {
    let bridge = env!("CARGO_BIN_EXE_mikoshi-bridge-rapier");
    assert_eq!(
        Path::new(bridge).parent(),
        Path::new(mikoshi().get_program()).parent(),
        "one target folder for both"
    );
    let results = Results::new();
    let said = run(&of_project(scenario), &[&["--bridge", bridge], arguments].concat(), &results);
    assert_eq!(said.status, Some(0), "{said:#?}");
    results.summary()
}

#[test]
fn a_team_holds() {
    carries("hold", &[]);
}

#[test]
fn a_team_walks_and_carries() {
    let summary = carries("transport", &[]);
    assert!(
        summary["object"]["travel_m"][0].as_f64().expect("a number").abs() > 0.5,
        "{}",
        summary["object"]
    );
}
