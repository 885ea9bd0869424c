//! A robot by itself: what fits is told with its reach, and what does not with the line of its key.

use mikoshi_config::load_robot;
use mikoshi_resolution::check_robot;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

fn robots() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/robots")
}

/// A copy of the project's robot, with `new` in the place of `old`.
fn spoilt(old: &str, new: &str) -> (TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let text = fs::read_to_string(robots().join("hrp2.toml")).expect("it is there");
    assert!(text.contains(old), "no {old:?}");
    fs::write(folder.path().join("hrp2.toml"), text.replacen(old, new, 1)).expect("there is room");
    fs::copy(robots().join("hrp2.urdf"), folder.path().join("hrp2.urdf")).expect("there is room");
    let loaded = load_robot(folder.path(), "hrp2");
    let error = loaded.and_then(|loaded| check_robot(&loaded).map(|_| ())).expect_err("it does not fit");
    (folder, error.to_string())
}

#[test]
fn a_robot_that_fits_is_told_with_its_posture_and_reach() {
    let loaded = load_robot(&robots(), "hrp2").expect("it is one of the project's");
    let checked = check_robot(&loaded).expect("it carries");
    assert_eq!(checked.posture_rad.len(), 28);
    for (joint, angle) in checked.robot.model.joints().iter().zip(&checked.posture_rad) {
        assert!((joint.lower..=joint.upper).contains(angle), "{}: {angle}", joint.name);
    }
    // Arms are .6 m long, and bent; to both sides the robot is the same.
    let [ahead, aside, up] = checked.reach_m;
    for reach in [ahead, aside, up].as_flattened() {
        assert!((0.05..0.5).contains(reach), "{:?}", checked.reach_m);
    }
    assert!((aside[0] - aside[1]).abs() < 0.01, "{aside:?}");
}

#[test]
fn what_does_not_fit_is_named_with_its_line() {
    for (old, new, texts) in [
        ("waist_link = \"BODY\"", "waist_link = \"BDY\"", &["hrp2.toml:4: waist_link: found \"BDY\""][..]),
        (
            "joints = \"HEAD_JOINT*\"",
            "joints = \"NECK*\"",
            &["drives: found none for HEAD_JOINT0, HEAD_JOINT1"],
        ),
        (
            "sensor_link = \"r_wrist_sensor\"",
            "sensor_link = \"l_wrist_sensor\"",
            &["hands.0.sensor_link: found \"l_wrist_sensor\"", "carries \"r_palm\""],
        ),
        (
            "carry_position_m = [0.35",
            "carry_position_m = [1.35",
            &["hands.0.carry_position_m: out of reach", "mm"],
        ),
        (
            "com_height_m = 0.79",
            "com_height_m = 1.79",
            &["com_height_m: the stance is out of reach", "above the right sole"],
        ),
        (
            "urdf = \"hrp2.urdf\"",
            "urdf = \"${NOWHERE_TO_BE_FOUND}/hrp2.urdf\"",
            &["environment variable NOWHERE_TO_BE_FOUND"],
        ),
    ] {
        let (_folder, error) = spoilt(old, new);
        for text in texts {
            assert!(error.contains(text), "no {text:?} in {error}");
        }
    }
}
