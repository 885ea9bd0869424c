//! A run is a function of its scenario and its seed, whether in one thread or in a process per service.

use mikoshi_ipc_types::{JointCommand, Payload};
use mikoshi_observation::{LogHash, LogReader, Observation};
use mikoshi_tests::log::{Log, Message};
use mikoshi_tests::run::{Results, run};
use mikoshi_tests::scenarios::{Copy, SHORT, of_project};
use std::fs;

/// Runs the hold scenario for a moment. It can't meet its thresholds in that time.
fn hold_for_a_moment(arguments: &[&str]) -> Results {
    let results = Results::new();
    let said = run(&of_project("hold"), &[&SHORT, arguments].concat(), &results);
    assert_eq!(said.status, Some(1), "{said:#?}");
    results
}

#[test]
fn one_thread_and_six_processes_give_the_same_bytes_twice_each() {
    let reference = hold_for_a_moment(&["--in-process"]);
    let (log, hash) = (Log::read(&reference.log()), reference.summary()["log_hash"].clone());
    assert_eq!(log.messages.len(), 200 * (5 * 4 + 2));
    for arguments in [&["--in-process"][..], &[], &[]] {
        let other = hold_for_a_moment(arguments);
        assert_eq!(log.first_difference(&Log::read(&other.log())), None, "{arguments:?}");
        assert_eq!(other.summary()["log_hash"], hash);
        let (ours, theirs) = (fs::read(reference.log()), fs::read(other.log()));
        assert_eq!(ours.expect("a log"), theirs.expect("a log"));
    }
}

#[test]
fn one_flipped_bit_of_one_frame_is_found_and_named() {
    let log = Log::read(&hold_for_a_moment(&["--in-process"]).log());
    let is_it =
        |message: &Message| (message.name, message.robot, message.tick) == (JointCommand::NAME, 2, 77);
    let place = log.messages.iter().position(is_it);
    let mut flipped = log.clone();
    flipped.messages[place.expect("it was recorded")].payload[8 * 64 + 3] ^= 0b100;
    let difference = log.first_difference(&flipped).expect("it is found");
    assert_eq!(difference, "joint-command[2] of tick 77: joint_velocity_ref_rad_s");
}

#[test]
fn the_log_holds_all_that_the_hash_is_of() {
    let results = hold_for_a_moment(&["--in-process"]);
    let mut log = LogReader::open(&results.log()).expect("the run left a log");
    let (mut hash, mut tick) = (LogHash::default(), Observation::for_team(4));
    while log.read_tick(&mut tick).expect("it is of this build") {
        hash.observe(&tick);
    }
    assert_eq!(results.summary()["log_hash"], hash.to_hex());
}

#[test]
fn what_a_run_leaves_can_be_run_again_with_the_same_bytes() {
    let original = Copy::new();
    let first = Results::new();
    let arguments = [&SHORT[..], &["--seed", "3", "--set", "team=two", "--in-process"]].concat();
    assert_eq!(run(&original.hold(), &arguments, &first).status, Some(1));
    let world = fs::read_to_string(first.world()).expect("it was described");
    assert!(world.starts_with("<mujoco") && world.contains("\"B/r_wrist_sensor+\""), "{world}");

    // Without what it was made from, in processes, and at last in its own place.
    drop(original);
    let again = Results::new();
    assert_eq!(run(&first.scenario(), &[], &again).status, Some(1));
    let hash = first.summary()["log_hash"].clone();
    assert_eq!(again.summary()["log_hash"], hash);
    assert_eq!(fs::read_to_string(again.world()).expect("it was described"), world);
    assert_eq!(run(&first.scenario(), &["--force", "--in-process"], &first).status, Some(1));
    assert_eq!(first.summary()["log_hash"], hash);
}

#[test]
fn another_seed_gives_another_run() {
    let (one, other) =
        (hold_for_a_moment(&["--in-process"]), hold_for_a_moment(&["--in-process", "--seed", "1"]));
    assert_ne!(one.summary()["log_hash"], other.summary()["log_hash"]);
    assert_eq!(other.summary()["seed"], 1);
}
