//! When MuJoCo gives up, the process ends as one that its system has failed, and says why.

mod common;

use common::standing_team;
use mikoshi_physics::Physics as _;
use mikoshi_sim_bridge::World;
use mujoco_rs::wrappers::mj_logging::log_error;
use std::env;
use std::process::Command;

const IS_THE_PROCESS: &str = "MIKOSHI_TEST_SIMULATOR_ERROR";

/// Not a test of its own: what the test below starts.
#[test]
fn a_process_in_which_mujoco_gives_up() {
    if env::var_os(IS_THE_PROCESS).is_some() {
        let _world = World::new(&standing_team("hold", &[("team", "two")])).expect("a world");
        log_error("out of patience");
    }
}

#[test]
fn an_internal_error_of_the_simulator_ends_the_process_with_status_3() {
    let output = Command::new(env::current_exe().expect("a program"))
        .args(["--exact", "a_process_in_which_mujoco_gives_up", "--nocapture"])
        .env(IS_THE_PROCESS, "1")
        .output()
        .expect("it can be started");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("error: MuJoCo: out of patience"), "{said}");
}
