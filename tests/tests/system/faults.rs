//! Whatever dies for good, the run ends, says so, and leaves nothing behind. A run that hangs is a test that
//! hangs.

use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{Board, Role};
use mikoshi_tests::run::{Results, Running, is_alive, left_behind, run};
use mikoshi_tests::scenarios::{ENDLESS, SHORT, of_project};
use rustix::process::{Pid, Signal, kill_process};
use std::path::PathBuf;
use std::thread::yield_now;

fn start(results: &Results) -> Running {
    Running::start(&of_project("hold"), &ENDLESS, results)
}

/// A run in which nobody who dies is replaced.
fn start_without_successors(results: &Results) -> Running {
    let arguments = [&ENDLESS[..], &["--set", "supervision.restart_limit=0"]].concat();
    Running::start(&of_project("hold"), &arguments, results)
}

fn kill_one(service: ServiceId, name: &str, kind: &str) {
    let results = Results::new();
    let running = start_without_successors(&results);
    let (directory, services) = (running.directory(), running.services());
    assert_eq!(services.len(), 6);

    running.signal_service(service, Signal::KILL);
    let said = running.wait();
    said.expect_error(3, &[&format!("{name} died in tick "), "SIGKILL"]);
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
    assert_eq!(services.iter().filter(|(_, pid)| is_alive(*pid)).count(), 0);

    let summary = results.summary();
    assert_eq!(summary["passed"], false);
    let cause = &summary["faults"][0];
    assert_eq!((&cause["service"], &cause["code"]), (&kind.into(), &"died".into()), "{summary:#}");
    assert!(summary["failures"][0].as_str().is_some_and(|text| text.starts_with("the run ended after")));
}

#[test]
fn a_bridge_that_is_killed_ends_the_run() {
    kill_one(ServiceId::Bridge, "bridge", "bridge");
}

#[test]
fn a_coordinator_that_is_killed_ends_the_run() {
    kill_one(ServiceId::Coordinator, "coordinator", "coordinator");
}

#[test]
fn a_servo_that_is_killed_ends_the_run() {
    kill_one(ServiceId::Servo(2), "servo of robot C", "servo");
}

fn freeze_one(service: ServiceId, name: &str, kind: &str) {
    let results = Results::new();
    let running = start_without_successors(&results);
    let (directory, services) = (running.directory(), running.services());
    running.signal_service(service, Signal::STOP);
    let said = running.wait();
    said.expect_error(3, &["nothing moved for 3.0 s", &format!("all wait for {name} in tick "), "frozen"]);
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
    assert_eq!(services.iter().filter(|(_, pid)| is_alive(*pid)).count(), 0);

    let summary = results.summary();
    assert_eq!(summary["faults"].as_array().map(Vec::len), Some(1), "{summary:#}");
    let cause = &summary["faults"][0];
    assert_eq!((&cause["service"], &cause["code"]), (&kind.into(), &"stalled".into()), "{summary:#}");
}

#[test]
fn a_bridge_that_is_frozen_ends_the_run() {
    freeze_one(ServiceId::Bridge, "bridge", "bridge");
}

#[test]
fn a_coordinator_that_is_frozen_ends_the_run() {
    freeze_one(ServiceId::Coordinator, "coordinator", "coordinator");
}

#[test]
fn a_servo_that_is_frozen_ends_the_run() {
    freeze_one(ServiceId::Servo(2), "servo of robot C", "servo");
}

#[test]
fn a_service_that_dies_again_and_again_is_given_up() {
    let results = Results::new();
    let running = start(&results);
    let directory = running.directory();
    // Its successors can't get on: they wait for the bridge.
    running.signal_service(ServiceId::Bridge, Signal::STOP);
    let mut last = None;
    loop {
        let Ok(board) = Board::open(&directory) else { break };
        let owner = board.statuses().into_iter().find(|status| status.role == Role::Service(VICTIM));
        let Some(process) = owner.and_then(|status| status.process) else { break };
        if last.replace(process) != Some(process)
            && let Some(pid) = Pid::from_raw(process.pid as i32)
        {
            let _ = kill_process(pid, Signal::KILL);
        }
        yield_now();
    }
    running.wait().expect_error(3, &["servo of robot C died"]);
    // Its first deaths may be in earlier phases: what is counted is how often it dies in one.
    let swaps = results.summary()["swaps"].as_array().map_or(0, Vec::len);
    assert!((3..=6).contains(&swaps), "{swaps}");
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
}

