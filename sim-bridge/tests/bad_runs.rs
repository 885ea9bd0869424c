//! Runs that no world can be built from, and what is said about them.

mod common;

use common::standing_team;
use mikoshi_config::RunSpec;
use mikoshi_physics::{BuildWorldError, Physics as _};
use mikoshi_sim_bridge::World;

fn run() -> RunSpec {
    standing_team("hold", &[("team", "two")])
}

fn refusal(run: &RunSpec) -> BuildWorldError {
    match World::new(run) {
        Ok(_) => panic!("a world was built"),
        Err(error) => error,
    }
}

fn assert_says(run: &RunSpec, parts: &[&str]) {
    let text = refusal(run).to_string();
    assert!(parts.iter().all(|part| text.contains(part)), "{text:?} lacks one of {parts:?}");
}

#[test]
fn a_broken_description_is_refused_with_the_robots_name() {
    let mut run = run();
    run.robots[1].urdf.truncate(100);
    let name = run.robots[1].member.name.clone();
    assert_says(&run, &[&format!("'{name}'"), "URDF"]);
}

#[test]
fn names_that_the_description_lacks_are_refused() {
    let mut bad = run();
    bad.robots[0].config.imu_link = "gyroscope".to_owned();
    assert_says(&bad, &["'A'", "gyroscope"]);
    let mut bad = run();
    bad.robots[0].config.hands[1].sensor_link = "l_wrist".to_owned();
    assert_says(&bad, &["l_wrist"]);
    let mut bad = run();
    bad.robots[0].config.drives.retain(|drive| !drive.joints.starts_with("HEAD"));
    assert_says(&bad, &["drives", "HEAD_JOINT0"]);
}

#[test]
fn counts_that_do_not_match_are_refused() {
    let mut bad = run();
    bad.robots[0].initial_posture_rad.pop();
    assert_says(&bad, &["27", "28"]);
    let mut bad = run();
    bad.robots[0].hand_in_object.pop();
    assert_says(&bad, &["1 hand poses", "2"]);
    let mut bad = run();
    bad.robots[0].grasping_hands[1] = 7;
    assert_says(&bad, &["hands: found 2 hands, expected a hand 7"]);
    let mut bad = run();
    bad.robots[0].initial_base_pose[3] = f64::NAN;
    assert_says(&bad, &["not a pose"]);
}

#[test]
fn a_sensor_that_carries_another_is_refused() {
    let mut bad = run();
    bad.robots[0].config.feet[1].sensor_link = bad.robots[0].config.feet[0].sensor_link.clone();
    assert_says(&bad, &["r_ankle_sensor", "carries"]);
}

#[test]
fn a_physics_step_that_does_not_divide_the_period_is_refused() {
    let mut bad = run();
    bad.scenario.physics.step_s = 0.003;
    assert_says(&bad, &["0.003", "divide", "0.005"]);
}

#[test]
fn dampers_that_would_diverge_are_refused() {
    let mut bad = standing_team("hold_spring", &[("team", "two")]);
    bad.scenario.object.mass_kg = 0.01;
    assert_says(&bad, &["[grasp]", "damping"]);
}
