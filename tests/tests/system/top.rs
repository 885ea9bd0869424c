//! `mikoshi top` in a terminal, and without one.

use mikoshi_ipc_types::ServiceId;
use mikoshi_tests::programs::mikoshi;
use mikoshi_tests::run::{Results, Running, say_mikoshi};
use mikoshi_tests::scenarios::{ENDLESS, of_project};
use mikoshi_tests::screen::Screen;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

const ALL: [&str; 7] = ["supervisor", "bridge", "coordinator", "servo A", "servo B", "q quits", "internal"];

fn start(results: &Results, arguments: &[&str]) -> Running {
    Running::start(&of_project("hold"), &[&["--set", "team=two"], arguments].concat(), results)
}

fn top(running: &Running, columns: u16, lines: u16) -> Screen {
    let mut command = mikoshi();
    command.args(["top", "--run"]).arg(running.directory().file_name().expect("a name"));
    Screen::start(&command, columns, lines)
}

fn end(running: Running) {
    running.signal(Signal::TERM);
    running.wait();
}

/// The number behind a word on the screen.
fn number_after(text: &str, word: &str) -> u64 {
    let (_, rest) = text.split_once(word).unwrap_or_else(|| panic!("no {word:?} in\n{text}"));
    rest.split_whitespace().next().and_then(|number| number.parse().ok()).expect("a number")
}

#[test]
fn top_shows_a_run_as_it_goes_on_at_any_size_and_leaves_the_terminal_as_it_was() {
    let results = Results::new();
    let running = start(&results, &ENDLESS);
    let mut screen = top(&running, 80, 24);
    let first = screen.wait_for(&[&ALL[..], &["coord", "sense", "act", "step", "hold 0 ("]].concat());
    // Every process of a service has its id, and time goes on.
    for (_, pid) in running.services() {
        assert!(first.contains(&pid.to_string()), "no {pid} in\n{first}");
    }
    let then = number_after(&first, "tick ");
    screen.wait_until("a later tick", |text| {
        text.contains("tick ") && number_after(text, "  tick ") > then + 100
    });
    screen.resize(120, 40);
    screen.wait_until("the last line at another place", |text| {
        text.lines().nth(39).is_some_and(|line| line.contains("q quits"))
    });
    screen.resize(60, 8);
    screen.wait_until("the last line at another place", |text| {
        text.lines().nth(7).is_some_and(|line| line.contains("scroll"))
    });
    assert!(!screen.text().contains("servo B"));
    screen.press("\x1b[F");
    screen.wait_for(&["robot  mode"]);
    screen.press("q");
    let left = screen.wait();
    assert!(left.status == 0 && left.is_restored, "{left:#?}");
    end(running);
}

#[test]
fn top_tells_of_stops_and_of_processes_that_were_replaced() {
    let results = Results::new();
    let running = start(&results, &ENDLESS);
    let mut screen = top(&running, 100, 30);
    screen.wait_for(&ALL);
    running.signal_service(ServiceId::Servo(1), Signal::KILL);
    screen.wait_for(&["another process is servo of robot B"]);
    running.say(&["stop"]);
    screen.wait_for(&["safe stop: operator-stop"]);
    end(running);
    let left = screen.wait();
    assert!(left.status == 0 && left.is_restored, "{left:#?}");
}

#[test]
fn top_ends_with_its_run_and_says_so() {
    let results = Results::new();
    let running = start(&results, &["--set", "duration_s=40"]);
    let mut screen = top(&running, 80, 24);
    screen.wait_for(&ALL);
    let left = screen.wait();
    assert!(left.status == 0 && left.is_restored, "{left:#?}");
    assert!(left.text.contains("the run has ended"), "{left:#?}");
    running.wait();
}

#[test]
fn a_signal_ends_top_and_gives_the_terminal_back() {
    let results = Results::new();
    let running = start(&results, &ENDLESS);
    let mut screen = top(&running, 80, 24);
    screen.wait_for(&ALL);
    let pid = Pid::from_raw(screen.pid() as i32).expect("a pid");
    kill_process(pid, Signal::TERM).expect("it is ours");
    let left = screen.wait();
    assert!(left.status == 143 && left.is_restored, "{left:#?}");
    end(running);
}

#[test]
fn one_table_needs_no_terminal_and_has_no_escape_codes_and_json_has_all_of_it() {
    let results = Results::new();
    let running = start(&results, &ENDLESS);
    let said = running.say(&["top"]);
    said.expect_error(2, &["needs a terminal", "--once"]);
    let said = running.say(&["top", "--once"]);
    assert_eq!(said.status, Some(0), "{said:#?}");
    assert!(ALL.iter().all(|text| *text == "q quits" || said.out.contains(text)), "{said:#?}");
    assert!(!said.out.contains('\x1b'));
    let said = running.say(&["top", "--once", "--json"]);
    let told: Value = serde_json::from_str(&said.out).expect("it is JSON");
    let processes = told["processes"].as_array().expect("a list");
    for (service, phases) in
        [("bridge", vec!["step"]), ("coordinator", vec!["coordinate"]), ("servo", vec!["sense", "act"])]
    {
        let process = processes.iter().find(|process| process["service"] == service).expect("it is there");
        let named: Vec<_> =
            process["phases"].as_array().expect("a list").iter().map(|phase| &phase["phase"]).collect();
        assert_eq!(named, phases, "{process:#}");
        for key in ["pid", "epoch", "tick", "rate_hz", "cpu_share"] {
            assert!(process[key].as_f64().is_some_and(|value| value >= 0.0), "{key}: {process:#}");
        }
        assert!(process["phases"][0]["work_p99_s"].as_f64() >= process["phases"][0]["work_p50_s"].as_f64());
    }
    assert_eq!(told["robots"].as_array().map(Vec::len), Some(2));
    assert!(told["robots"][0]["zmp_margin_m"].as_f64().is_some_and(|margin_m| margin_m > 0.0), "{told:#}");
    assert!(told["team"]["internal_force_max_row"].is_string(), "{told:#}");
    assert!(told["tick"].as_u64() > Some(0) && told["rate_hz"].as_f64() > Some(0.0), "{told:#}");
    end(running);
    say_mikoshi(["top", "--once", "--run", "0-0"]).expect_error(2, &["runs"]);
}