const VICTIM: ServiceId = ServiceId::Servo(2);

#[test]
fn a_service_that_freezes_again_and_again_for_a_moment_only_slows_the_run() {
    let results = Results::new();
    let running = start(&results);
    for _ in 0..100 {
        running.signal_service(ServiceId::Servo(1), Signal::STOP);
        yield_now();
        running.signal_service(ServiceId::Servo(1), Signal::CONT);
    }
    running.signal(Signal::TERM);
    assert_eq!(running.wait().status, Some(143));
    assert_eq!(results.summary()["faults"].as_array().map(Vec::len), Some(0));
}

#[test]
fn a_frozen_service_does_not_keep_the_run_from_ending() {
    let results = Results::new();
    let running = start(&results);
    let (directory, services) = (running.directory(), running.services());
    running.signal_service(ServiceId::Servo(0), Signal::STOP);
    running.signal(Signal::TERM);
    let said = running.wait();
    assert_eq!(said.status, Some(143), "{said:#?}");
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
    assert_eq!(services.iter().filter(|(_, pid)| is_alive(*pid)).count(), 0);
}

#[test]
fn an_interrupt_ends_all_and_keeps_what_was_recorded() {
    let results = Results::new();
    let running = start(&results);
    let (directory, services) = (running.directory(), running.services());
    running.signal(Signal::INT);
    let said = running.wait();
    said.expect_error(130, &["stopped after "]);
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
    assert_eq!(services.iter().filter(|(_, pid)| is_alive(*pid)).count(), 0);
    assert!(results.log().exists() && results.summary()["ticks"].as_u64() > Some(0));
}

#[test]
fn services_go_on_without_a_supervisor_that_is_killed_and_the_next_run_cleans_up() {
    let results = Results::new();
    let running = Running::start(
        &of_project("hold"),
        &["--set", "duration_s=5", "--set", "hybrid.start_s=1"],
        &results,
    );
    let (directory, services) = (running.directory(), running.services());
    running.signal(Signal::KILL);
    assert_eq!(running.wait().status, None);
    let board = Board::open(&directory).expect("a board");
    while services.iter().any(|(_, pid)| is_alive(*pid)) {
        yield_now();
    }
    let ends = services.iter().map(|(service, _)| board.last_position(*service).expect("a service").tick);
    assert!(ends.into_iter().all(|tick| tick == 999), "{:#?}", board.statuses());
    let said = run(&of_project("hold"), &SHORT, &Results::new());
    assert_eq!(said.status, Some(1), "{said:#?}");
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
}

#[test]
fn a_second_run_beside_the_first_disturbs_neither() {
    let (one, other) = (Results::new(), Results::new());
    let first = start(&one);
    let second = start_without_successors(&other);
    assert_ne!(first.directory(), second.directory());
    second.signal_service(ServiceId::Bridge, Signal::KILL);
    second.wait().expect_error(3, &["bridge died"]);
    assert!(first.services().iter().all(|(_, pid)| is_alive(*pid)));
    first.signal(Signal::TERM);
    assert_eq!(first.wait().status, Some(143));
}

#[test]
fn a_second_run_into_the_same_folder_is_refused() {
    let results = Results::new();
    let running = start(&results);
    run(&of_project("hold"), &["--force"], &results)
        .expect_error(2, &["--out", "another run writes its results there"]);
    running.signal(Signal::TERM);
    running.wait();
    run(&of_project("hold"), &[], &results).expect_error(2, &["results of an earlier run", "--force"]);
}
