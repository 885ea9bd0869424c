//! Recorders beside a run, and what becomes of the run when they are in trouble.

use mikoshi_observation::{LogReader, Observation};
use mikoshi_tests::programs::mikoshi;
use mikoshi_tests::run::{Results, Running, Said, run, say, say_mikoshi};
use mikoshi_tests::scenarios::of_project;
use rustix::process::{Pid, Signal, kill_process};
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::yield_now;

/// A run that waits for its recorders, and is long enough for them to come.
const LONG: [&str; 4] = ["--set", "team=two", "--set", "duration_s=60"];

fn start(results: &Results) -> Running {
    Running::start(&of_project("hold"), &LONG, results)
}

fn record(running: &Running, out: &Path) -> Child {
    let directory = running.directory();
    let mut command = mikoshi();
    command.arg("record").arg(directory.file_name().expect("a name")).arg("--out").arg(out);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
}

fn said(child: Child) -> Said {
    child.wait_with_output().expect("it was started").into()
}

/// First and last tick of a log that is whole, each as its bytes.
fn ends_of(log: &Path) -> [(u64, Vec<u8>); 2] {
    let mut log = LogReader::open(log).expect("a log");
    let mut observation = Observation::for_team(log.run().robots.len());
    let mut ends = vec![];
    let mut count = 0;
    while log.read_tick(&mut observation).expect("it is whole") {
        let mut bytes = vec![];
        observation.for_each_payload(|payload| bytes.extend_from_slice(payload.bytes));
        ends.truncate(1);
        ends.push((observation.tick(), bytes));
        count += 1;
    }
    assert_eq!(ends[1].0 - ends[0].0 + 1, count, "ticks are missing");
    ends.try_into().expect("two ticks at least")
}

/// What the run is if nobody disturbs it.
fn undisturbed() -> String {
    let results = Results::new();
    run(&of_project("hold"), &[&LONG[..], &["--in-process", "--no-log"]].concat(), &results);
    results.summary()["log_hash"].as_str().expect("a hash").to_owned()
}

#[test]
fn a_recorder_that_comes_late_has_all_from_then_to_the_end() {
    let results = Results::new();
    let running = start(&results);
    let part = results.path().join("part.mcap");
    let told = said(record(&running, &part));
    assert_eq!(told.status, Some(0), "{told:#?}");
    assert!(told.out.contains("to 11999 in "), "{told:#?}");
    running.wait();
    let ([whole_first, whole_last], [first, last]) = (ends_of(&results.log()), ends_of(&part));
    assert_eq!((whole_first.0, last.0), (0, 11_999));
    assert!(first.0 > 0 && last == whole_last);
}

#[test]
fn listeners_that_are_frozen_and_killed_or_take_nothing_change_nothing() {
    let results = Results::new();
    let running = start(&results);
    let recorders = ["one", "two"].map(|name| record(&running, &results.path().join(name)));
    // Two that ask for ticks, all of them or some as a viewer does, and never take one.
    let _takes_nothing = [b"A", b"S"].map(|wish| {
        let mut feed = UnixStream::connect(running.directory().join("feed")).expect("somebody speaks there");
        feed.write_all(wish).expect("it is heard");
        feed
    });
    let signal = |child: &Child, signal| {
        let pid = Pid::from_raw(child.id() as i32).expect("a pid");
        kill_process(pid, signal).expect("it is ours");
    };
    // Once they record, one stops and one is killed.
    for name in ["one", "two"] {
        while !std::fs::metadata(results.path().join(name)).is_ok_and(|file| file.len() > 1 << 20) {
            yield_now();
        }
    }
    signal(&recorders[0], Signal::STOP);
    signal(&recorders[1], Signal::KILL);
    let of_run = running.wait();
    assert!(matches!(of_run.status, Some(0 | 1)), "{of_run:#?}");
    signal(&recorders[0], Signal::CONT);
    let [frozen, _] = recorders.map(said);
    // Nobody waited for it; where it kept up until the end was near, it has all.
    assert!(matches!(frozen.status, Some(0 | 1)), "{frozen:#?}");
    let summary = results.summary();
    assert_eq!((&summary["ticks"], &summary["faults"]), (&12_000.into(), &serde_json::json!([])));
    assert_eq!(summary["log_hash"], undisturbed());
}

#[test]
fn a_run_whose_log_can_not_be_written_any_more_goes_on_and_says_so() {
    let results = Results::new();
    let mut limited = Command::new("sh");
    // A file that may not grow is what a full disk is.
    limited.args(["-c", "trap '' XFSZ; ulimit -f 4096; exec \"$@\"", "sh"]);
    let plain = mikoshi();
    limited.arg(plain.get_program()).args(["run", "--quiet", "--in-process", "--out"]);
    limited.arg(results.path()).arg(of_project("hold")).args(LONG);
    for (name, value) in plain.get_envs() {
        limited.env(name, value.unwrap_or_default());
    }
    let told = say(&mut limited);
    assert_eq!(told.status, Some(1), "{told:#?}");
    assert!(told.error.contains("warning: the log ends in tick "), "{told:#?}");
    let summary = results.summary();
    assert_eq!((&summary["ticks"], &summary["faults"][0]["code"]), (&12_000.into(), &"log-lost".into()));
    let failures = summary["failures"].to_string();
    assert!(failures.contains("the log ends in tick "), "{failures}");
}

#[test]
fn there_is_nothing_to_record_where_nothing_runs_and_no_file_is_overwritten() {
    let results = Results::new();
    let out = results.path().join("part.mcap");
    let out = out.to_str().expect("a path");
    say_mikoshi(["record", "0-0", "--out", out]).expect_error(2, &["runs"]);
    let running = start(&results);
    let name = running.directory().file_name().expect("a name").to_string_lossy().into_owned();
    std::fs::write(out, "precious").expect("it is writable");
    say_mikoshi(["record", &name, "--out", out]).expect_error(2, &["exists", "--force"]);
    assert_eq!(std::fs::read(out).expect("it is there"), b"precious");
    running.signal(Signal::TERM);
    running.wait();
}
