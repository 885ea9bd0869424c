//! `mikoshi report`: figures from what a run has left, and what it says where there is none.

use mikoshi_tests::run::{Results, Said, run, say_mikoshi};
use mikoshi_tests::scenarios::{SHORT, of_project};
use std::ffi::OsStr;
use std::fs;
use std::path::Path;

fn hold_for_a_moment(arguments: &[&str]) -> Results {
    let results = Results::new();
    let said = run(&of_project("hold"), &[&SHORT[..], &["--in-process"], arguments].concat(), &results);
    // Nothing converges in less than a second.
    assert_eq!(said.status, Some(1), "{said:#?}");
    results
}

fn report(arguments: &[&Path]) -> Said {
    say_mikoshi(
        [OsStr::new("report")].into_iter().chain(arguments.iter().map(|argument| argument.as_os_str())),
    )
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn a_report_draws_what_the_summary_says() {
    let results = hold_for_a_moment(&[]);
    let said = report(&[results.path()]);
    let folder = results.path().join("report");
    assert_eq!((said.status, said.error.as_str()), (Some(0), ""), "{said:#?}");
    assert_eq!(said.out, format!("{}\n", folder.join("index.html").display()));

    let (summary, forces) = (results.summary(), read(&folder, "figure-14.svg"));
    for row in summary["internal"].as_array().expect("a list") {
        let figure = |key: &str| row[key].as_f64().expect("a number");
        for text in [
            row["name"].as_str().expect("a name").to_owned(),
            format!("start {:.2}, end {:.2} N", figure("start_n"), figure("end_n")),
            format!("start {:.2}, end {:.2} Nm", figure("start_nm"), figure("end_nm")),
        ] {
            assert!(forces.contains(&text), "no {text:?}");
        }
    }
    let page = read(&folder, "index.html");
    let judged = "<td>ticks with saturated drives of A</td><td>0</td><td>at most 0</td>";
    for text in ["Not passed", "figure-9.png", "Figure 18: no robot takes a step", judged] {
        assert!(page.contains(text), "no {text:?}");
    }
    // A run that replaces this one takes its report away.
    run(&of_project("hold"), &[&SHORT[..], &["--in-process", "--force"]].concat(), &results);
    assert!(results.log().exists() && !folder.exists());
}

#[test]
fn two_runs_are_laid_over_each_other_where_the_user_wants_them() {
    let (four, two) = (hold_for_a_moment(&[]), hold_for_a_moment(&["--set", "team=two"]));
    let out = Results::new();
    let said = report(&[four.path(), two.path(), Path::new("--out"), out.path()]);
    assert_eq!((said.status, said.error.as_str()), (Some(0), ""), "{said:#?}");
    let (page, name) = (read(out.path(), "index.html"), two.path().file_name().expect("it has one"));
    assert!(page.contains(&format!("<h2>{}</h2>", name.to_string_lossy())));
    // The team of two has no robot C.
    assert!(read(out.path(), "figure-14.svg").contains("C.right|C.left"));

    let said = report(&[four.path(), two.path()]);
    let against = format!("report/against-{}/index.html", name.to_string_lossy());
    assert!(said.out.ends_with(&format!("{against}\n")) && four.path().join(against).exists(), "{said:#?}");
}

#[test]
fn a_folder_without_a_readable_run_is_named() {
    let results = Results::new();
    report(&[&results.path().join("nowhere")]).expect_error(2, &["nowhere/summary.json", "No such file"]);
    report(&[results.path()]).expect_error(2, &["summary.json: no results of a run that has ended"]);

    let summary = results.path().join("summary.json");
    fs::write(&summary, "{\"scenario\": 3}").expect("there is room");
    report(&[results.path()]).expect_error(2, &["summary.json: not a summary of this build"]);

    let run = hold_for_a_moment(&[]);
    fs::copy(run.path().join("summary.json"), &summary).expect("there is room");
    report(&[results.path()]).expect_error(2, &["run.mcap: No such file"]);
    fs::write(results.log(), "t, x\n0, 1\n").expect("there is room");
    report(&[results.path()]).expect_error(2, &["run.mcap: not a log of a run"]);

    let other = hold_for_a_moment(&["--seed", "1"]);
    fs::copy(other.log(), results.log()).expect("there is room");
    report(&[results.path()])
        .expect_error(2, &["summary.json is of hold, seed 0, but run.mcap of hold, seed 1"]);
    let file = results.path().join("summary.json");
    report(&[run.path(), Path::new("--out"), &file]).expect_error(2, &["summary.json"]);
}

#[test]
fn a_cut_log_is_drawn_up_to_the_cut() {
    let results = hold_for_a_moment(&[]);
    let log = fs::read(results.log()).expect("the run left a log");
    fs::write(results.log(), &log[..log.len() / 2]).expect("there is room");
    let said = report(&[results.path()]);
    assert_eq!(said.status, Some(0), "{said:#?}");
    assert!(said.error.starts_with("warning: "), "{said:#?}");
    assert!(said.error.contains("run.mcap: cut or damaged"), "{said:#?}");
    let page = read(&results.path().join("report"), "index.html");
    assert!(page.contains("The log is cut or damaged, so the figures end after 0."), "{page:.2000}");
}
