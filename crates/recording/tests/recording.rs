//! Views lie beside the frames, and change nothing about them.

use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_ipc_types::{Frame, Payload};
use mikoshi_observation::{LogHash, LogReader, Observation, ObservedJoint, ObservedRobot, ObservedRun};
use mikoshi_recording::Recording;
use mikoshi_robot::Robot;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

fn run() -> RunSpec {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
    let two = [("team".to_owned(), "two".to_owned())];
    let loaded = load_scenario(&scenario, &two, None).expect("it is one of the project's");
    mikoshi_resolution::resolve(&loaded).expect("it is in reach")
}

fn observed(run: &RunSpec) -> ObservedRun {
    let robots = run.robots.iter().map(|spec| {
        let model = Robot::new(&spec.config, &spec.urdf).expect("it was read before").model;
        let joints = model.joints().iter().map(|joint| ObservedJoint {
            name: joint.name.clone(),
            lower_rad: joint.lower,
            upper_rad: joint.upper,
            torque_limit_nm: joint.effort,
        });
        ObservedRobot {
            name: spec.member.name.clone(),
            mass_kg: model.total_mass_kg(),
            hands: spec.grasping_hands.len(),
            joints: joints.collect(),
        }
    });
    ObservedRun {
        control_period_s: run.scenario.control_period_s,
        ticks: run.ticks,
        is_controlled: true,
        X_WBody_goal: None,
        robots: robots.collect(),
        internal_rows: vec![("A|B".to_owned(), vec![0.5, 0.5, -0.5, -0.5])],
    }
}

/// A tick in which every number of every frame is this one, but for the object's pose, which is one if so wished.
fn tick(tick: u64, number: f64, has_object: bool) -> Observation {
    fn fill<P: Payload>(frames: &mut [Frame<P>], tick: u64, number: f64) {
        for frame in frames {
            frame.envelope.tick = tick;
            let words: &mut [u64] = bytemuck::cast_slice_mut(bytemuck::bytes_of_mut(&mut frame.payload));
            words.fill(number.to_bits());
        }
    }
    let mut observation = Observation::for_team(2);
    fill(&mut observation.sensors, tick, number);
    fill(core::slice::from_mut(&mut observation.object_truth), tick, number);
    fill(&mut observation.robot_truth, tick, number);
    fill(&mut observation.robot_state, tick, number);
    fill(&mut observation.team_command, tick, number);
    fill(core::slice::from_mut(&mut observation.team_state), tick, number);
    fill(&mut observation.joint_command, tick, number);
    if has_object {
        observation.object_truth.payload.pose = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0];
    }
    observation
}

/// The log of these ticks, and how large it is.
fn recorded(ticks: &[Observation], view_hz: f64) -> (TempDir, LogReader, u64) {
    let (folder, run) = (tempfile::tempdir().expect("a folder"), run());
    let path = folder.path().join("run.mcap");
    let mut log = Recording::create(&path, &run, &observed(&run), view_hz).expect("a new file");
    ticks.iter().for_each(|tick| log.write(tick).expect("there is room"));
    log.finish(&folder.path().join("world.xml")).expect("there is room");
    let size = fs::metadata(&path).expect("it was written").len();
    let reader = LogReader::open(&path).expect("it was written");
    (folder, reader, size)
}

fn hash_of_read(reader: &mut LogReader) -> String {
    let (mut observation, mut hash) = (Observation::for_team(2), LogHash::default());
    while reader.read_tick(&mut observation).expect("it is ours") {
        hash.observe(&observation);
    }
    assert!(reader.damage().is_none());
    hash.to_hex()
}

#[test]
fn frames_come_back_to_the_last_bit_whatever_is_beside_them_and_whatever_is_in_them() {
    let numbers = [0.0, 0.5, -1e300, f64::INFINITY, f64::NAN];
    let ticks: Vec<_> = (0..20).map(|k| tick(k, numbers[k as usize % 5], k % 3 > 0)).collect();
    let mut hash = LogHash::default();
    ticks.iter().for_each(|tick| hash.observe(tick));
    let mut sizes = vec![];
    for view_hz in [0.0, 50.0, 1e9] {
        let (_folder, mut reader, size) = recorded(&ticks, view_hz);
        assert_eq!(hash_of_read(&mut reader), hash.to_hex());
        sizes.push(size);
    }
    assert!(sizes.is_sorted_by(|less, more| less + 1000 < *more), "views take room: {sizes:?}");
}

/// How many messages of views there are, by topic.
fn views_of(ticks: &[Observation]) -> BTreeMap<String, usize> {
    let (folder, ..) = recorded(ticks, 50.0);
    let bytes = fs::read(folder.path().join("run.mcap")).expect("it was written");
    let mut counts = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).expect("a log") {
        let channel = message.expect("it is whole").channel;
        if channel.message_encoding == "protobuf" {
            *counts.entry(channel.topic.clone()).or_default() += 1;
        }
    }
    counts
}

#[test]
fn where_nobody_says_where_the_object_is_there_is_nothing_to_see() {
    let ticks = |has_object| (0..40).map(|k| tick(k, 0.0, has_object)).collect::<Vec<_>>();
    assert_eq!(views_of(&ticks(false)), BTreeMap::new());
    let views = views_of(&ticks(true));
    assert_eq!((views.get("/tf"), views.get("/tf_static")), (Some(&10), Some(&1)));
}

#[test]
fn a_recording_that_begins_late_begins_with_what_never_changes() {
    let ticks: Vec<_> = (7..15).map(|k| tick(k, 0.0, true)).collect();
    let views = views_of(&ticks);
    // Ticks 7, 8 and 12.
    assert_eq!(
        (views.get("/tf"), views.get("/tf_static"), views.get("/scene/static")),
        (Some(&3), Some(&1), Some(&1))
    );
}
