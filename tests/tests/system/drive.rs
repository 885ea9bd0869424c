//! Somebody drives: by a script of the scenario, by one of the command, by keys.

use mikoshi_ipc_types::{ObjectTruth, Payload, ServiceId, TeamState};
use mikoshi_tests::log::Log;
use mikoshi_tests::programs::mikoshi;
use mikoshi_tests::run::{Results, Running, left_behind, run, say_mikoshi};
use mikoshi_tests::scenarios::of_project;
use mikoshi_tests::screen::Screen;
use rustix::process::Signal;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::yield_now;

const PERIOD_S: f64 = 0.005;

fn driven(script: &str, duration_s: &str, arguments: &[&str]) -> Results {
    let results = Results::new();
    let (script, duration) = (format!("operator.script={script}"), format!("duration_s={duration_s}"));
    let set = ["--set", script.as_str(), "--set", duration.as_str()];
    let said = run(&of_project("drive"), &[&set[..], arguments].concat(), &results);
    assert_eq!(said.status, Some(0), "{said:#?} {:#}", results.summary()["failures"]);
    results
}

fn payloads<P: Payload>(log: &Path) -> Vec<P> {
    Log::read(log).payloads()
}

fn speed([vx, vy, vz, ..]: [f64; 6]) -> f64 {
    vx.hypot(vy).hypot(vz)
}

fn distance([x, y, z, ..]: [f64; 7], [u, v, w, ..]: [f64; 7]) -> f64 {
    (x - u).hypot(y - v).hypot(z - w)
}

fn name_of(running: &Running) -> String {
    running.directory().file_name().expect("it has a name").to_string_lossy().into_owned()
}

fn replays(log: &Path) {
    let said = say_mikoshi([Path::new("replay"), log]);
    assert_eq!(said.status, Some(0), "{said:#?}");
    assert!(said.out.contains("coordinator: the same to the last bit"), "{said:#?}");
}

/// Ahead, back without a stop, aside, on the spot, all at once; then nobody speaks any more.
const WALK: &str = r#"[
    {at_s=1.5, says="drive", velocity_m_s=[0.06,0,0]},
    {at_s=7.0, says="drive", velocity_m_s=[-0.06,0,0]},
    {at_s=12.0, says="drive", velocity_m_s=[0,0.06,0.005], squeeze_n=20.0},
    {at_s=17.0, says="drive", angular_velocity_rad_s=[0,0,0.05], squeeze_n=20.0},
    {at_s=23.0, says="drive", velocity_m_s=[0.04,-0.04,-0.01], angular_velocity_rad_s=[0.01,0,-0.05]},
    {at_s=28.0, says="silence"},
]"#;

#[test]
fn teams_of_two_and_four_are_driven_about_and_rest_in_time_when_nobody_speaks_any_more() {
    for team in [&[][..], &["--set", "team=two", "--set", "operator.drive.squeeze.row=A|B"]] {
        let results = driven(WALK, "34", &[&["--in-process"], team].concat());
        let summary = results.summary();
        assert_eq!((&summary["fell"], &summary["faults"]), (&Value::Array(vec![]), &Value::Array(vec![])));
        let teams = payloads::<TeamState>(&results.log());
        let fastest = teams.iter().map(|team| speed(team.object_twist_ref)).fold(0.0, f64::max);
        assert!((0.059..0.0613).contains(&fastest), "{fastest}");
        // Half a second after the last message, which was that of the tick before 28 s.
        let silent = (28.0 / PERIOD_S) as usize - 1;
        assert!(speed(teams[silent].object_twist_ref) > 0.05);
        let timeout = silent + (0.5 / PERIOD_S) as usize;
        for team in &teams[timeout..] {
            assert_eq!(team.object_twist_ref, [0.0; 6]);
        }
        assert_ne!(teams[silent + 20].object_twist_ref, [0.0; 6], "silence is bridged for a while");
        // The object itself follows within a tenth of a second, and sways until feet have finished their step.
        let truth = payloads::<ObjectTruth>(&results.log());
        let place = |tick: usize| truth[tick].pose;
        let last = truth.len() - 1;
        let strays = (timeout + 20..last).map(|tick| distance(place(tick), place(last))).fold(0.0, f64::max);
        assert!(strays < 0.004, "{strays} m");
        assert!(speed(truth[last].twist) < 0.001, "{} m/s", speed(truth[last].twist));
        // Steps shake the force; its mean is what was asked for.
        let squeezed = &teams[(14.5 / PERIOD_S) as usize..(17.0 / PERIOD_S) as usize];
        assert!(squeezed.iter().all(|team| (team.squeeze_n - 20.0).abs() < 1e-9));
        let mean_n =
            squeezed.iter().map(|team| team.generalized_force[1][0]).sum::<f64>() / squeezed.len() as f64;
        assert!((mean_n - 20.0).abs() < 2.0, "{mean_n} N");
    }
}

