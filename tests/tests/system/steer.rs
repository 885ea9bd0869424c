//! Pushes, and settings that change, while a run goes on.

use mikoshi_ipc_types::{ObjectTruth, RobotTruth, ServiceId, TeamCommand, TeamState};
use mikoshi_tests::log::Log;
use mikoshi_tests::run::{Results, Running, run, say_mikoshi};
use mikoshi_tests::scenarios::of_project;
use rustix::process::Signal;
use serde_json::Value;
use std::path::Path;

fn replays(log: &Path) {
    let said = say_mikoshi([Path::new("replay"), log]);
    assert_eq!(said.status, Some(0), "{said:#?}");
}

const STANDING: [&str; 6] = ["--set", "team=two", "--set", "duration_s=8", "--set", "hybrid.start_s=0.5"];

#[test]
fn a_push_of_the_scenario_is_the_same_though_the_world_is_replaced_in_the_middle_of_it() {
    let pushes = r#"world.pushes=[
        {at_s=1.0, for_s=2.0, on="A", force_n=[0.0,15.0,0.0]}, {at_s=2.0, for_s=0.5, on="object", force_n=[5.0,0.0,-10.0]},
    ]"#;
    for scenario in ["hold", "hold_spring"] {
        let arguments = [&STANDING[..], &["--set", pushes]].concat();
        let (thread, processes) = (Results::new(), Results::new());
        let said = run(&of_project(scenario), &[&arguments[..], &["--in-process"]].concat(), &thread);
        assert!(said.status.is_some_and(|status| status < 2), "{said:#?}");
        assert_eq!(thread.summary()["fell"], Value::Array(vec![]));
        let log = Log::read(&thread.log());
        let object = log.payloads::<ObjectTruth>();
        let pushed = |ticks: core::ops::Range<usize>, force: [f64; 3]| {
            object[ticks].iter().all(|truth| truth.push_force_n == force)
        };
        // What has acted in a tick is said with the next.
        assert!(
            pushed(0..401, [0.0; 3]) && pushed(401..501, [5.0, 0.0, -10.0]) && pushed(501..1600, [0.0; 3])
        );
        let a: Vec<_> = log.payloads::<RobotTruth>().into_iter().step_by(2).collect();
        assert_eq!([200, 201, 600, 601].map(|tick: usize| a[tick].push_force_n[1]), [0.0, 15.0, 15.0, 0.0]);
        let sway = a[560].com_position_m[1] - a[200].com_position_m[1];
        assert!(sway > 5e-4, "{scenario}: it gives way: {sway} m");

        let running = Running::start(&of_project(scenario), &arguments, &processes);
        running.wait_for_tick(430);
        running.signal_service(ServiceId::Bridge, Signal::KILL);
        running.wait();
        assert_eq!(log.first_difference(&Log::read(&processes.log())), None, "{scenario}");
        replays(&processes.log());
    }
}

#[test]
fn somebody_pushes_robots_and_the_object_while_they_stand_and_the_log_replays() {
    let results = Results::new();
    let running = Running::start(
        &of_project("hold"),
        &[&STANDING[..4], &["--set", "duration_s=20"]].concat(),
        &results,
    );
    running
        .say(&["push", "Z", "--force", "0,1,0", "--for", "0.2"])
        .expect_error(2, &["\"Z\"", "object or one of A, B"]);
    running.say(&["push", "A", "--force", "0,1e9,0", "--for", "0.2"]).expect_error(2, &["at most 1000 N"]);
    running.say(&["push", "A", "--force", "0,1,0", "--for", "-1"]).expect_error(2, &["--for"]);
    running.say(&["push", "A", "--force", "0,1", "--for", "1"]).expect_error(2, &["three numbers"]);
    let first = running.say(&["push", "B", "--force", "0,-15,0", "--for", "0.2"]).from_tick() as usize;
    let second = running.say(&["push", "object", "--force", "2,0,-5", "--for", "0.1"]).from_tick() as usize;
    running.signal_service(ServiceId::Bridge, Signal::KILL);
    running.wait();
    let log = Log::read(&results.log());
    let b: Vec<_> = log.payloads::<RobotTruth>().into_iter().skip(1).step_by(2).collect();
    let pushed = |truths: &[[f64; 3]]| {
        let begin = truths.iter().position(|force| *force != [0.0; 3]).expect("it is pushed");
        let ticks = truths.iter().filter(|force| **force != [0.0; 3]).count();
        (begin, ticks, truths[begin])
    };
    let forces: Vec<_> = b.iter().map(|truth| truth.push_force_n).collect();
    assert_eq!(pushed(&forces), (first + 1, 40, [0.0, -15.0, 0.0]));
    let forces: Vec<_> = log.payloads::<ObjectTruth>().iter().map(|truth| truth.push_force_n).collect();
    assert_eq!(pushed(&forces), (second + 1, 20, [2.0, 0.0, -5.0]));
    replays(&results.log());
}

#[test]
fn gains_and_references_change_in_one_tick_without_a_jump_and_the_log_replays() {
    let results = Results::new();
    let arguments = ["--set", "duration_s=16", "--set", "hybrid.start_s=0.5"];
    let running = Running::start(&of_project("squeeze"), &arguments, &results);
    running.wait_for_tick(800);
    for (settings, expected) in [
        (&["hybrid.kz=0.04", "gait.lift_m=0.04"][..], "gait.lift_m can't be set"),
        (&["hybrid.kz=7"], "hybrid.kz: found 7"),
        (&["hybrid.kzz=0.05"], "unknown key"),
        (&["duration_s=20"], "duration_s can't change in the middle of a run"),
    ] {
        running.say(&[&["set"], settings].concat()).expect_error(2, &[expected]);
    }
    let tick =
        running.say(&["set", "hybrid.axes.0.reference=30", "hybrid.loop_gain=0.05"]).from_tick() as usize;
    running.wait_for_tick(tick as u64 + 100);
    running.signal_service(ServiceId::Coordinator, Signal::KILL);
    let said = running.wait();
    // Its scenario still judges the 20 N that it asked for itself.
    assert_eq!(said.status, Some(1), "{said:#?}");
    let log = Log::read(&results.log());
    let teams = log.payloads::<TeamState>();
    let reference = |tick: usize| teams[tick].generalized_force_ref[1][0];
    assert!((reference(tick - 1) - 20.0).abs() < 1e-9 && reference(tick) < 21.0, "{}", reference(tick));
    assert!((reference(tick + 200) - 30.0).abs() < 1e-9, "{}", reference(tick + 200));
    let force = teams[teams.len() - 1].generalized_force[1][0];
    assert!((force - 30.0).abs() < 0.5, "{force}");
    let hands: Vec<_> = log
        .payloads::<TeamCommand>()
        .into_iter()
        .step_by(4)
        .map(|command| command.hand_pose_ref[0])
        .collect();
    let step = |tick: usize| {
        (0..3).map(|axis| (hands[tick][axis] - hands[tick - 1][axis]).abs()).fold(0.0, f64::max)
    };
    assert!((tick - 5..tick + 200).all(|tick| step(tick) < 1e-4));
    let swaps = results.summary()["swaps"].as_array().map(Vec::len);
    assert_eq!(swaps, Some(2));
    replays(&results.log());
}
