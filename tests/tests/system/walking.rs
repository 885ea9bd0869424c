//! Section 4.4: teams of all sizes walk and carry, each judged by its scenario.

use mikoshi_tests::programs::described_robots;
use mikoshi_tests::run::{Results, run, run_command, say};
use mikoshi_tests::scenarios::of_project;

#[test]
fn teams_of_two_to_eight_robots_carry_for_twenty_seconds() {
    for robots in [2, 3, 5, 8] {
        let results = Results::new();
        let said = run(&of_project(&format!("teams/{robots}")), &["--in-process"], &results);
        let summary = results.summary();
        assert_eq!(said.status, Some(0), "{robots} robots: {:#}", summary["failures"]);
        let members = summary["robots"].as_array().expect("a list");
        assert_eq!(members.len(), robots);
        assert!(members.iter().all(|robot| robot["steps"].as_u64() > Some(20)), "all of them walk");
    }
}

/// HRP-2 and a robot that is taller, has arms of seven joints and narrower feet.
#[test]
fn robots_of_two_kinds_carry_together() {
    let results = Results::new();
    let said = run(&of_project("mixed"), &["--in-process", "--no-log"], &results);
    let summary = results.summary();
    assert_eq!(said.status, Some(0), "{:#}", summary["failures"]);
    let joints = |robot: usize| summary["robots"][robot]["torque_peak_nm"].as_object().expect("joints").len();
    assert_eq!([joints(0), joints(1)], [32, 28]);
}

/// The same, and Talos, as a package describes it.
#[test]
fn robots_of_three_kinds_carry_together() {
    let Some(robots) = described_robots() else {
        return eprintln!(
            "not tested here: Talos' description is missing, which scripts/setup-talos fetches"
        );
    };
    let results = Results::new();
    let mut command = run_command(&of_project("kinds/3"), &["--in-process", "--no-log"], &results);
    let said = say(command.env("EXAMPLE_ROBOT_DATA", robots));
    assert_eq!(said.status, Some(0), "{said:#?}");
    let summary = results.summary();
    let joints = |robot: usize| summary["robots"][robot]["torque_peak_nm"].as_object().expect("joints").len();
    assert_eq!([joints(0), joints(1), joints(2)], [32, 28, 32]);
    let steps = |robot: usize| summary["robots"][robot]["steps"].as_u64();
    assert!((0..4).all(|robot| steps(robot) > Some(30)), "all of them walk");
}

/// Odometries part with every step, and by the way between them the object's turn would move hands against each
/// other.
#[test]
fn robots_whose_odometries_part_know_it_by_the_object_that_all_hold() {
    let results = Results::new();
    let minute = ["--in-process", "--set", "duration_s=66", "--set", "motion.random.duration_s=60"];
    let said = run(&of_project("wander"), &minute, &results);
    let summary = results.summary();
    assert_eq!(said.status, Some(0), "{:#}", summary["failures"]);
    let last = summary["minutes"].as_array().and_then(|minutes| minutes.last()).expect("minutes");
    let apart_m = |key: &str| last[key].as_f64().expect("a number");
    assert!(apart_m("odometry_apart_m") > 0.008, "{last:#}");
    assert!(apart_m("frames_apart_m") < 0.004, "{last:#}");
}
