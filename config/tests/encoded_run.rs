//! Encoded runs: what is written is what is read, and hostile bytes give errors.

use mikoshi_config::scenario::{Control, Grasp, InternalForces};
use mikoshi_config::{DecodeRunError, RobotSpec, RunSpec, Scenario, load_scenario, save_scenario};
use proptest::collection::vec;
use proptest::prelude::*;
use std::path::Path;

const HEADER_BYTES: usize = 8 + 4 + 32;

fn run() -> RunSpec {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixture/scenarios/lift.toml");
    let loaded = load_scenario(&path, &[], Some(3)).unwrap_or_else(|error| panic!("{error}"));
    let spec = |member: &mikoshi_config::scenario::Member| {
        let model = &loaded.models[&member.model];
        RobotSpec {
            member: member.clone(),
            config: model.config.clone(),
            urdf: model.urdf.clone(),
            initial_posture_rad: vec![0.5, -0.25],
            initial_base_pose: [0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0],
            grasping_hands: vec![0],
            hand_in_object: vec![[0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]],
        }
    };
    let robots = loaded.scenario.robots.iter().map(spec).collect();
    RunSpec { ticks: loaded.scenario.ticks(), robots, scenario: loaded.scenario, motion: vec![] }
}

/// `content` under a header that vouches for it.
fn signed(content: &[u8]) -> Vec<u8> {
    let mut bytes = run().encode()[..12].to_vec();
    bytes.extend_from_slice(blake3::hash(content).as_bytes());
    bytes.extend_from_slice(content);
    bytes
}

#[test]
fn a_run_survives_encoding() {
    let mut run = run();
    assert_eq!(RunSpec::decode(&run.encode()).unwrap(), run);
    run.scenario.grasp = Grasp::Spring {
        offset_m: 0.04,
        stiffness_n_m: 1000.0,
        damping_ns_m: 10.0,
        stiffness_nm_rad: 300.0,
        damping_nms_rad: 1.0,
    };
    run.scenario.hybrid.internal_forces = InternalForces::Matrix(vec![vec![0.5, -0.5]]);
    run.scenario.hybrid.axes[0].control = Control::Position;
    run.scenario.hybrid.start_s = None;
    assert_eq!(RunSpec::decode(&run.encode()).unwrap(), run);
    let job = "start_s = 1.0\ndraw_back_m = 0.05\nlift_m = 0.03";
    run.scenario.job = Some(toml::from_str(job).unwrap());
    run.scenario.duration_s = 30.0;
    run.ticks = run.scenario.ticks();
    assert_eq!(RunSpec::decode(&run.encode()).unwrap(), run);
}

#[test]
fn a_saved_scenario_is_whole_and_gives_the_same_scenario_and_robots() {
    let (mut run, folder) = (run(), tempfile::tempdir().unwrap());
    run.scenario.hybrid.internal_forces = InternalForces::Matrix(vec![vec![0.5, -0.5]]);
    run.scenario.hybrid.start_s = None;
    run.scenario.placement.fifo_priority = Some(10);
    let path = folder.path().join("run/scenario.toml");
    std::fs::create_dir(path.parent().unwrap()).unwrap();
    save_scenario(&run, &path).unwrap();
    let loaded = load_scenario(&path, &[], None).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(loaded.scenario, Scenario { team: None, ..run.scenario.clone() });
    for robot in &run.robots {
        let model = &loaded.models[&robot.member.model];
        assert_eq!((&model.config, &model.urdf), (&robot.config, &robot.urdf));
    }
    // It can be changed like any other.
    let heavier = [("object.mass_kg".to_owned(), "4.5".to_owned())];
    assert_eq!(load_scenario(&path, &heavier, Some(9)).unwrap().scenario.object.mass_kg, 4.5);

    let nowhere = folder.path().join("nowhere/scenario.toml");
    let error = save_scenario(&run, &nowhere).unwrap_err().to_string();
    assert!(error.contains("nowhere/scenario.toml: cannot be written"), "{error}");
}

