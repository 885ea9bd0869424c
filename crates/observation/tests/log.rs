//! `run.mcap`: what was written is read, to the last bit, and what was not is refused.

use mcap::records::MessageHeader;
use mcap::{Attachment, WriteOptions};
use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_ipc_types::{Frame, Payload, Scalar, Sensors};
use mikoshi_observation::{LogHash, LogReader, LogWriter, Observation, ReadLogError};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

fn run() -> &'static RunSpec {
    static RUN: OnceLock<RunSpec> = OnceLock::new();
    RUN.get_or_init(|| {
        let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
        let two = [("team".to_owned(), "two".to_owned())];
        let loaded = load_scenario(&scenario, &two, None).expect("it is one of the project's");
        mikoshi_resolution::resolve(&loaded).expect("it is in reach")
    })
}

/// All bits of all payloads at random: the log does not care what is in them.
fn random_ticks(count: u64) -> Vec<Observation> {
    fn fill<P: Payload>(frames: &mut [Frame<P>], tick: u64, random: &mut Pcg64Mcg) {
        for frame in frames {
            frame.envelope.tick = tick;
            random.fill_bytes(bytemuck::bytes_of_mut(&mut frame.payload));
        }
    }
    let mut random = Pcg64Mcg::seed_from_u64(7);
    let tick = |tick| {
        let mut observation = Observation::for_team(run().robots.len());
        fill(&mut observation.sensors, tick, &mut random);
        fill(core::slice::from_mut(&mut observation.object_truth), tick, &mut random);
        fill(&mut observation.robot_truth, tick, &mut random);
        fill(&mut observation.robot_state, tick, &mut random);
        fill(&mut observation.team_command, tick, &mut random);
        fill(core::slice::from_mut(&mut observation.team_state), tick, &mut random);
        fill(&mut observation.joint_command, tick, &mut random);
        observation
    };
    (0..count).map(tick).collect()
}

fn hash_of<'a>(ticks: impl IntoIterator<Item = &'a Observation>) -> String {
    let mut hash = LogHash::default();
    ticks.into_iter().for_each(|tick| hash.observe(tick));
    hash.to_hex()
}

/// A folder with a log of these ticks.
fn written(ticks: &[Observation]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let mut log = LogWriter::create(&path, run()).expect("a new file");
    for tick in ticks {
        log.write(tick).expect("there is room");
    }
    log.finish().expect("there is room");
    (folder, path)
}

/// Every tick that can be read.
fn ticks_of(reader: &mut LogReader) -> Vec<Observation> {
    let mut observation = Observation::for_team(reader.run().robots.len());
    let mut ticks = Vec::new();
    while reader.read_tick(&mut observation).expect("the file is ours") {
        ticks.push(observation.clone());
    }
    ticks
}

#[track_caller]
fn message_of(path: &Path) -> String {
    let error = match LogReader::open(path) {
        Err(error) => error,
        Ok(mut reader) => loop {
            match reader.next_payload() {
                Ok(Some(_)) => {}
                Ok(None) => panic!("nothing was refused"),
                Err(error) => break error,
            }
        },
    };
    error.to_string().replace(&path.display().to_string(), "LOG")
}

#[test]
fn every_payload_comes_back_to_the_last_bit() {
    // Enough for several chunks.
    let ticks = random_ticks(60);
    let (_folder, path) = written(&ticks);
    let mut reader = LogReader::open(&path).expect("it was written");
    assert_eq!(reader.run(), run());
    let read = ticks_of(&mut reader);
    assert!(reader.damage().is_none());
    assert_eq!((read.len(), hash_of(&read)), (ticks.len(), hash_of(&ticks)));
    assert_eq!(read.last().map(Observation::tick), Some(59));
}

#[test]
fn payloads_come_with_their_names_and_fields() {
    let ticks = random_ticks(1);
    let (_folder, path) = written(&ticks);
    let mut reader = LogReader::open(&path).expect("it was written");
    let first = reader.next_payload().expect("it is ours").expect("it is there");
    assert_eq!((first.name, first.robot, first.tick), (Sensors::NAME, 0, 0));
    let sensors: Sensors = first.read().expect("these are sensors");
    assert_eq!(bytemuck::bytes_of(&sensors), bytemuck::bytes_of(&ticks[0].sensors[0].payload));
    assert_eq!(first.field_at(512).map(|field| field.name), Some("joint_velocity_rad_s"));
    assert!(first.read::<mikoshi_ipc_types::RobotState>().is_none());
}

#[test]
fn a_cut_log_gives_whole_ticks_up_to_the_cut_and_says_that_there_is_no_more() {
    let ticks = random_ticks(60);
    let (_folder, path) = written(&ticks);
    let whole = fs::read(&path).expect("it was written");
    let mut longest = 0;
    for sixteenth in 0..16 {
        fs::write(&path, &whole[..whole.len() * sixteenth / 16]).expect("there is room");
        let Ok(mut reader) = LogReader::open(&path) else {
            assert_eq!(longest, 0, "what was read of a shorter log is read of a longer one");
            continue;
        };
        let read = ticks_of(&mut reader);
        assert!(reader.damage().is_some());
        assert!(reader.next_payload().expect("the file is ours").is_none());
        assert_eq!(hash_of(&read), hash_of(&ticks[..read.len()]));
        assert!(read.len() >= longest);
        longest = read.len();
    }
    assert!((1..ticks.len()).contains(&longest), "{longest} ticks");
}

