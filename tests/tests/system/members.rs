//! Robots leave and join while the team carries: with physics, from the scenario to the summary.

use mikoshi_ipc_types::ServiceId;
use mikoshi_tests::log::Log;
use mikoshi_tests::run::{Results, Running, run, say_mikoshi};
use mikoshi_tests::scenarios::of_project;
use rustix::process::Signal;
use serde_json::Value;
use std::path::Path;

/// D's way out and in, in the order of time.
const STAGES: [&str; 13] = [
    "member",
    "halting",
    "unburdening",
    "opening",
    "withdrawing",
    "leaving",
    "away",
    "returning",
    "approaching",
    "reaching",
    "closing",
    "joining",
    "member",
];

fn figure(row: &Value, key: &str) -> f64 {
    row[key].as_f64().expect("a figure")
}

/// The scenario's own thresholds hold, and nothing that leaving or joining does is more than walking does.
#[test]
fn four_carry_three_go_on_and_four_carry_again() {
    for mass in ["object.mass_kg=3", "object.mass_kg=10"] {
        let results = Results::new();
        let said = run(&of_project("members"), &["--in-process", "--no-log", "--set", mass], &results);
        let summary = results.summary();
        assert_eq!(said.status, Some(0), "{mass}: {:#}", summary["failures"]);
        assert_eq!(summary["faults"], Value::Array(vec![]), "nobody has lost anything");
        assert_eq!(summary["unintended_contact_ticks"], 0);
        let members = summary["members"].as_array().expect("stages");
        let stages: Vec<_> = members.iter().map(|row| row["stage"].as_str().expect("a name")).collect();
        assert_eq!(stages, STAGES);
        for row in members {
            assert!(figure(row, "internal_peak_n") <= 30.0, "{mass}: {row:#}");
            assert!(figure(row, "object_peak_m") <= 0.02, "{mass}: {row:#}");
            // At 0.06 m/s it walks off; nobody's reference does more than walk.
            assert!(figure(row, "hand_step_max_m") <= 3.2e-4, "{mass}: {row:#}");
        }
        let of_stage = |name: &str| members.iter().find(|row| row["stage"] == name).expect("it came");
        for quiet in ["unburdening", "opening", "closing", "joining"] {
            assert!(figure(of_stage(quiet), "hand_step_max_m") <= 2e-5, "{mass}: {:#}", of_stage(quiet));
        }
    }
}

#[test]
fn processes_and_one_thread_see_a_robot_leave_with_the_same_bytes() {
    let short = [
        "--set",
        "duration_s=5",
        "--set",
        r#"membership=[{robot = "B", leave_s = 1.0}]"#,
        "--set",
        "motion.segments.0.duration_s=0.5",
    ];
    let (threads, processes) = (Results::new(), Results::new());
    for (results, arguments) in [(&threads, &["--in-process"][..]), (&processes, &[])] {
        let said = run(&of_project("members"), &[&short[..], arguments].concat(), results);
        assert_eq!(said.status, Some(1), "it is still on its way: {said:#?}");
        let members = results.summary()["members"].clone();
        assert!(members.as_array().expect("stages").iter().any(|row| row["stage"] == "withdrawing"));
    }
    assert_eq!(Log::read(&threads.log()).first_difference(&Log::read(&processes.log())), None);
}

#[test]
fn somebody_asks_a_robot_to_leave_while_processes_are_killed_and_the_log_replays() {
    let results = Results::new();
    let arguments = ["--set", "membership=", "--set", "motion=", "--set", "duration_s=9"];
    let running = Running::start(&of_project("members"), &arguments, &results);
    running.wait_for_tick(300);
    running.say(&["leave", "Z"]).expect_error(2, &["\"Z\"", "a robot of the team"]);
    running.say(&["join", "D"]).expect_error(2, &["in the team already"]);
    let left = running.say(&["leave", "D"]).from_tick();
    running.say(&["leave", "D"]).expect_error(2, &["away already"]);
    running.wait_for_tick(left + 200);
    running.signal_service(ServiceId::Coordinator, Signal::KILL);
    running.wait_for_tick(left + 500);
    running.signal_service(ServiceId::Bridge, Signal::KILL);
    let said = running.wait();
    assert_eq!(said.status, Some(1), "it is still on its way: {said:#?}");
    let summary = results.summary();
    let members = summary["members"].as_array().expect("stages");
    let stages: Vec<_> = members.iter().map(|row| row["stage"].as_str().expect("a name")).collect();
    assert!(stages.len() > 4 && STAGES.starts_with(&stages), "{stages:?}");
    let said = say_mikoshi([Path::new("replay"), &results.log()]);
    assert_eq!(said.status, Some(0), "{said:#?}");
}
