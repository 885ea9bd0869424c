//! Runs whose supervisor is killed: they go on, and another looks after them.

use mikoshi_ipc_types::ServiceId;
use mikoshi_observation::{LogReader, Observation};
use mikoshi_runtime::Board;
use mikoshi_tests::run::{Results, Running, Said, left_behind, run, say_mikoshi};
use mikoshi_tests::scenarios::of_project;
use rustix::process::Signal;
use std::path::{Path, PathBuf};
use std::thread::yield_now;

/// Long enough for all that happens here.
const LONG: [&str; 4] = ["--set", "team=two", "--set", "duration_s=40"];

/// The run in this directory without its supervisor, and nobody else.
fn adopt(directory: &Path, results: &Results) -> Said {
    let name = directory.file_name().expect("it has a name");
    say_mikoshi([
        Path::new("adopt"),
        Path::new(name),
        Path::new("--quiet"),
        Path::new("--out"),
        results.path(),
    ])
}

fn kill_supervisor(running: Running) -> PathBuf {
    let directory = running.directory();
    running.signal(Signal::KILL);
    assert_eq!(running.wait().status, None);
    directory
}

/// Kills the process of a service once somebody looks after the run in this directory and has seen ticks of it.
fn kill_once_adopted(directory: &Path, service: ServiceId) {
    let board = Board::open(directory).expect("it is running");
    while !board.is_supervised() {
        yield_now();
    }
    let process = board.process_of(service).expect("it has a process");
    mikoshi_runtime::ProcessWatch::new(process).kill();
}

/// The payloads of every tick from this one on.
fn ticks_from(log: &Path, first: u64) -> Vec<Vec<u8>> {
    let mut log = LogReader::open(log).expect("a log");
    let mut observation = Observation::for_team(log.run().robots.len());
    let mut ticks = vec![];
    while log.read_tick(&mut observation).expect("it is whole") {
        if observation.tick() >= first {
            let mut bytes = vec![];
            observation.for_each_payload(|payload| bytes.extend_from_slice(payload.bytes));
            ticks.push(bytes);
        }
    }
    ticks
}

#[test]
fn who_adopts_a_run_sees_what_it_would_have_been_and_starts_successors() {
    let (undisturbed, first, rest) = (Results::new(), Results::new(), Results::new());
    let directory = kill_supervisor(Running::start(&of_project("hold"), &LONG, &first));
    std::thread::scope(|scope| {
        scope.spawn(|| kill_once_adopted(&directory, ServiceId::Servo(1)));
        let said = adopt(&directory, &rest);
        assert!(matches!(said.status, Some(0 | 1)), "{said:#?}");
    });
    let summary = rest.summary();
    assert_eq!(summary["ticks"], 8000, "{summary:#}");
    assert_eq!(summary["swaps"].as_array().map(Vec::len), Some(1), "{summary:#}");
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());

    let from = summary["first_tick"].as_u64().expect("a tick");
    assert!(from > 0, "{summary:#}");
    run(&of_project("hold"), &[&LONG[..], &["--in-process"]].concat(), &undisturbed);
    let (expected, seen) = (ticks_from(&undisturbed.log(), from), ticks_from(&rest.log(), 0));
    assert_eq!((expected.len(), seen.len() as u64), (seen.len(), 8000 - from));
    assert!(expected == seen, "they differ");

    let said = say_mikoshi([Path::new("replay"), &rest.log()]);
    said.expect_error(2, &["begins in tick", "is replayed from its first"]);
}

#[test]
fn by_the_clock_standbys_watch_over_a_run_that_nobody_looks_after() {
    let (first, rest) = (Results::new(), Results::new());
    let by_the_clock =
        ["--real-time", "--set", "team=two", "--set", "duration_s=8", "--set", "hybrid.start_s=1"];
    let patient = ["--set", "safety.stale_limit_ticks=400", "--set", "supervision.standby=true"];
    let arguments = [&by_the_clock[..], &patient].concat();
    let running = Running::start(&of_project("hold"), &arguments, &first);
    let (directory, victim) = (running.directory(), ServiceId::Servo(0));
    let board = Board::open(&directory).expect("it is running");
    running.wait_for_standbys(2 + 1);
    kill_supervisor(running);
    mikoshi_runtime::ProcessWatch::new(board.process_of(victim).expect("a process")).kill();
    while board.charge_of(victim).is_none_or(|(epoch, _)| epoch < 2) {
        yield_now();
    }
    let said = say_mikoshi(["stop", "--run", &directory.file_name().expect("a name").to_string_lossy()]);
    assert!(said.status == Some(0) && said.out.contains("mikoshi adopt"), "{said:#?}");
    let said = adopt(&directory, &rest);
    assert!(matches!(said.status, Some(0 | 1)), "{said:#?}");
    let summary = rest.summary();
    assert_eq!((&summary["ticks"], &summary["fell"]), (&1600.into(), &serde_json::json!([])), "{summary:#}");
    assert_eq!(summary["faults"][0]["code"], "operator-stop", "{summary:#}");
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
}

#[test]
fn a_run_that_has_a_supervisor_is_left_alone() {
    let (results, other) = (Results::new(), Results::new());
    let running = Running::start(&of_project("hold"), &LONG, &results);
    let directory = running.directory();
    adopt(&directory, &other).expect_error(2, &["without a supervisor"]);
    running.signal(Signal::TERM);
    assert_eq!(running.wait().status, Some(143));
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
}
