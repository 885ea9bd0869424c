//! Section 4.1: what a follower that comes too late does to a leader, against eq. 42.

use mikoshi_tests::programs::workspace;
use mikoshi_tests::run::{Results, Said, run, say_mikoshi};
use mikoshi_tests::scenarios::{Copy, of_project};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// What a sweep of the project came to, and the words of its page.
fn sweep(path: &Path) -> (Said, Value, String) {
    let results = Results::new();
    let said = say_mikoshi(["sweep", &path.to_string_lossy(), "--out", &results.path().to_string_lossy()]);
    let read = |name: &str| fs::read_to_string(results.path().join(name)).unwrap_or_default();
    for name in ["comparison.svg", "comparison.png"] {
        assert!(results.path().join(name).exists(), "no {name}: {said:#?}");
    }
    (said, serde_json::from_str(&read("sweep.json")).expect("it is JSON"), read("index.html"))
}

#[test]
fn a_follower_that_stands_is_at_its_toes_when_eq_42_says() {
    let (said, result, page) = sweep(&workspace().join("config/sweeps/pulled_follower.toml"));
    assert_eq!(said.status, Some(0), "{said:#?}");
    let runs = result["comparison"]["time-to-edge"]["runs"].as_array().expect("runs");
    assert_eq!(runs.len(), 9);
    for run in runs {
        let time = |key: &str| run[key].as_f64().expect("a time");
        let ratio = time("measured_s") / time("predicted_s");
        assert!((0.8..1.2).contains(&ratio), "{ratio}: {run}");
    }
    for text in [&said.out, &page] {
        assert!(text.contains("9 of 9 runs agree with eq. 42 within 20 %"), "{text}");
    }
}

#[test]
fn a_sweep_whose_runs_do_not_agree_with_the_paper_as_they_are_to_fails() {
    let copy = Copy::new();
    copy.replace("sweeps/pulled_follower.toml", "within = 0.2", "within = 0.001");
    copy.replace("sweeps/pulled_follower.toml", "[-0.05, -0.1, -0.2]", "[-0.05]");
    let (said, ..) = sweep(&copy.path("sweeps/pulled_follower.toml"));
    assert_eq!(said.status, Some(1), "{said:#?}");
    assert!(said.out.contains("Simulation and paper disagree at 0.05 m/s"), "{said:#?}");
    assert!(said.out.contains("they do not agree with the paper"), "{said:#?}");
}

#[test]
fn where_the_papers_leader_falls_the_page_says_what_ours_does() {
    let copy = Copy::new();
    let path = "sweeps/late_follower.toml";
    let text = fs::read_to_string(copy.path(path)).expect("it is there");
    let values = text.lines().find(|line| line.starts_with("values")).expect("it is a grid");
    copy.replace(path, values, "values = [0.2, 1.3, 2.5]");
    let (said, result, page) = sweep(&copy.path(path));
    assert_eq!(said.status, Some(0), "{said:#?}");
    let runs = &result["comparison"]["follower-delay"]["runs"];
    assert_eq!(runs[0]["leader"]["edge_s"], Value::Null, "it does not come to the edge");
    assert!(runs[1]["leader"]["edge_s"].as_f64().is_some_and(|edge_s| edge_s < 1.1), "{runs:#}");
    assert!(page.contains("the paper's leader"), "{page}");
    assert!(page.contains("nobody falls with up to 2.5 s"), "{page}");
    assert!(!page.contains("the team comes to a safe stop"), "{page}");
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
