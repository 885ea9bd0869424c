//! Section 4.1: what a follower that comes too late does to a leader, against eq. 42.

use mikoshi_tests::run::{Results, run, say_mikoshi};
use mikoshi_tests::scenarios::of_project;
use serde_json::Value;

/// What a standing HRP-2 yields at each of its hands, in series with the grasp.
const ROBOT_STIFFNESS_N_M: f64 = 6800.0;
const MOTION_START_S: f64 = 2.0;

fn overrides(velocity_m_s: f64, grasp_n_m: f64) -> Vec<String> {
    let hand_n_m = 1.0 / (1.0 / grasp_n_m + 1.0 / ROBOT_STIFFNESS_N_M);
    [
        "coordination.followers_move=false".to_owned(),
        "duration_s=6.0".to_owned(),
        "motion.segments.0.duration_s=4.0".to_owned(),
        format!("motion.segments.0.velocity_m_s=[-{velocity_m_s:?}, 0.0, 0.0]"),
        format!("grasp.stiffness_n_m={grasp_n_m:?}"),
        format!("hybrid.grasp_stiffness_n_m={grasp_n_m:?}"),
        format!("hybrid.hand_stiffness_n_m={hand_n_m:?}"),
    ]
    .iter()
    .flat_map(|set| ["--set".to_owned(), set.clone()])
    .collect()
}

#[test]
fn a_follower_that_stands_is_at_its_toes_when_eq_42_says() {
    let scenario = of_project("two_robots_leader_follower");
    for velocity_m_s in [0.05, 0.1, 0.2] {
        for grasp_n_m in [1000.0, 1500.0, 2000.0] {
            let overrides = overrides(velocity_m_s, grasp_n_m);
            let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
            let path = scenario.to_string_lossy();
            let said = say_mikoshi(["plan", "--json", &path].iter().chain(&overrides));
            let plan: Value = serde_json::from_str(&said.out).expect("a plan is JSON");
            let predicted_s = plan["pulls"][1]["time_s"].as_f64().expect("the object moves");

            let results = Results::new();
            let arguments: Vec<&str> = ["--in-process"].iter().chain(&overrides).copied().collect();
            run(&scenario, &arguments, &results);
            let edge_s = results.summary()["robots"][1]["zmp_edge_s"].as_f64().expect("it is at the edge");
            let ratio = (edge_s - MOTION_START_S) / predicted_s;
            assert!(
                (0.8..1.2).contains(&ratio),
                "{velocity_m_s} m/s, {grasp_n_m} N/m: {ratio} of {predicted_s} s"
            );
        }
    }
}

#[test]
fn symmetry_keeps_its_margin_where_a_late_follower_loses_it() {
    let late = Results::new();
    run(&of_project("two_robots_leader_follower"), &["--in-process"], &late);
    let least = |results: &Results| {
        let summary = results.summary();
        let robots = summary["robots"].as_array().expect("robots").clone();
        let margins = robots.iter().filter_map(|robot| robot["zmp_margin_min_m"].as_f64());
        margins.fold(f64::INFINITY, f64::min)
    };
    assert!(least(&late) < 0.005, "{}", least(&late));
    let together = Results::new();
    let said = run(&of_project("two_robots_symmetry"), &["--in-process"], &together);
    assert_eq!(said.status, Some(0), "{said:#?}");
    assert!(least(&together) > 0.02, "{}", least(&together));
}
