//! Whoever is killed, freezes or is replaced while the team walks: nobody sees a difference, and nothing is
//! left behind.

use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::Board;
use mikoshi_tests::run::{Results, Running, is_alive, left_behind, run, say_mikoshi};
use mikoshi_tests::scenarios::of_project;
use rustix::process::Signal;
use std::path::{Path, PathBuf};
use std::thread::yield_now;

/// A short one: it begins at one and a half seconds, and ends before eight.
const WALK: [&str; 10] = [
    "--set",
    "duration_s=8.0",
    "--set",
    "motion.start_s=1.5",
    "--set",
    "motion.random.duration_s=6.0",
    "--set",
    "motion.random.travel_m=[0.2, 0.05, 0.0]",
    "--set",
    "motion.random.travel_rad=[0.0, 0.0, 0.05]",
];
const TICKS: u64 = 1600;

/// Starts a walk, and hands it to somebody who disturbs it; what it came to.
fn disturbed(arguments: &[&str], disturb: impl FnOnce(&Running)) -> Results {
    let results = Results::new();
    let running = Running::start(&of_project("transport"), &[&WALK, arguments].concat(), &results);
    let directory = running.directory();
    disturb(&running);
    let said = running.wait();
    // So short a walk does not meet what is asked of a long one.
    assert_eq!(said.status, Some(1), "{said:#?}");
    assert_eq!(results.summary()["ticks"], TICKS, "{said:#?}");
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
    results
}

fn undisturbed_hash() -> serde_json::Value {
    let results = Results::new();
    let said = run(&of_project("transport"), &[&WALK[..], &["--in-process"]].concat(), &results);
    assert_eq!(said.status, Some(1), "{said:#?}");
    results.summary()["log_hash"].clone()
}

fn epoch_of(running: &Running, service: ServiceId) -> u64 {
    let board = Board::open(&running.directory()).expect("it runs");
    board.charge_of(service).expect("it is there").0
}

fn replay(log: &Path) -> mikoshi_tests::run::Said {
    say_mikoshi([Path::new("replay"), log])
}

#[test]
fn processes_may_be_killed_while_the_team_walks() {
    let expected = undisturbed_hash();
    let (bridge, coordinator) = (ServiceId::Bridge, ServiceId::Coordinator);
    let victims: [&[ServiceId]; 5] = [
        &[bridge],
        &[coordinator],
        &[ServiceId::Servo(1)],
        &[bridge, ServiceId::Servo(3)],
        &[coordinator, ServiceId::Servo(0), ServiceId::Servo(2)],
    ];
    let results = disturbed(&[], |running| {
        for (index, victims) in victims.into_iter().enumerate() {
            running.wait_for_tick(850 + 120 * index as u64);
            let epochs: Vec<_> = victims.iter().map(|victim| epoch_of(running, *victim)).collect();
            victims.iter().for_each(|victim| running.signal_service(*victim, Signal::KILL));
            for (victim, epoch) in victims.iter().zip(epochs) {
                while epoch_of(running, *victim) == epoch {
                    yield_now();
                }
            }
        }
    });
    let summary = results.summary();
    assert_eq!(summary["log_hash"], expected);
    let swaps = summary["swaps"].as_array().expect("a list");
    assert_eq!(swaps.len(), victims.concat().len(), "{swaps:#?}");
    for swap in swaps {
        assert_eq!((&swap["cause"], &swap["ticks_lost"]), (&"killed by signal 9".into(), &0.into()));
    }
    let said = replay(&results.log());
    assert_eq!(said.status, Some(0), "{said:#?}");
}

#[test]
fn a_process_that_freezes_is_replaced() {
    let expected = undisturbed_hash();
    let results = disturbed(&[], |running| {
        running.wait_for_tick(900);
        running.signal_service(ServiceId::Servo(2), Signal::STOP);
    });
    let summary = results.summary();
    assert_eq!(summary["log_hash"], expected);
    assert_eq!(summary["swaps"].as_array().map(Vec::len), Some(1));
    let swap = &summary["swaps"][0];
    assert_eq!((&swap["robot"], &swap["cause"]), (&"C".into(), &"frozen".into()), "{swap:#}");
}