#[test]
fn no_cut_and_no_flipped_byte_of_a_log_makes_a_tick_that_was_never_recorded() {
    let ticks = random_ticks(3);
    let (_folder, path) = written(&ticks);
    let whole = fs::read(&path).expect("it was written");
    let mut read = 0;
    for (index, position) in (0..whole.len()).step_by(whole.len() / 200).enumerate() {
        let mut damaged = whole.clone();
        match index % 2 {
            0 => damaged.truncate(position),
            _ => damaged[position] ^= 0x10,
        }
        fs::write(&path, &damaged).expect("there is room");
        let Ok(mut reader) = LogReader::open(&path) else { continue };
        let mut observation = Observation::for_team(run().robots.len());
        while let Ok(true) = reader.read_tick(&mut observation) {
            let original = &ticks[observation.tick() as usize];
            assert_eq!(hash_of([&observation]), hash_of([original]), "position {position}");
            read += 1;
        }
    }
    assert!(read > 0);
}

#[test]
fn what_is_no_log_of_a_run_is_refused_in_words() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    assert!(message_of(&path).starts_with("LOG: No such file"), "{}", message_of(&path));

    fs::write(&path, "").expect("there is room");
    assert!(message_of(&path).contains("cut or damaged before it says which run"), "{}", message_of(&path));

    fs::write(&path, "x,y\n1,2\n3,4\n5,6\n").expect("there is room");
    assert_eq!(message_of(&path), "LOG: not a log of a run: no MCAP file");

    let file = File::create(&path).expect("there is room");
    WriteOptions::new().profile("ros2").create(file).expect("a file").finish().expect("there is room");
    assert_eq!(message_of(&path), "LOG: not a log of a run: an MCAP file of profile \"ros2\"");

    let file = File::create(&path).expect("there is room");
    WriteOptions::new().profile("mikoshi").create(file).expect("a file").finish().expect("there is room");
    assert_eq!(message_of(&path), "LOG: not a log of a run: it lacks run.bin");
}

/// A log of ours in all but one channel, with these messages.
fn foreign_log(topic: &str, schema: &str, messages: &[(u32, usize)]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let file = File::create(&path).expect("a new file");
    let mut writer = WriteOptions::new().profile("mikoshi").create(file).expect("there is room");
    let run = Attachment {
        log_time: 0,
        create_time: 0,
        name: "run.bin".to_owned(),
        media_type: "application/octet-stream".to_owned(),
        data: Cow::Owned(run().encode()),
    };
    writer.attach(&run).expect("there is room");
    let schema = writer.add_schema("sensors", "mikoshi", schema.as_bytes()).expect("there is room");
    let channel = writer.add_channel(schema, topic, "mikoshi", &BTreeMap::new()).expect("there is room");
    for (sequence, bytes) in messages {
        let header = MessageHeader { channel_id: channel, sequence: *sequence, log_time: 0, publish_time: 0 };
        writer.write_to_known_channel(&header, &vec![0; *bytes]).expect("there is room");
    }
    writer.finish().expect("there is room");
    (folder, path)
}

fn schema_of_sensors() -> String {
    let line = |field: &mikoshi_ipc_types::Field| {
        let scalar = match field.scalar {
            Scalar::Float => "f64",
            Scalar::Integer => "u64",
        };
        format!("{} {scalar} {} {}\n", field.name, field.offset_bytes, field.size_bytes)
    };
    Sensors::FIELDS.iter().map(line).collect()
}

#[test]
fn a_payload_of_another_layout_is_refused_and_the_field_named() {
    let schema =
        schema_of_sensors().replace("joint_velocity_rad_s f64 512 512", "joint_velocity_rad_s f64 512 256");
    let (_folder, path) = foreign_log("sensors/A", &schema, &[(0, size_of::<Sensors>())]);
    assert_eq!(
        message_of(&path),
        "LOG: sensors/A: written by another build: found `joint_velocity_rad_s f64 512 256`, expected \
         `joint_velocity_rad_s f64 512 512`"
    );
    let (_folder, path) = foreign_log("sensors/A", "", &[(0, size_of::<Sensors>())]);
    assert!(
        message_of(&path).contains("found nothing, expected `joint_position_rad"),
        "{}",
        message_of(&path)
    );
    let (_folder, path) = foreign_log("telepathy/A", "", &[(0, 8)]);
    assert!(message_of(&path).contains("telepathy/A: written by another build"), "{}", message_of(&path));
    let (_folder, path) = foreign_log("sensors/Z", &schema_of_sensors(), &[(0, 8)]);
    assert!(message_of(&path).contains("the run has no robot \"Z\""), "{}", message_of(&path));
}

#[test]
fn a_payload_of_another_size_and_a_tick_that_lacks_frames_are_refused() {
    let (_folder, path) =
        foreign_log("sensors/A", &schema_of_sensors(), &[(0, size_of::<Sensors>()), (1, 8)]);
    assert!(message_of(&path).contains("sensors: tick 1 has 8 bytes, expected"), "{}", message_of(&path));

    let messages = [(4, size_of::<Sensors>()), (5, size_of::<Sensors>())];
    let (_folder, path) = foreign_log("sensors/A", &schema_of_sensors(), &messages);
    let mut reader = LogReader::open(&path).expect("it is ours");
    let refused = reader.read_tick(&mut Observation::for_team(2));
    assert!(
        matches!(refused, Err(ReadLogError::RejectTick { tick: 4, found: 1, expected: 12, .. })),
        "{refused:?}"
    );
}
