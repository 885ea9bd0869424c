//! Section 4.4: teams of all sizes walk and carry, each judged by its scenario.

use mikoshi_tests::run::{Results, run};
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
