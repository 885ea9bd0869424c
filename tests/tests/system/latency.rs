//! `mikoshi latency`: what it measures, what it writes, what it refuses.

use mikoshi_tests::run::{Results, Said, say_mikoshi};
use mikoshi_tests::scenarios::of_project;
use serde_json::Value;
use std::path::Path;

const SHORT: [&str; 4] = ["--set", "duration_s=4", "--set", "hybrid.start_s=1"];

fn latency(arguments: &[&str], out: &Path) -> Said {
    let scenario = of_project("hold");
    let arguments = SHORT.iter().chain(arguments).map(Path::new);
    let results = [Path::new("--no-log"), Path::new("--out"), out];
    say_mikoshi([Path::new("latency"), &scenario].into_iter().chain(arguments).chain(results))
}

fn told(out: &Path) -> Value {
    let file = std::fs::read(out.join("latency.json")).expect("it is written");
    serde_json::from_slice(&file).expect("JSON")
}

fn span<'a>(told: &'a Value, name: &str) -> &'a Value {
    let spans = told["spans"].as_array().expect("a list");
    spans.iter().find(|span| span["span"] == name).unwrap_or(&Value::Null)
}

#[test]
fn every_hop_and_every_service_of_a_tick_is_measured() {
    let results = Results::new();
    let said = latency(&["--set", "team=two"], results.path());
    assert_eq!(said.status, Some(0), "{said:#?}");
    for text in ["servo → coordinator", "bridge steps", "page faults", "core 0, idle"] {
        assert!(said.out.contains(text), "no {text:?} in {said:#?}");
    }
    let told = told(results.path());
    // 800 ticks, without those of the warm-up and the last, which has no successor.
    assert_eq!((&told["ticks"], &told["robots"], &told["empty"]), (&599.into(), &2.into(), &false.into()));
    let count = |name: &str| span(&told, name)["count"].clone();
    for name in
        ["servo-to-coordinator", "coordinate", "servo-to-bridge", "step", "sensors-to-commands", "tick"]
    {
        assert_eq!(count(name), 599, "{name}");
    }
    for name in ["bridge-to-servo", "sense", "coordinator-to-servo", "act"] {
        assert_eq!(count(name), 2 * 599, "{name}");
    }
    assert_eq!(count("wake-up"), Value::Null, "nobody looks at a clock");
    let median = |name: &str| span(&told, name)["p50_ns"].as_f64().expect("a number");
    assert!(median("tick") > median("step") && median("step") > 0.0, "{told:#}");
    assert_eq!(told["worst"].as_array().map(Vec::len), Some(10));
    assert_eq!(told["processes"].as_array().map(Vec::len), Some(4));
    assert!(!results.path().join("summary.json").exists(), "nothing was judged");
}

#[test]
fn ticks_of_a_service_ask_for_no_memory_but_for_their_frames() {
    let results = Results::new();
    let said = latency(&["--set", "team=two"], results.path());
    assert_eq!(said.status, Some(0), "{said:#?}");
    let told = told(results.path());
    for process in told["processes"].as_array().expect("a list") {
        let number = |key: &str| process[key].as_u64().expect("a number");
        // One for each frame that is borrowed from the transport's library.
        let frames = match process["service"].as_str().expect("a name") {
            "bridge" => 5,
            "coordinator" => 3,
            _ => 2,
        };
        let most = (frames * number("ticks")) as f64 * 1.05;
        assert!(number("allocations") as f64 <= most, "{process:#}");
        assert!(number("page_faults") <= number("ticks") / 10, "{process:#}");
    }
}

#[test]
fn services_that_compute_nothing_show_what_frames_cost_and_two_results_are_compared() {
    let (results, other) = (Results::new(), Results::new());
    let said = latency(&["--empty", "--json"], results.path());
    assert_eq!(said.status, Some(0), "{said:#?}");
    let printed: Value = serde_json::from_str(&said.out).expect("JSON");
    assert_eq!(printed, told(results.path()));
    assert_eq!(printed["empty"], true);
    let said = latency(&["--empty", "--load", "1", "--set", "placement.yield_us=0"], other.path());
    assert_eq!(said.status, Some(0), "{said:#?}");
    assert_eq!((&told(other.path())["load"], &told(other.path())["yield_us"]), (&1.into(), &0.into()));
    let files = [&results, &other].map(|results| results.path().join("latency.json"));
    let said = say_mikoshi([Path::new("latency"), Path::new("--compare"), &files[0], &files[1]]);
    assert_eq!(said.status, Some(0), "{said:#?}");
    assert!(said.out.contains("p99 ratio") && said.out.contains("sensors → commands"), "{said:#?}");
}

#[test]
fn by_the_clock_every_tick_has_a_time_at_which_it_is_due() {
    let results = Results::new();
    let said = latency(&["--empty", "--real-time"], results.path());
    assert_eq!(said.status, Some(0), "{said:#?}");
    let told = told(results.path());
    assert_eq!(told["clock"], "wall");
    assert!(span(&told, "wake-up")["count"].as_u64() > Some(500), "{told:#}");
    let late = &told["late"];
    let number = |key: &str| late[key].as_u64().expect("a number");
    assert_eq!(number("ticks"), number("by_the_machine") + number("by_us") + number("by_nobody_knows"));
}

#[test]
fn what_can_not_be_measured_is_refused() {
    let results = Results::new();
    say_mikoshi(["latency"]).expect_error(2, &["required"]);
    let said = latency(&["--empty", "--set", "duration_s=1.5"], results.path());
    said.expect_error(2, &["duration_s", "more than 2 s"]);
    let nothing = results.path().join("nothing.json");
    std::fs::write(&nothing, "{}").expect("it is writable");
    let nothing = nothing.to_str().expect("a path");
    say_mikoshi(["latency", "--compare", nothing, nothing])
        .expect_error(2, &["nothing.json", "not a measurement"]);
}