#[test]
fn processes_killed_while_somebody_drives_leave_the_same_bytes_as_one_thread() {
    let script = r#"[
        {at_s=1.5, says="drive", velocity_m_s=[0.06,0,0]}, {at_s=4.0, says="drive", velocity_m_s=[0,-0.06,0], squeeze_n=10.0},
        {at_s=6.0, says="stop"}, {at_s=6.0, says="silence"}, {at_s=8.5, says="resume"},
    ]"#;
    let thread = driven(
        script,
        "10",
        &["--in-process", "--set", "team=two", "--set", "operator.drive.squeeze.row=A|B"],
    );
    let results = Results::new();
    let script = format!("operator.script={script}");
    let arguments = [
        "--set",
        "team=two",
        "--set",
        "operator.drive.squeeze.row=A|B",
        "--set",
        "duration_s=10",
        "--set",
        &script,
    ];
    let running = Running::start(&of_project("drive"), &arguments, &results);
    let directory = running.directory();
    for (tick, service) in
        [(400, ServiceId::Coordinator), (700, ServiceId::Servo(1)), (1300, ServiceId::Coordinator)]
    {
        running.wait_for_tick(tick);
        running.signal_service(service, Signal::KILL);
    }
    let said = running.wait();
    assert_eq!(said.status, Some(0), "{said:#?}");
    assert_eq!(results.summary()["swaps"].as_array().map(Vec::len), Some(3));
    assert_eq!(results.summary()["log_hash"], thread.summary()["log_hash"]);
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
    replays(&results.log());
}

#[test]
fn an_operator_goes_through_the_whole_job_word_by_word() {
    let results = Results::new();
    let script = r#"operator.script=[
        {at_s=2.0, says="grasp"},
        {at_s=9.5, says="lift"},
        {at_s=15.0, says="drive", velocity_m_s=[0,0.055,0]},
        {at_s=34.0, says="drive"},
        {at_s=36.0, says="lower"},
        {at_s=52.0, says="release"},
    ]"#;
    let arguments = [
        "--in-process",
        "--set",
        "motion=",
        "--set",
        "operator.drive.timeout_s=0.5",
        "--set",
        script,
        "--set",
        "thresholds.object_goal_error_max_m=",
        "--set",
        "thresholds.object_goal_error_max_rad=",
        "--set",
        "thresholds.object_travel_min_rad=",
    ];
    let said = run(&of_project("pick_and_place"), &arguments, &results);
    let summary = results.summary();
    assert_eq!(said.status, Some(0), "{:#}", summary["failures"]);
    let modes: Vec<_> = summary["modes"].as_array().expect("a list").iter().collect();
    let names: Vec<_> = modes.iter().map(|mode| mode["mode"].as_str().expect("a name")).collect();
    assert_eq!(names, ["hold", "approach", "grasp", "lift", "carry", "lower", "release", "hold"]);
    let start_s = |index: usize| modes[index]["start_s"].as_f64().expect("a time");
    assert!((start_s(1) - 2.0).abs() < 0.01 && (start_s(6) - 52.0).abs() < 0.01, "{modes:#?}");
    let teams = payloads::<TeamState>(&results.log());
    let awaited =
        |time_s: f64| mikoshi_ipc_types::operator::name(teams[(time_s / PERIOD_S) as usize].awaited_word);
    assert_eq!([1.0, 8.0, 20.0, 50.0].map(awaited), ["grasp", "lift", "lower", "release"]);
}

/// A driver that is no person, and goes on for ever.
fn drive_by_script(name: &str, folder: &Path) -> Command {
    let script = folder.join("ahead.txt");
    std::fs::write(&script, "0 move 0.06 0 0  0 0 0\n100000 end\n").expect("it can be written");
    let mut command = mikoshi();
    command.args(["drive", "--run", name, "--script"]).arg(script);
    command
}

