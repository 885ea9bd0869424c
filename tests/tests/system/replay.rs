//! What was recorded is executed anew and compared, and whatever has changed is found.

use mikoshi_tests::run::{Results, Said, run, say_mikoshi};
use mikoshi_tests::scenarios::{SHORT, of_project};
use std::fs;
use std::path::Path;

fn recorded() -> Results {
    let results = Results::new();
    let said =
        run(&of_project("hold"), &[&SHORT[..], &["--set", "team=two", "--in-process"]].concat(), &results);
    assert_eq!(said.status, Some(1), "{said:#?}");
    results
}

fn replay(log: &Path, arguments: &[&str]) -> Said {
    let arguments = arguments.iter().map(Path::new);
    say_mikoshi([Path::new("replay"), log].into_iter().chain(arguments))
}

#[test]
fn a_run_replays_to_the_last_bit_all_of_it_or_one_service_or_up_to_a_tick() {
    let results = recorded();
    let said = replay(&results.log(), &[]);
    assert_eq!(said.status, Some(0), "{said:#?}");
    assert_eq!(said.out.matches("the same to the last bit in 200 ticks").count(), 4, "{said:#?}");
    let said = replay(&results.log(), &["--service", "B", "--service", "coordinator", "--until", "70"]);
    assert_eq!(said.status, Some(0), "{said:#?}");
    let expected = "servo of robot B: the same to the last bit in 70 ticks\n\
                    coordinator: the same to the last bit in 70 ticks\n\
                    the log holds 70 of 200 ticks\n";
    assert_eq!(said.out, expected);
}

#[test]
fn other_settings_say_something_else_and_where() {
    let results = recorded();
    let said = replay(&results.log(), &["--set", "hybrid.loop_gain=0.01"]);
    assert_eq!(said.status, Some(1), "{said:#?}");
    assert!(said.out.contains("coordinator: differs in "), "{said:#?}");
    assert!(said.out.contains("bridge: the same"), "{said:#?}");
}

#[test]
fn wherever_a_bit_of_the_frames_flips_it_is_found() {
    let results = recorded();
    let log = fs::read(results.log()).expect("a log");
    // Where the frames lie: the run's description is before them, the index behind.
    let (first, last) = (log.len() / 3, log.len() * 9 / 10);
    let spoilt = results.path().join("spoilt.mcap");
    for place in 0..12 {
        let mut bytes = log.clone();
        bytes[first + place * (last - first) / 12] ^= 1 << (place % 8);
        fs::write(&spoilt, bytes).expect("it can be written");
        let said = replay(&spoilt, &[]);
        assert_eq!(said.status, Some(1), "place {place}: {said:#?}");
        let is_named = said.out.contains("first in tick ") || said.out.contains("cut or damaged after ");
        assert!(is_named, "{said:#?}");
    }
}

#[test]
fn a_log_that_was_cut_replays_up_to_the_cut() {
    let results = recorded();
    let log = fs::read(results.log()).expect("a log");
    let cut = results.path().join("cut.mcap");
    fs::write(&cut, &log[..log.len() * 2 / 3]).expect("it can be written");
    let said = replay(&cut, &[]);
    assert_eq!(said.status, Some(1), "{said:#?}");
    assert!(said.out.contains("the log is cut or damaged after "), "{said:#?}");
    assert!(!said.out.contains("differs"), "{said:#?}");
}

#[test]
fn what_can_not_be_replayed_says_so() {
    let results = recorded();
    replay(&results.log(), &["--service", "Z"])
        .expect_error(2, &["expected one of bridge, A, B, coordinator"]);
    replay(&results.log(), &["--set", "team=four"]).expect_error(2, &["--set"]);
    replay(&results.scenario(), &[]).expect_error(2, &["scenario.toml"]);
    replay(Path::new("/nonexistent/run.mcap"), &[]).expect_error(2, &["/nonexistent/run.mcap"]);
}
