//! What programs read: JSON of every command, each key of it in the book; errors; no colours where nobody looks.

use mikoshi_tests::programs::{mikoshi, workspace};
use mikoshi_tests::run::{Results, Running, Said, run, say, say_mikoshi};
use mikoshi_tests::scenarios::{ENDLESS, SHORT, of_project};
use mikoshi_tests::screen::Screen;
use rustix::process::Signal;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;

const TWO: [&str; 2] = ["--set", "team=two"];
/// Objects whose keys are names of joints, or keys of the scenario.
const MAPS: [&str; 4] = ["torque_peak_nm", "torque_limit_nm", "thresholds", "job"];

/// What a command printed, every key of which the book must have.
#[track_caller]
fn json(said: &Said) -> Value {
    let value = serde_json::from_str(&said.out).unwrap_or_else(|error| panic!("{error}: {said:#?}"));
    let page = fs::read_to_string(workspace().join("docs/json.md")).expect("the book");
    let words: BTreeSet<_> = page.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
    let mut keys = BTreeSet::new();
    gather(&value, &mut keys);
    let unknown: Vec<_> = keys.into_iter().filter(|key| !words.contains(key.as_str())).collect();
    assert!(unknown.is_empty(), "docs/json.md does not have {unknown:?}");
    value
}

fn gather(value: &Value, keys: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                keys.insert(key.clone());
                if !MAPS.contains(&key.as_str()) {
                    gather(value, keys);
                }
            }
        }
        Value::Array(values) => values.iter().for_each(|value| gather(value, keys)),
        _ => {}
    }
}

#[test]
fn whatever_is_told_of_scenarios_robots_and_the_machine_is_json_if_wanted() {
    let scenario = of_project("hold").display().to_string();
    let plan = json(&say_mikoshi(["plan", &scenario, "--json", "--set", "team=two"]));
    assert_eq!(plan["arms"].as_array().map(Vec::len), Some(4), "{plan:#}");
    let robots = workspace().join("config/robots");
    let check =
        |file: &str| json(&say_mikoshi(["check-robot", "--json", &robots.join(file).display().to_string()]));
    let found = check("hrp2.toml");
    assert_eq!((&found["name"], found["joints"].as_array().map(Vec::len)), (&"hrp2".into(), Some(28)));
    assert!(found["carrying"]["reach"][2]["on_m"].as_f64() > Some(0.1), "{found:#}");
    assert!(check("hrp2.urdf")["description"]["ends"].to_string().contains("r_palm"));
    let checks = json(&say_mikoshi(["doctor", "--json"]));
    assert!(checks[0]["verdict"].is_string(), "{checks:#}");
}

#[test]
fn a_run_its_report_and_its_replay_are_json_if_wanted() {
    let results = Results::new();
    let folder = results.path().display().to_string();
    let scenario = of_project("hold").display().to_string();
    let options = ["--in-process", "--json", "--force", "--out", &folder];
    let said = say_mikoshi([&["run", &scenario][..], &options, &TWO, &SHORT].concat());
    let told = json(&said);
    assert_eq!(told, results.summary());
    assert_eq!(said.status, Some(if told["passed"] == true { 0 } else { 1 }), "{said:#?}");
    let page = json(&say_mikoshi(["report", &folder, "--json"]));
    assert!(fs::exists(page["file"].as_str().expect("a path")).expect("a folder"), "{page}");
    let log = results.log().display().to_string();
    let said = say_mikoshi(["replay", &log, "--json"]);
    let same = json(&said);
    assert_eq!((said.status, &same["passed"]), (Some(0), &true.into()), "{same:#}");
    let said = say_mikoshi(["replay", &log, "--json", "--service", "A", "--set", "balance.stabiliser=false"]);
    let other = json(&said);
    assert_eq!((said.status, &other["passed"]), (Some(1), &false.into()), "{other:#}");
    assert!(
        other["services"][0]["first"].as_str().is_some_and(|first| first.contains("recorded")),
        "{other:#}"
    );
}

