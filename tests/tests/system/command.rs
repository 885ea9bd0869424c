//! What the command says when all is well.

use mikoshi_tests::programs::mikoshi;
use mikoshi_tests::run::{Results, Running, say, say_mikoshi};
use mikoshi_tests::scenarios::{ENDLESS, SHORT, of_project};
use rustix::process::Signal;
use serde_json::Value;
use std::io::Read;
use std::process::Stdio;

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("it is JSON")
}

#[test]
fn help_names_every_command_and_every_exit_status() {
    let said = say_mikoshi(["--help"]);
    assert_eq!(said.status, Some(0));
    for command in ["run", "sweep", "report", "plan", "status", "doctor"] {
        assert!(said.out.contains(command), "{said:#?}");
    }
    let said = say_mikoshi(["run", "--help"]);
    for text in [
        "--in-process",
        "--seed",
        "--set",
        "--out",
        "\n  0  the run",
        "\n  1  it did",
        "\n  2  bad",
        "\n  3  a fault",
    ] {
        assert!(said.out.contains(text), "no {text:?} in {said:#?}");
    }
}

#[test]
fn the_plan_of_four_robots_shows_the_papers_matrices() {
    let scenario = of_project("hold");
    let said = say(mikoshi().arg("plan").arg(&scenario));
    assert_eq!(said.status, Some(0), "{said:#?}");
    for text in ["AB|CD", "A.right|A.left", "1/8", "-1/2", "Loop gain", "coordinator  coordinate"] {
        assert!(said.out.contains(text), "no {text:?} in {}", said.out);
    }

    let plan = json(&say(mikoshi().args(["plan", "--json"]).arg(&scenario)).out);
    assert_eq!(plan["arms"].as_array().map(Vec::len), Some(8));
    assert_eq!(plan["matrices"]["w_inverse"], Value::from(vec![0.125; 8]));
    // Eqs. 43 and 44.
    assert_eq!(plan["matrices"]["c"][0], Value::from(vec![0.5, 0.5, 0.5, 0.5, -0.5, -0.5, -0.5, -0.5]));
    assert_eq!(plan["rows"][0]["control"], Value::from(vec!["position"; 6]));
    assert_eq!(plan["ticks"], 4400);
}

#[test]
fn a_plan_whose_gain_is_too_high_warns() {
    let said = say(mikoshi().arg("plan").arg(of_project("hold")).args(["--set", "hybrid.loop_gain=0.5"]));
    assert_eq!(said.status, Some(0), "{said:#?}");
    assert!(said.error.starts_with("warning: the loop gain"), "{said:#?}");
    assert!(said.error.contains("hybrid.loop_gain"), "{said:#?}");
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let mut plan = mikoshi()
        .arg("plan")
        .arg(of_project("hold"))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it can be started");
    drop(plan.stdout.take());
    let mut error = String::new();
    plan.stderr.take().expect("it is piped").read_to_string(&mut error).expect("it is text");
    assert_eq!((plan.wait().expect("it was started").code(), error.as_str()), (Some(0), ""));
}

#[test]
fn a_run_tells_its_figures_and_leaves_them_as_json() {
    let results = Results::new();
    let mut command = mikoshi();
    command.args(["run", "--force", "--out"]).arg(results.path()).arg(of_project("hold")).args(SHORT);
    let said = say(&mut command);
    // Nothing converges in less than a second.
    assert_eq!(said.status, Some(1), "{said:#?}");
    assert_eq!(said.error, "", "no terminal, no progress bar");
    for text in ["AB|CD", "paper, fig. 14", "slip mm", "× real time", "NOT passed", "log hash"] {
        assert!(said.out.contains(text), "no {text:?} in {}", said.out);
    }
    let summary = results.summary();
    assert_eq!((&summary["scenario"], &summary["ticks"]), (&"hold".into(), &200.into()));
    for key in ["real_time_factor", "wall_time_s", "object", "timing", "faults", "swaps", "fell"] {
        assert!(!summary[key].is_null(), "no {key}");
    }
    assert_eq!(summary["internal"].as_array().map(Vec::len), Some(7));
    assert_eq!(summary["robots"].as_array().map(Vec::len), Some(4));
    assert!(!results.path().join("logs").exists(), "services had nothing to say");
}

#[test]
fn status_lists_the_processes_of_a_run() {
    let results = Results::new();
    let running = Running::start(&of_project("hold"), &ENDLESS, &results);
    let runs = json(&say_mikoshi(["status", "--json"]).out);
    let name = running.directory().file_name().expect("it has a name").to_string_lossy().into_owned();
    let run = runs.as_array().expect("a list").iter().find(|run| run["run"] == *name).expect("it runs");
    assert_eq!((&run["scenario"], &run["alive"]), (&"hold".into(), &true.into()));
    let servos: Vec<_> = run["processes"]
        .as_array()
        .expect("a list")
        .iter()
        .filter(|process| process["service"] == "servo")
        .map(|process| process["robot"].as_str().unwrap_or_default())
        .collect();
    assert_eq!(servos, ["A", "B", "C", "D"]);
    for (service, pid) in running.services() {
        let found = run["processes"].as_array().expect("a list").iter().find(|process| process["pid"] == pid);
        let found = found.unwrap_or_else(|| panic!("no {service} in {run:#}"));
        assert_eq!((&found["epoch"], &found["state"]), (&1.into(), &"running".into()));
    }
    assert!(say_mikoshi(["status"]).out.contains(&format!("run {name}: hold, seed 0")));
    running.signal(Signal::TERM);
    running.wait();
}

#[test]
fn the_doctor_finds_this_machine_fit() {
    let said = say_mikoshi(["doctor", "--json"]);
    assert_eq!(said.status, Some(0), "{said:#?}");
    let checks = json(&said.out);
    let names: Vec<_> = checks.as_array().expect("a list").iter().map(|check| &check["name"]).collect();
    for name in ["shared memory", "programs", "simulator", "left over", "cores"] {
        assert!(names.iter().any(|found| *found == name), "no {name} in {checks:#}");
    }
    assert!(say_mikoshi(["doctor"]).out.contains("MuJoCo 3.17"));
}
