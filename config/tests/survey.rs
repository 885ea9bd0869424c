//! Surveys: which sweeps they name, and what is refused before any runs.

mod common;

use mikoshi_config::{SweepFile, load_sweep_file};
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

const SURVEY: &str = r#"name = "many"
description = "Lifts and more lifts"
sweeps = ["lifts", "drops"]
succeed_min = 14
"#;
const SWEEP: &str = r#"name = "lifts"
description = "Lifts"
scenario = "lift"
runs = 10
succeed_min = 9
[[ranges]]
key = "object.mass_kg"
min = 1
max = 6
"#;

/// The fixture with a survey of this text, and its two sweeps.
fn fixture(text: &str) -> (TempDir, PathBuf) {
    let copy = common::fixture();
    fs::create_dir_all(copy.path().join("sweeps/many")).unwrap();
    fs::write(copy.path().join("sweeps/many/lifts.toml"), SWEEP).unwrap();
    let drops = SWEEP.replace("lifts", "drops").replace("runs = 10", "runs = 5").replace("= 9", "= 5");
    fs::write(copy.path().join("sweeps/many/drops.toml"), drops).unwrap();
    let path = copy.path().join("sweeps/many.toml");
    fs::write(&path, text).unwrap();
    (copy, path)
}

/// What is said of a survey with `bad` in place of `good`, or of a sweep of it.
fn gives(good: &str, bad: &str, expected: &str) {
    let text = SURVEY.replace(good, bad);
    assert_ne!(text, SURVEY);
    let (_copy, path) = fixture(&text);
    let Err(error) = load_sweep_file(&path) else { panic!("the input is bad") };
    let error = error.to_string();
    assert!(error.contains(expected), "no {expected:?} in {error}");
}

#[test]
fn a_survey_has_the_sweeps_of_the_folder_of_its_name() {
    let (_copy, path) = fixture(SURVEY);
    let Ok(SweepFile::Survey(loaded)) = load_sweep_file(&path) else { panic!("it is a survey") };
    assert_eq!(loaded.all_runs(), 15);
    let names: Vec<_> = loaded.sweeps.iter().map(|sweep| sweep.sweep.name.as_str()).collect();
    assert_eq!(names, ["lifts", "drops"]);
    assert!(loaded.sweeps.iter().all(|sweep| sweep.scenario.ends_with("scenarios/lift.toml")));
}

#[test]
fn a_file_without_sweeps_is_a_sweep() {
    let (_copy, path) = fixture(SURVEY);
    let Ok(SweepFile::Sweep(loaded)) = load_sweep_file(&path.with_file_name("many/lifts.toml")) else {
        panic!("it is a sweep")
    };
    assert_eq!(loaded.sweep.runs, 10);
}

#[test]
fn surveys_that_make_no_sense_are_refused_with_their_line() {
    gives("\"drops\"", "\"drop\"", "many.toml:3: sweeps.1: found \"drop\", expected one of drops, lifts");
    gives("[\"lifts\", \"drops\"]", "[]", "many.toml:3: sweeps: found none, expected at least one sweep");
    gives("\"drops\"", "\"lifts\"", "sweeps.1: found \"lifts\" again");
    gives("= 14", "= 16", "many.toml:4: succeed_min: found 16, expected no more than all of the 15 runs");
    gives("succeed_min", "suceed_min", "suceed_min");
}

#[test]
fn what_is_wrong_with_a_sweep_is_said_where_that_says_it() {
    let (copy, path) = fixture(SURVEY);
    let sweep = copy.path().join("sweeps/many/lifts.toml");
    fs::write(&sweep, SWEEP.replace("object.mass_kg", "object.mas_kg")).unwrap();
    let Err(error) = load_sweep_file(&path) else { panic!("the input is bad") };
    assert!(error.to_string().contains("lifts.toml:7: object.mas_kg"), "{error}");
}