#[test]
fn what_is_said_to_a_run_and_seen_of_it_is_json_if_wanted() {
    let results = Results::new();
    let running = Running::start(&of_project("hold"), &[&TWO[..], &ENDLESS].concat(), &results);
    let name = running.directory().file_name().expect("a name").to_string_lossy().into_owned();
    let of_run = |command: &[&str]| json(&say_mikoshi([command, &["--run", &name, "--json"]].concat()));
    for command in [&["stop"][..], &["resume"], &["swap", "A"]] {
        assert!(of_run(command)["message"].is_string(), "{command:?}");
    }
    of_run(&["top", "--once"]);
    let runs = json(&say_mikoshi(["status", "--json"]));
    let found = runs.as_array().and_then(|runs| runs.iter().find(|run| run["run"] == name.as_str()));
    assert!(found.is_some(), "{runs:#}");
    running.signal(Signal::TERM);
    running.wait();
}

#[test]
fn a_soak_is_json_if_wanted() {
    let results = Results::new();
    let folder = results.path().display().to_string();
    let scenario = of_project("hold").display().to_string();
    let options = ["--json", "--kills", "2", "--out", &folder];
    let told = json(&say_mikoshi([&["soak", &scenario][..], &options, &TWO, &SHORT].concat()));
    assert_eq!(told["undisturbed_hash"], told["disturbed_hash"], "{told:#}");
}

#[test]
fn an_error_is_one_line_of_json_and_the_exit_status_is_as_ever() {
    let said = say_mikoshi(["plan", "nothing.toml", "--json"]);
    let error: Value = serde_json::from_str(&said.error).expect("it is JSON");
    assert_eq!((said.status, &error["error"]["status"]), (Some(2), &2.into()), "{said:#?}");
    assert!(error["error"]["message"].as_str().is_some_and(|message| message.starts_with("nothing.toml: ")));
    assert_eq!(said.error.lines().count(), 1, "{said:#?}");
    let said = say_mikoshi(["check-robot", "nothing.urdf", "--json"]);
    assert_eq!((said.status, said.out.as_str()), (Some(2), ""), "{said:#?}");
    // A program that is one thread reads the same command line.
    let said = say_mikoshi(["replay", "nothing.mcap", "--json"]);
    assert!(said.status == Some(2) && said.error.starts_with("{\"error\""), "{said:#?}");
}

#[test]
fn nobody_gets_colours_who_is_no_terminal_or_wants_none() {
    let results = Results::new();
    let said = run(&of_project("hold"), &[&TWO[..], &SHORT].concat(), &results);
    assert!(!said.error.contains('\x1b') && !said.out.contains('\x1b'), "{said:#?}");
    for command in [&["--help"][..], &["run", "--help"], &["runn"], &["doctor"], &["status"]] {
        let said = say_mikoshi(command);
        assert!(!said.error.contains('\x1b') && !said.out.contains('\x1b'), "{said:#?}");
    }
    let in_terminal = |no_color: &str| {
        let mut command = mikoshi();
        command.args(["--help"]).env("NO_COLOR", no_color);
        Screen::start(&command, 100, 60).wait().bytes
    };
    let has_codes = |bytes: Vec<u8>| bytes.contains(&0x1b);
    assert!(has_codes(in_terminal("")), "an empty value means nothing");
    assert!(!has_codes(in_terminal("1")));
}

#[test]
fn shells_can_complete_every_command_and_every_command_has_its_manual_page() {
    for (shell, text) in
        [("bash", "complete -F"), ("zsh", "#compdef mikoshi"), ("fish", "complete -c mikoshi")]
    {
        let said = say_mikoshi(["completions", shell]);
        assert_eq!(said.status, Some(0), "{said:#?}");
        for text in [text, "check-robot", "--real-time"] {
            assert!(said.out.contains(text), "no {text:?} for {shell}");
        }
    }
    // Bash itself reads it, and completes.
    let script = "eval \"$($0 completions bash)\"; COMP_WORDS=(mikoshi lat); COMP_CWORD=1; _mikoshi mikoshi lat mikoshi; \
                  echo ${COMPREPLY[@]}";
    let plain = mikoshi();
    let said = say(std::process::Command::new("bash").args(["-c", script]).arg(plain.get_program()));
    assert_eq!(said.out.trim(), "latency", "{said:#?}");
    let folder = Results::new();
    let said = say_mikoshi(["man", &folder.path().join("man1").display().to_string()]);
    assert_eq!(said.status, Some(0), "{said:#?}");
    let page = |name: &str| fs::read_to_string(folder.path().join("man1").join(name)).expect("a manual page");
    assert!(
        page("mikoshi.1").contains("check\\-robot") && page("mikoshi-run.1").contains("\\-\\-real\\-time")
    );
}