#[test]
fn an_object_whose_driver_is_killed_rests_in_time_though_the_coordinator_is_killed_too_and_all_of_it_replays()
{
    let results = Results::new();
    let folder = tempfile::tempdir().expect("a folder");
    let running = Running::start(&of_project("drive"), &["--set", "duration_s=24"], &results);
    let mut driver = drive_by_script(&name_of(&running), folder.path())
        .stdout(Stdio::null())
        .spawn()
        .expect("it can be started");
    running.wait_for_tick(1500);
    running.signal_service(ServiceId::Coordinator, Signal::KILL);
    running.wait_for_tick(2500);
    driver.kill().expect("it runs");
    driver.wait().expect("it was started");
    let said = running.wait();
    assert_eq!(said.status, Some(0), "{said:#?}");

    let teams = payloads::<TeamState>(&results.log());
    let heard = |pair: &[TeamState]| pair[1].drive_number != pair[0].drive_number;
    let last = teams.windows(2).rposition(heard).expect("somebody drove") + 1;
    assert!((2000..4000).contains(&last), "{last}");
    let fastest = teams[..last].iter().map(|team| speed(team.object_twist_ref)).fold(0.0, f64::max);
    assert!(fastest > 0.05, "{fastest} m/s");
    for team in &teams[last + (0.5 / PERIOD_S) as usize..] {
        assert_eq!(team.object_twist_ref, [0.0; 6]);
    }
    replays(&results.log());
}

/// What stands in this column of the line that begins with a word.
fn number(text: &str, word: &str, column: usize) -> f64 {
    let line = text.lines().find(|line| line.trim_start().starts_with(word));
    let number = line.and_then(|line| line.split_whitespace().nth(column)?.parse().ok());
    number.unwrap_or(f64::NAN)
}

#[test]
fn somebody_drives_by_keys_alone_and_the_terminal_is_given_back() {
    let results = Results::new();
    let arguments = [
        "--set",
        "duration_s=3600",
        "--set",
        "team=two",
        "--set",
        "operator.drive.squeeze.row=A|B",
        "--no-log",
    ];
    let running = Running::start(&of_project("drive"), &arguments, &results);
    let name = name_of(&running);
    let mut command = mikoshi();
    command.args(["drive", "--run", &name]).env("NO_COLOR", "1");
    let mut screen = Screen::start(&command, 80, 24);
    screen.wait_for(&["drive, seed 0", "carry", "EMERGENCY STOP", "quit (the object rests)"]);
    screen.press("0w");
    screen.wait_until("the object on its way ahead", |text| {
        number(text, "wanted", 1) > 50.0 && number(text, "object", 1) > 40.0
    });
    screen.press("]]");
    screen.wait_for(&["squeeze 10 N of 10"]);
    screen.press(" ");
    screen.wait_until("the object at rest", |text| {
        number(text, "wanted", 1) == 0.0 && number(text, "object", 1) == 0.0
    });

    let folder = tempfile::tempdir().expect("a folder");
    let said = mikoshi_tests::run::say(&mut drive_by_script(&name, folder.path()));
    said.expect_error(2, &["drives already", "--take-over"]);
    say_mikoshi(["drive", "--run", &name]).expect_error(2, &["drives already"]);

    screen.press("we");
    screen.wait_for(&["STOPPED: operator-stop"]);
    screen.wait_until("nothing wanted", |text| number(text, "wanted", 1) == 0.0);
    screen.press("q");
    let left = screen.wait();
    assert!(left.status == 0 && left.is_restored, "{left:#?}");
    assert!(left.text.contains("nobody drives any more"), "{left:#?}");
    assert!(!String::from_utf8_lossy(&left.bytes).contains("\x1b[31m"), "colours");

    let mut screen = Screen::start(&command, 80, 24);
    screen.wait_for(&["STOPPED: operator-stop"]);
    while screen.text().contains("STOPPED") {
        // It is heard only once all stand.
        screen.press("r");
        yield_now();
    }
    let pid = rustix::process::Pid::from_raw(screen.pid() as i32).expect("a pid");
    rustix::process::kill_process(pid, Signal::TERM).expect("it is ours");
    let left = screen.wait();
    assert!(left.status == 143 && left.is_restored, "{left:#?}");
    running.signal(Signal::TERM);
    running.wait();
}

#[test]
fn who_may_not_drive_is_told_why() {
    let results = Results::new();
    let arguments = ["--set", "duration_s=3600", "--set", "team=two", "--no-log"];
    let running = Running::start(&of_project("hold"), &arguments, &results);
    let name = name_of(&running);
    say_mikoshi(["drive", "--run", &name]).expect_error(2, &["nobody may drive hold", "[operator.drive]"]);
    let folder = tempfile::tempdir().expect("a folder");
    let script = folder.path().join("jump.txt");
    std::fs::write(&script, "0 halt\n1 jump\n").expect("it can be written");
    let script = script.to_str().expect("it is text");
    say_mikoshi(["drive", "--run", &name, "--script", script]).expect_error(2, &["line 2", "one of move"]);
    running.signal(Signal::TERM);
    running.wait();
}