#[test]
fn other_files_versions_and_damage_are_told_apart() {
    let good = run().encode();
    let changed = |at: usize| {
        let mut bytes = good.clone();
        bytes[at] ^= 1;
        RunSpec::decode(&bytes)
    };
    assert!(matches!(RunSpec::decode(&[]), Err(DecodeRunError::RejectFile)));
    assert!(matches!(changed(0), Err(DecodeRunError::RejectFile)));
    assert!(matches!(changed(8), Err(DecodeRunError::RejectVersion { .. })));
    assert!(matches!(changed(12), Err(DecodeRunError::RejectChecksum)));
    assert!(matches!(changed(HEADER_BYTES), Err(DecodeRunError::RejectChecksum)));
    assert!(matches!(RunSpec::decode(&good[..good.len() - 1]), Err(DecodeRunError::RejectChecksum)));
    let longer = [&good[HEADER_BYTES..], &[0]].concat();
    assert!(matches!(RunSpec::decode(&signed(&longer)), Err(DecodeRunError::RejectTail(1))));
}

#[test]
fn a_run_that_contradicts_itself_is_refused() {
    let refused = |change: fn(&mut RunSpec), expected: &str| {
        let mut run = run();
        change(&mut run);
        assert_eq!(RunSpec::decode(&run.encode()).unwrap_err().to_string(), expected);
    };
    refused(|run| run.ticks = 7, "run with ticks: they don't agree with the scenario's duration");
    refused(|run| run.robots.swap(0, 1), "run with robots: they are not the scenario's");
    refused(|run| run.robots[0].grasping_hands = vec![5], "run with grasping_hands: not the member's hands");
    refused(
        |run| run.robots[1].hand_in_object.clear(),
        "run with hand_in_object: not one pose for each grasping hand",
    );
    refused(
        |run| run.robots[0].initial_posture_rad = vec![0.0; 65],
        "run with initial_posture_rad: more joints than a frame holds",
    );
    refused(
        |run| run.robots[0].initial_base_pose[2] = f64::NAN,
        "run with robots: a posture or pose that is not finite",
    );
    refused(
        |run| run.scenario.object.mass_kg = f64::INFINITY,
        "run with object.mass_kg: found inf, expected a finite number above 0",
    );
}

#[test]
fn a_length_that_no_run_has_claims_no_memory() {
    // A name of 2^62 bytes, in bincode's variable-length integers: 253, then eight bytes.
    let mut content = vec![253];
    content.extend_from_slice(&(1_u64 << 62).to_le_bytes());
    let error = RunSpec::decode(&signed(&content)).unwrap_err();
    assert!(
        matches!(error, DecodeRunError::DecodeContent(bincode::error::DecodeError::LimitExceeded)),
        "{error}"
    );
}

proptest! {
    #[test]
    fn any_bytes_give_an_error(bytes in vec(any::<u8>(), 0..200)) {
        prop_assert!(RunSpec::decode(&bytes).is_err());
    }

    #[test]
    fn any_vouched_bytes_give_an_error(content in vec(any::<u8>(), 0..200)) {
        prop_assert!(RunSpec::decode(&signed(&content)).is_err());
    }

    /// Damage that the checksum vouches for may still be a run, but then one that passes every check.
    #[test]
    fn vouched_damage_gives_an_error_or_a_run_that_encodes_again(
        damage in vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        length in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let mut content = run().encode().split_off(HEADER_BYTES);
        for (at, value) in damage {
            let at = at.index(content.len());
            content[at] = value;
        }
        if is_cut {
            content.truncate(length.index(content.len()));
        }
        if let Ok(run) = RunSpec::decode(&signed(&content)) {
            prop_assert_eq!(RunSpec::decode(&run.encode()).unwrap(), run);
        }
    }
}
