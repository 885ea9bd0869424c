//! Every driver delivers every frame of a tick between six processes: whole, once, in order, to whom it is meant for.
//! A comparison of times is worth nothing otherwise.

use std::process::{Command, Output};

const WAITS: [&str; 2] = ["blocking", "yielding"];

fn carriers() -> Vec<&'static str> {
    let mut carriers = vec!["raw", "mikoshi", "mikoshi-unobserved", "iceoryx2", "sockets"];
    if cfg!(feature = "zenoh") {
        carriers.push("zenoh");
    }
    if cfg!(feature = "dds") {
        carriers.push("cyclonedds");
    }
    carriers
}

fn check(carrier: &str, wait: &str, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mikoshi-peers"))
        .args(["check", "--carrier", carrier, "--wait", wait])
        .args(more)
        .output()
        .expect("it can be started")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_bit_that_is_another_and_a_frame_of_the_tick_before_are_noticed() {
    for fault in ["flipped-bit", "stale-frame"] {
        let output = check("raw", "blocking", &["--fault", fault]);
        assert!(!output.status.success(), "{fault}");
        assert!(said(&output).contains("words are not what was sent"), "{fault}: {}", said(&output));
    }
}

#[test]
fn every_carrier_delivers_every_frame_however_its_receivers_wait() {
    for carrier in carriers() {
        for wait in WAITS {
            let output = check(carrier, wait, &[]);
            assert!(output.status.success(), "{carrier}, {wait}: {}", said(&output));
        }
    }
}

#[test]
fn all_are_measured_in_one_run() {
    let carriers = carriers().join(",");
    let json = tempfile::NamedTempFile::new().expect("a file");
    let output = Command::new(env!("CARGO_BIN_EXE_mikoshi-peers"))
        .args(["compare", "--rounds", "1", "--ticks", "20", "--warm-up", "20", "--carriers", &carriers])
        .arg("--json")
        .arg(json.path())
        .output()
        .expect("it can be started");
    assert!(output.status.success(), "{}", said(&output));
    let rows = std::fs::read(json.path()).expect("it was written");
    let rows: serde_json::Value = serde_json::from_slice(&rows).expect("it is JSON");
    let rows = rows.as_array().expect("a row for each");
    assert_eq!(rows.len(), WAITS.len() * carriers.split(',').count());
    assert!(rows.iter().all(|row| row["ticks"] == 20 && row["ratio_to_raw"]["median"].as_f64() > Some(0.0)));
}