fn swap(running: &Running, arguments: &[&str]) -> mikoshi_tests::run::Said {
    let name = running.directory().file_name().expect("a name").to_string_lossy().into_owned();
    say_mikoshi([&["swap", "--run", &name], arguments].concat())
}

#[test]
fn processes_are_swapped_while_the_team_walks() {
    let expected = undisturbed_hash();
    let results = disturbed(&[], |running| {
        let before = running.services();
        running.wait_for_tick(850);
        for service in ["B", "coordinator", "bridge"] {
            let said = swap(running, &[service]);
            assert_eq!(said.status, Some(0), "{said:#?}");
            assert!(said.out.contains("replaced in tick "), "{said:#?}");
        }
        let gone = before.iter().filter(|(_, pid)| !is_alive(*pid)).map(|(service, _)| *service);
        let gone: Vec<_> = gone.collect();
        assert_eq!(gone, [ServiceId::Bridge, ServiceId::Servo(1), ServiceId::Coordinator]);
    });
    let summary = results.summary();
    assert_eq!(summary["log_hash"], expected);
    let causes: Vec<_> = summary["swaps"].as_array().expect("a list").iter().map(|s| &s["cause"]).collect();
    assert_eq!(causes, ["swap"; 3]);
}

#[test]
fn a_swap_may_bring_other_settings_and_the_log_knows_them() {
    let results = disturbed(&[], |running| {
        running.wait_for_tick(850);
        for arguments in [
            &["C", "--set", "balance.stabiliser=false"][..],
            &["coordinator", "--set", "hybrid.loop_gain=0.05"],
            &["coordinator", "--set", "hybrid.filter_hz=9"],
            &["C"],
        ] {
            let said = swap(running, arguments);
            assert_eq!(said.status, Some(0), "{said:#?}");
        }
    });
    assert_ne!(results.summary()["log_hash"], undisturbed_hash());
    let said = replay(&results.log());
    assert_eq!(said.status, Some(0), "{said:#?}");
}

#[test]
fn a_swap_that_can_not_be_is_refused_and_changes_nothing() {
    let expected = undisturbed_hash();
    let results = disturbed(&[], |running| {
        running.wait_for_tick(850);
        let refusals = [
            (&["Z"][..], "expected one of bridge, A, B, C, D, coordinator"),
            (&["A", "--set", "control_period_s=0.004"], "can't change in the middle of a run"),
            (&["A", "--set", "gait.lift=1"], "gait.lift"),
            (&["bridge", "--set", "object.mass_kg=5"], "the predecessor's state has another layout"),
            (&["A", "--program", "/bin/false"], "its successor has ended"),
        ];
        for (arguments, expected) in refusals {
            swap(running, arguments).expect_error(2, &[expected]);
        }
    });
    let summary = results.summary();
    assert_eq!((&summary["log_hash"], &summary["swaps"]), (&expected, &serde_json::json!([])));
}

#[test]
fn a_swap_without_a_run_is_an_error() {
    say_mikoshi(["swap", "A", "--run", "no-such-run"]).expect_error(2, &["no-such-run"]);
}

#[test]
fn a_soak_kills_at_random_and_finds_no_difference() {
    let results = Results::new();
    let scenario = of_project("transport");
    let out = results.path().join("soak");
    let arguments = ["soak", "--kills", "8", "--quiet", "--seed", "2", "--out"].map(Path::new);
    let arguments = arguments.into_iter().chain([out.as_path(), &scenario]);
    let said = say_mikoshi(arguments.chain(WALK.map(Path::new)));
    let told = std::fs::read(out.join("soak.json")).expect("a result");
    let told: serde_json::Value = serde_json::from_slice(&told).expect("JSON");
    // So short a walk does not meet what is asked of a long one; but nothing else is wrong.
    assert_eq!(said.status, Some(1), "{said:#?}");
    assert_eq!(told["undisturbed_hash"], told["disturbed_hash"], "{told:#}");
    assert_eq!(told["left_behind"], serde_json::json!([]));
    let kills = told["kills"].as_array().expect("a list").len();
    assert!(kills >= 8, "{told:#}");
    let failures = told["failures"].to_string();
    assert!(!failures.contains("replaced"), "{failures}");
}
