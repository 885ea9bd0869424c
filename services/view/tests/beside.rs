//! Viewers beside a run, and what becomes of the run when they are in trouble.

#![allow(missing_docs)]

use mikoshi_tests::programs::mikoshi;
use mikoshi_tests::run::{Results, Running, run, say};
use mikoshi_tests::scenarios::of_project;
use rustix::process::{Pid, Signal, kill_process};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::yield_now;

const LONG: [&str; 4] = ["--set", "team=two", "--set", "duration_s=60"];

/// `mikoshi view`, which is built with this test.
fn view() -> Command {
    let beside = Path::new(env!("CARGO_BIN_EXE_mikoshi-view")).parent();
    assert_eq!(beside, Path::new(mikoshi().get_program()).parent(), "one target folder for both");
    let mut command = mikoshi();
    command.arg("view").env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command.stdin(Stdio::null()).stderr(Stdio::piped());
    command
}

fn start(command: &mut Command) -> Child {
    command.stdout(Stdio::piped()).spawn().expect("it starts")
}

fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).expect("it is ours");
}

#[test]
fn viewer_and_recorder_that_are_frozen_and_killed_change_nothing() {
    let alone = Results::new();
    run(&of_project("hold"), &[&LONG[..], &["--in-process", "--no-log"]].concat(), &alone);
    let results = Results::new();
    let running = Running::start(&of_project("hold"), &LONG, &results);
    let name = running.directory().file_name().expect("a name").to_owned();
    let part = results.path().join("part.mcap");
    let mut observers = [
        start(view().arg(&name).args(["--web", "--hz", "200"])),
        start(mikoshi().arg("record").arg(&name).arg("--out").arg(&part).stderr(Stdio::null())),
    ];
    // Once the page is there and frames are in the file, both stop; then they are killed.
    let mut page = String::new();
    let said = observers[0].stdout.as_mut().expect("it was asked for");
    BufReader::new(said).read_line(&mut page).expect("it says where the page is");
    assert!(page.starts_with("http://127.0.0.1:"), "{page}");
    while !std::fs::metadata(&part).is_ok_and(|file| file.len() > 1 << 20) {
        yield_now();
    }
    observers.iter().for_each(|observer| signal(observer, Signal::STOP));
    let told = running.wait();
    assert!(matches!(told.status, Some(0 | 1)), "{told:#?}");
    for mut observer in observers {
        signal(&observer, Signal::KILL);
        observer.wait().expect("it was started");
    }
    let (summary, alone) = (results.summary(), alone.summary());
    assert_eq!((&summary["ticks"], &summary["faults"]), (&12_000.into(), &serde_json::json!([])));
    assert_eq!(summary["log_hash"], alone["log_hash"]);
}

#[test]
fn a_recorded_run_becomes_a_file_and_no_file_is_overwritten() {
    let results = Results::new();
    let short = ["--set", "team=two", "--set", "duration_s=2", "--set", "hybrid.start_s=0.5", "--in-process"];
    run(&of_project("hold"), &short, &results);
    let file = results.path().join("run.rrd");
    let save = |more: &[&str]| say(view().arg(results.path()).arg("--save").arg(&file).args(more));
    let told = save(&[]);
    assert_eq!(told.status, Some(0), "{told:#?}");
    let bytes = std::fs::read(&file).expect("it was written");
    assert!(bytes.len() > 100_000 && bytes.starts_with(b"RRF"), "{} bytes", bytes.len());
    save(&[]).expect_error(2, &["exists", "--force"]);
    assert_eq!(save(&["--force"]).status, Some(0));
}

#[test]
fn where_there_is_no_window_it_is_said_what_to_do() {
    let results = Results::new();
    let short = ["--set", "team=two", "--set", "duration_s=1", "--set", "hybrid.start_s=0.5", "--in-process"];
    run(&of_project("hold"), &short, &results);
    // Nothing is on this path. Under CI Rerun says, besides, that nobody would see a window.
    let mut command = view();
    command.arg(results.log()).env("PATH", results.path()).env_remove("CI");
    say(&mut command).expect_error(2, &["`rerun`", "PATH", "--web"]);
}
