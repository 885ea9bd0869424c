//! Many runs of one scenario: interrupted, taken up again, judged.

use mikoshi_tests::programs::mikoshi;
use mikoshi_tests::run::{Results, Said, say};
use mikoshi_tests::scenarios::Copy;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::yield_now;

/// Three runs that are short, and that nothing judges but how strained they are at the start: never more
/// than a hundred newton.
const SHORT: &str = r#"name = "short"
description = "Three short runs of hold"
scenario = "hold"
runs = 3
first_seed = 4
succeed_min = 0
[set]
duration_s = 0.5
hybrid.start_s = 0.2
thresholds = ""
[[ranges]]
key = "object.mass_kg"
min = 1
max = 6
[[ranges]]
key = "thresholds.internal_start_min_n"
min = 0
max = 200
"#;

/// The project's configuration with this sweep.
fn with_sweep(text: &str) -> (Copy, PathBuf) {
    let copy = Copy::new();
    let path = copy.path("sweeps/short.toml");
    fs::write(&path, text).expect("it can be written");
    (copy, path)
}

fn sweep_command(sweep: &Path, out: &Path, arguments: &[&str]) -> Command {
    let mut command = mikoshi();
    command.arg("sweep").arg(sweep).arg("--out").arg(out).args(arguments);
    command
}

fn sweep(sweep: &Path, out: &Path, arguments: &[&str]) -> Said {
    say(&mut sweep_command(sweep, out, arguments))
}

fn json(path: impl AsRef<Path>) -> Value {
    serde_json::from_slice(&fs::read(path).expect("it was written")).expect("it is JSON")
}

/// Whether any process has this path on its command line.
fn is_anybody_at(path: &Path) -> bool {
    let path = path.to_str().expect("it is text");
    let processes = fs::read_dir("/proc").expect("it is there").flatten();
    let mut lines = processes.filter_map(|process| fs::read(process.path().join("cmdline")).ok());
    lines.any(|line| String::from_utf8_lossy(&line).contains(path))
}

