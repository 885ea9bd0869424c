//! Runs by the clock: what does not come in time is done without, and nobody notices who is replaced.

use mikoshi_ipc_types::ServiceId;
use mikoshi_tests::run::{Results, Running, left_behind, say_mikoshi};
use mikoshi_tests::scenarios::of_project;
use rustix::process::Signal;
use std::path::{Path, PathBuf};

/// Machines that test may stall: the team has patience.
const PATIENT: [&str; 2] = ["--set", "safety.stale_limit_ticks=400"];

fn start(arguments: &[&str], results: &Results) -> Running {
    let arguments = [&["--real-time", "--set", "team=two"], arguments].concat();
    Running::start(&of_project("hold"), &arguments, results)
}

#[test]
fn a_run_by_the_clock_takes_its_time_and_replays_to_the_last_bit() {
    let results = Results::new();
    let arguments = [&PATIENT[..], &["--set", "duration_s=6", "--set", "hybrid.start_s=1"]].concat();
    let said = start(&arguments, &results).wait();
    assert!(matches!(said.status, Some(0 | 1)), "{said:#?}");
    let summary = results.summary();
    assert_eq!(
        (&summary["ticks"], &summary["faults"]),
        (&1200.into(), &serde_json::json!([])),
        "{summary:#}"
    );
    assert!(summary["wall_time_s"].as_f64() >= Some(5.99), "{summary:#}");
    // A recorder that was kept from running for a third of a second says what it has lost.
    if summary["timing"]["frames_lost"] == 0 {
        let said = say_mikoshi([Path::new("replay"), &results.log()]);
        assert_eq!(said.status, Some(0), "{said:#?}");
        assert_eq!(said.out.matches("the same to the last bit in 1200 ticks").count(), 4, "{said:#?}");
    }
}

#[test]
fn who_is_killed_or_frozen_is_replaced_by_a_standby_and_nothing_remains() {
    let results = Results::new();
    let (scenario, out) = (of_project("hold"), results.path().join("soak"));
    let arguments = ["soak", "--real-time", "--kills", "3", "--freezes", "3", "--quiet", "--out"];
    let overrides = ["--seed", "5", "--set", "team=two", "--set", "duration_s=14"];
    let arguments = arguments.map(Path::new).into_iter().chain([out.as_path(), &scenario]);
    let said = say_mikoshi(arguments.chain(overrides.iter().chain(&PATIENT).map(Path::new)));
    let told = std::fs::read(out.join("soak.json")).expect("a result");
    let told: serde_json::Value = serde_json::from_slice(&told).expect("JSON");
    // Where many tests share few cores, forces may be larger than the scenario allows; but nothing else is wrong.
    assert!(matches!(said.status, Some(0 | 1)), "{said:#?}");
    let failures = told["failures"].to_string();
    for problem in ["blows", "replaced", "left", "input-stale", "lost", "fell"] {
        assert!(!failures.contains(problem), "{failures}");
    }
    assert_eq!(told["rounds"][0]["blows"], 6, "{told:#}");
    let times = |service: &str, cause: &str| {
        let rows = told["losses"].as_array().expect("a list").iter();
        let mut rows = rows.filter(|row| row["service"] == service && row["cause"] == cause);
        rows.next().map_or(0, |row| row["times"].as_u64().expect("a number"))
    };
    for service in ["servo", "coordinator"] {
        assert!(times(service, "killed by signal 9") >= 1, "{told:#}");
        assert!(times(service, "fell behind") >= 1, "{told:#}");
    }
}

#[test]
fn without_a_standby_and_a_successor_the_team_stops_and_holds() {
    let results = Results::new();
    let of_run =
        ["--set", "duration_s=8", "--set", "hybrid.start_s=1", "--set", "supervision.restart_limit=0"];
    let arguments = [&PATIENT[..], &of_run].concat();
    let running = start(&arguments, &results);
    let directory = running.directory();
    running.signal_service(ServiceId::Servo(1), Signal::KILL);
    let said = running.wait();
    // Warnings come first.
    assert!(said.status == Some(3) && said.error.contains("error: servo of robot B was lost"), "{said:#?}");
    let summary = results.summary();
    assert_eq!((&summary["ticks"], &summary["fell"]), (&1600.into(), &serde_json::json!([])), "{summary:#}");
    let faults = summary["faults"].as_array().expect("a list");
    let has = |code: &str| faults.iter().any(|fault| fault["code"] == code && fault["robot"] == "B");
    assert!(has("lost") && has("input-stale"), "{summary:#}");
    let last = summary["modes"].as_array().and_then(|modes| modes.last()).expect("a mode");
    assert_eq!(last["mode"], "safe stop");
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
}

#[test]
fn a_swap_puts_the_new_process_in_charge_and_not_the_standby() {
    let results = Results::new();
    let of_run = ["--set", "duration_s=8", "--set", "hybrid.start_s=1", "--set", "supervision.standby=true"];
    let running = start(&[&PATIENT[..], &of_run].concat(), &results);
    running.wait_for_standbys(3);
    let directory = running.directory();
    let name = directory.file_name().expect("a name").to_string_lossy().into_owned();
    let swap = || say_mikoshi(["swap", "A", "--run", &name, "--set", "balance.stabiliser=false"]);
    // On a busy machine the standby may just have been needed.
    while swap().status != Some(0) {}
    let board = mikoshi_runtime::Board::open(&directory).expect("it is running");
    let process = board.process_of(ServiceId::Servo(0)).expect("it has one");
    let told = std::fs::read_to_string(format!("/proc/{}/cmdline", process.pid)).expect("it lives");
    assert!(told.contains("--spec") && told.contains("--replace"), "{told:?}");
    let said = running.wait();
    assert!(matches!(said.status, Some(0 | 1)), "{said:#?}");
    let swaps = &results.summary()["swaps"];
    assert!(swaps.as_array().expect("a list").iter().any(|swap| swap["cause"] == "swap"), "{swaps:#}");
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
}
