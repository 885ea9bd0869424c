//! `mikoshi render`: a film and a picture of what was recorded, without a display.

use mikoshi_tests::run::{Results, run, say_mikoshi};
use mikoshi_tests::scenarios::{SHORT, of_project};
use std::fs;

#[test]
fn a_log_becomes_a_film_and_a_picture() {
    let results = Results::new();
    run(&of_project("hold"), &[&SHORT[..], &["--in-process", "--set", "team=two"]].concat(), &results);
    let log = results.log().display().to_string();
    let file = |name: &str| results.path().join(name).display().to_string();
    let render = |out: &str, more: &[&str]| {
        let arguments = ["render", &log, "--out", out, "--size", "160x120"];
        say_mikoshi(arguments.iter().chain(more))
    };
    for (name, opening, more) in [
        ("walk.mp4", &b"ftypisom"[..], &["--fps", "10"][..]),
        ("end.png", b"PNG\r\n", &["--camera", "top"]),
        ("frame.png", b"PNG\r\n", &["--camera", "side", "--at", "0.5"]),
    ] {
        let said = render(&file(name), more);
        assert_eq!(said.status, Some(0), "{said:#?}");
        let bytes = fs::read(file(name)).expect("it was written");
        assert!(bytes.windows(opening.len()).take(8).any(|part| part == opening), "{name}");
    }
    render(&file("end.png"), &[]).expect_error(2, &["end.png: exists", "--force"]);
    render(&file("walk.gif"), &[]).expect_error(2, &["walk.gif: expected a name in .mp4 or .png"]);
    render(&file("late.png"), &["--at", "7"]).expect_error(2, &["--at 7: the log ends at 0.995 s"]);
    render(&file("none.mp4"), &["--from", "7"]).expect_error(2, &["there is no moment to draw"]);
    assert!(!results.path().join("none.mp4").exists() && !results.path().join("late.png").exists());
}