#[test]
fn an_interrupted_sweep_leaves_nobody_behind_and_goes_on_where_it_ended() {
    // Long enough that a run is still on its way when the signal comes.
    let (_copy, path) = with_sweep(&SHORT.replace("duration_s = 0.5", "duration_s = 2.0"));
    let (whole, interrupted) = (Results::new(), Results::new());
    let said = sweep(&path, whole.path(), &[]);
    assert_eq!(said.status, Some(0), "{said:#?}");
    for name in ["sweep.svg", "sweep.png", "runs/002/summary.json", "runs/002/scenario.toml"] {
        assert!(whole.path().join(name).exists(), "no {name}");
    }
    assert!(!whole.path().join("runs/002/run.mcap").exists(), "frames are kept where somebody asks for them");
    assert!(!whole.path().join("runs/002.log").exists(), "the run had nothing to say");

    let mut child = sweep_command(&path, interrupted.path(), &["--jobs", "1"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it can be started");
    let second = interrupted.path().join("runs/001");
    while !second.join("run.mcap").exists() {
        assert!(child.try_wait().expect("it was started").is_none(), "it ended too soon");
        yield_now();
    }
    let pid = Pid::from_raw(child.id().try_into().expect("a pid")).expect("a pid is not zero");
    kill_process(pid, Signal::INT).expect("it runs");
    let said = Said::from(child.wait_with_output().expect("it was started"));
    said.expect_error(130, &["stopped after 1 of 3 runs"]);
    assert!(!is_anybody_at(interrupted.path()));
    assert!(!second.exists(), "half a run is none");
    assert!(!interrupted.path().join("sweep.json").exists());

    let first = interrupted.path().join("runs/000/summary.json");
    let written = |path: &Path| fs::metadata(path).and_then(|file| file.modified()).expect("it was written");
    let before = written(&first);
    let said = sweep(&path, interrupted.path(), &[]);
    assert_eq!(said.status, Some(0), "{said:#?}");
    assert_eq!(written(&first), before, "it is not done again");
    let results = [&interrupted, &whole].map(|results| json(results.path().join("sweep.json")));
    assert_eq!(results[0], results[1]);
}

#[test]
fn a_run_that_was_done_with_other_parameters_is_done_again() {
    let (copy, path) = with_sweep(SHORT);
    let results = Results::new();
    let mass = || {
        let said = sweep(&path, results.path(), &["--runs", "1", "--json"]);
        let result: Value = serde_json::from_str(&said.out).expect("it is JSON");
        let saved = fs::read_to_string(results.path().join("runs/000/scenario.toml")).expect("it was run");
        let mass = result["runs"][0]["parameters"]["object.mass_kg"].as_f64().expect("it was drawn");
        assert!(saved.contains(&format!("mass_kg = {mass}")), "{mass} in {saved}");
        mass
    };
    let before = mass();
    copy.replace("sweeps/short.toml", "max = 6", "max = 7");
    assert!(mass() > before);
}

#[test]
fn a_run_that_fails_is_a_row_and_no_error() {
    let (copy, path) = with_sweep(SHORT);
    copy.replace("sweeps/short.toml", "succeed_min = 0", "succeed_min = 3");
    copy.replace("sweeps/short.toml", "min = 0\nmax = 200", "min = 200\nmax = 200");
    let results = Results::new();
    let said = sweep(&path, results.path(), &[]);
    assert_eq!((said.status, said.error.as_str()), (Some(1), ""), "{said:#?}");
    for text in [
        "run 2, seed 6",
        "internal forces start at no more than",
        "internal_start_min_n 200",
        "NOT passed: 0 of 3 runs of hold succeeded, expected at least 3",
    ] {
        assert!(said.out.contains(text), "no {text:?} in {}", said.out);
    }
    let result = json(results.path().join("sweep.json"));
    assert_eq!((&result["passed"], &result["succeeded"]), (&false.into(), &0.into()));
    let runs = result["runs"].as_array().expect("a list");
    let seeds: Vec<_> = runs.iter().map(|run| run["seed"].as_u64()).collect();
    assert_eq!(seeds, [Some(4), Some(5), Some(6)]);
    for run in runs {
        assert_eq!(run["passed"], false);
        assert_eq!(run["failures"].as_array().map(Vec::len), Some(1), "{run:#}");
        assert!(run["figures"]["zmp_margin_min_m"].as_f64().is_some_and(|margin| margin > 0.0));
    }
}

#[test]
fn a_bad_sweep_is_refused_with_its_line_before_anything_runs() {
    let (_copy, path) = with_sweep(&SHORT.replace("object.mass_kg", "object.mas_kg"));
    let results = Results::new();
    let out = results.path().join("out");
    sweep(&path, &out, &[]).expect_error(2, &["short.toml:12: object.mas_kg: unknown key", "mass_kg"]);
    sweep(&path, &out, &["--runs", "0"]).expect_error(2, &["--runs"]);
    assert!(!out.exists());
}

/// Two sweeps of which one fails: they are judged together, and each has its own results, too.
#[test]
fn a_survey_judges_all_runs_of_its_sweeps_together() {
    let (copy, path) = with_sweep(
        "name = \"both\"\ndescription = \"Two\"\nsweeps = [\"light\", \"strict\"]\nsucceed_min = 3\n",
    );
    fs::create_dir(copy.path("sweeps/short")).expect("a folder");
    // Nothing judges its runs.
    let unjudged = SHORT.rsplit_once("[[ranges]]").expect("two ranges").0;
    let light = unjudged.replace("\"short\"", "\"light\"");
    let strict =
        SHORT.replace("\"short\"", "\"strict\"").replace("min = 0\nmax = 200", "min = 200\nmax = 200");
    fs::write(copy.path("sweeps/short/light.toml"), light).expect("it can be written");
    fs::write(copy.path("sweeps/short/strict.toml"), strict).expect("it can be written");
    let results = Results::new();
    let said = sweep(&path, results.path(), &["--runs", "4"]);
    assert_eq!((said.status, said.error.as_str()), (Some(0), ""), "{said:#?}");
    for text in [
        " light    hold       2 of 2",
        " strict   hold       0 of 2",
        "Runs of strict that failed",
        "passed: 2 of 4 runs of 2 sweeps succeeded, expected at least 2",
    ] {
        assert!(said.out.contains(text), "no {text:?} in {}", said.out);
    }
    for name in ["survey.svg", "survey.png", "index.html", "light/sweep.json", "strict/runs/001/summary.json"]
    {
        assert!(results.path().join(name).exists(), "no {name}");
    }
    let said = sweep(&path, results.path(), &["--json"]);
    assert_eq!(said.status, Some(0), "the first runs are not done again: {said:#?}");
    let result: Value = serde_json::from_str(&said.out).expect("it is JSON");
    assert_eq!((&result["runs"], &result["succeeded"]), (&6.into(), &3.into()));
    assert_eq!(result, json(results.path().join("survey.json")));
    assert_eq!(result["sweeps"][1], json(results.path().join("strict/sweep.json")));
}

/// Only the bridge can tell that the springs of these runs would explode.
#[test]
fn a_run_that_can_not_be_carried_out_ends_the_sweep_and_is_named() {
    let (copy, path) = with_sweep(SHORT);
    copy.replace("sweeps/short.toml", "\"hold\"", "\"hold_spring\"");
    copy.replace("sweeps/short.toml", "object.mass_kg", "grasp.damping_ns_m");
    copy.replace("sweeps/short.toml", "min = 1\nmax = 6", "min = 5000\nmax = 6000");
    let results = Results::new();
    let out = results.path().join("out");
    sweep(&path, &out, &["--jobs", "1"]).expect_error(2, &["run 0 (seed 4): ", "damping"]);
    assert!(!out.join("runs/000").exists() && !out.join("runs/000.log").exists());
}
