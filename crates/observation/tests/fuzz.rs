//! Whatever stands in files that come from outside, the answer is a run or an error, never a panic. The corpus is the
//! project's own configuration and a log; seeds say how they are spoilt, and `MIKOSHI_FUZZ_RUNS` how often.

use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_observation::{LogReader, LogWriter, Observation, read_revisions};
use mikoshi_resolution::resolve;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use std::fs;
use std::path::{Path, PathBuf};

/// What numbers and words are replaced by.
const WILD: [&str; 12] = [
    "nan",
    "-inf",
    "1e308",
    "-1",
    "0",
    "18446744073709551616",
    "\"\"",
    "[]",
    "{}",
    "true",
    "\u{0}",
    "9e-324",
];

/// How often each kind of file is spoilt.
fn runs() -> u64 {
    let told = std::env::var("MIKOSHI_FUZZ_RUNS").ok();
    told.map_or(150, |told| told.parse().expect("MIKOSHI_FUZZ_RUNS is a number"))
}

fn configuration() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config")
}

/// Spoils bytes in one to three places: a bit flips, a piece goes, comes twice or moves, or a word becomes another.
fn spoil(bytes: &mut Vec<u8>, random: &mut Pcg64) {
    for _ in 0..random.random_range(1..4) {
        let length = bytes.len().max(1);
        let at = random.random_range(0..length).min(bytes.len());
        let end = (at + random.random_range(1..64)).min(bytes.len());
        match random.random_range(0..5) {
            0 if at < bytes.len() => bytes[at] ^= 1 << random.random_range(0..8),
            1 => drop(bytes.drain(at..end)),
            2 => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            3 => bytes.truncate(at),
            _ => {
                let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"._-".contains(byte);
                let start = bytes[..at].iter().rposition(|byte| !is_word(byte)).map_or(0, |index| index + 1);
                let rest = bytes[at..].iter().position(|byte| !is_word(byte)).unwrap_or(bytes.len() - at);
                bytes.splice(start..at + rest, WILD[random.random_range(0..WILD.len())].bytes());
            }
        }
    }
}

/// A scenario that stands in one folder with its team and robot.
fn copy_of_configuration(to: &Path) {
    for part in ["scenarios/transport.toml", "teams/two.toml", "robots/hrp2.toml", "robots/hrp2.urdf"] {
        let target = to.join(part);
        fs::create_dir_all(target.parent().expect("a folder")).expect("a new folder");
        fs::copy(configuration().join(part), target).expect("it can be copied");
    }
}

fn resolved(folder: &Path) -> Result<RunSpec, String> {
    let team = ("team".to_owned(), "two".to_owned());
    let loaded = load_scenario(&folder.join("scenarios/transport.toml"), &[team], None);
    resolve(&loaded.map_err(|error| error.to_string())?).map_err(|error| error.to_string())
}

#[test]
fn whatever_configuration_and_urdf_say_there_is_a_run_or_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    copy_of_configuration(folder.path());
    assert!(resolved(folder.path()).is_ok());
    let mut refused = 0;
    for part in ["scenarios/transport.toml", "teams/two.toml", "robots/hrp2.toml", "robots/hrp2.urdf"] {
        let path = folder.path().join(part);
        let whole = fs::read(&path).expect("it is there");
        for seed in 0..runs() {
            let mut bytes = whole.clone();
            spoil(&mut bytes, &mut Pcg64::seed_from_u64(seed));
            fs::write(&path, &bytes).expect("it can be written");
            match resolved(folder.path()) {
                Err(error) => {
                    assert!(!error.is_empty(), "{part}, seed {seed}");
                    refused += 1;
                }
                // What it accepts it can also write and read.
                Ok(run) => {
                    let read = RunSpec::decode(&run.encode());
                    assert!(read.is_ok_and(|read| read == run), "{part}, seed {seed}");
                }
            }
        }
        fs::write(&path, whole).expect("it can be written");
    }
    assert!(refused > runs(), "{refused}");
}

#[test]
fn whatever_a_log_holds_it_is_read_to_where_it_is_damaged() {
    let folder = tempfile::tempdir().expect("a folder");
    copy_of_configuration(folder.path());
    let run = resolved(folder.path()).expect("a run");
    let path = folder.path().join("run.mcap");
    let mut log = LogWriter::create(&path, &run).expect("a log");
    let mut observation = Observation::for_team(run.robots.len());
    for tick in 0..40 {
        for frame in &mut observation.sensors {
            frame.envelope.tick = tick;
            frame.payload.joint_position_rad[3] = 0.1 * tick as f64;
        }
        observation.object_truth.envelope.tick = tick;
        observation.robot_truth.iter_mut().for_each(|frame| frame.envelope.tick = tick);
        observation.robot_state.iter_mut().for_each(|frame| frame.envelope.tick = tick);
        observation.team_command.iter_mut().for_each(|frame| frame.envelope.tick = tick);
        observation.team_state.envelope.tick = tick;
        observation.joint_command.iter_mut().for_each(|frame| frame.envelope.tick = tick);
        log.write(&observation).expect("it can be written");
    }
    log.write_revision(7, mikoshi_ipc_types::ServiceId::Coordinator, &run).expect("it can be written");
    log.finish().expect("it can be written");
    let whole = fs::read(&path).expect("it is there");
    assert_eq!(ticks_of(&path, LogReader::open), Some(40));
    let mut damaged = 0;
    for seed in 0..runs() {
        let mut bytes = whole.clone();
        spoil(&mut bytes, &mut Pcg64::seed_from_u64(seed));
        fs::write(&path, &bytes).expect("it can be written");
        let read = ticks_of(&path, LogReader::open);
        assert!(read.is_none_or(|ticks| ticks <= 40), "seed {seed}: {read:?}");
        damaged += u64::from(read != Some(40));
        // Also where checksums are not asked, and for what is attached.
        ticks_of(&path, LogReader::open_unchecked);
        drop(read_revisions(&path));
    }
    assert!(damaged > 0);
    for seed in 0..4 * runs() {
        let mut bytes = run.encode();
        spoil(&mut bytes, &mut Pcg64::seed_from_u64(seed));
        assert!(RunSpec::decode(&bytes).is_err() || bytes == run.encode(), "seed {seed}");
    }
}

/// Whole ticks before the end or the first damage; none where the file is refused.
fn ticks_of<E>(path: &Path, open: impl Fn(&Path) -> Result<LogReader, E>) -> Option<u64> {
    let mut log = open(path).ok()?;
    let mut observation = Observation::for_team(log.run().robots.len());
    let mut ticks = 0;
    while log.read_tick(&mut observation).ok()? {
        ticks += 1;
    }
    Some(ticks)
}
