//! A resolved run: everything that its services need, in one file, written once and read by all.

use crate::robot::RobotConfig;
use crate::scenario::{Member, Scenario, Segment};
use crate::validate;
use mikoshi_ipc_types::MAX_JOINTS;
use serde::{Deserialize, Serialize};

/// A scenario after all files are read, all overrides applied and all grasps found reachable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunSpec {
    /// The scenario, seed included.
    pub scenario: Scenario,
    /// The robots, in the order of their indices.
    pub robots: Vec<RobotSpec>,
    /// Number of ticks.
    pub ticks: u64,
    /// The object's reference velocity, drawn segments included.
    pub motion: Vec<Segment>,
}

/// One robot of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotSpec {
    /// Its place in the team.
    pub member: Member,
    /// Its model.
    pub config: RobotConfig,
    /// The text of its URDF.
    pub urdf: String,
    /// Posture at tick 0, in the order of the model's joints.
    pub initial_posture_rad: Vec<f64>,
    /// Root link in the world at tick 0: `[x, y, z, qw, qx, qy, qz]`.
    pub initial_base_pose: [f64; 7],
    /// Indices into `config.hands` of the hands that grasp, in order.
    pub grasping_hands: Vec<usize>,
    /// Grasping hands in the object at tick 0, in the same order.
    pub hand_in_object: Vec<[f64; 7]>,
}

/// Opens every encoded run.
const MAGIC: [u8; 8] = *b"MIKOSHI\0";
/// Counts changes of the schema.
const SCHEMA_VERSION: u32 = 15;
/// Sixteen robots with a megabyte of URDF each fit four times; a decoder claims no more memory.
const MAX_BYTES: usize = 64 << 20;
/// Magic, version, BLAKE3 of what follows.
const HEADER_BYTES: usize = MAGIC.len() + size_of::<u32>() + blake3::OUT_LEN;

/// Bytes that are not a run, or not one of this build.
#[derive(Debug, thiserror::Error)]
pub enum DecodeRunError {
    /// Shorter than a header, longer than any run, or another kind of file.
    #[error("not an encoded run")]
    RejectFile,
    /// Written by another version.
    #[error("run of schema version {found}, expected {SCHEMA_VERSION}: written by another build")]
    RejectVersion {
        /// Its version.
        found: u32,
    },
    /// Damaged, or not yet written to the end.
    #[error("run whose checksum does not match its content")]
    RejectChecksum,
    /// The content is not a run.
    #[error("run that can't be decoded: {0}")]
    DecodeContent(#[from] bincode::error::DecodeError),
    /// Bytes after the content.
    #[error("run with {0} bytes too many")]
    RejectTail(usize),
    /// A run that contradicts itself or its limits.
    #[error("run with {key}: {problem}")]
    CheckKey {
        /// The key's path.
        key: String,
        /// What was found and what was expected.
        problem: String,
    },
}

impl RunSpec {
    /// The run as bytes, for the run's directory.
    ///
    /// # Panics
    /// Never for a run that [`Self::decode`] accepts: these types have no value that bincode lacks.
    pub fn encode(&self) -> Vec<u8> {
        let content = bincode::serde::encode_to_vec(self, bincode::config::standard())
            .expect("runs hold numbers, strings and lists of known length");
        let mut bytes = Vec::with_capacity(HEADER_BYTES + content.len());
        bytes.extend_from_slice(&MAGIC);
        bytes.extend_from_slice(&SCHEMA_VERSION.to_le_bytes());
        bytes.extend_from_slice(blake3::hash(&content).as_bytes());
        bytes.extend_from_slice(&content);
        bytes
    }

    /// The run that [`Self::encode`] wrote. Bytes from anywhere give a run that passed the same checks
    /// as a loaded scenario, or an error; never a panic, nor memory beyond a limit.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeRunError> {
        let (magic, rest) = bytes.split_first_chunk().ok_or(DecodeRunError::RejectFile)?;
        let (version, rest) = rest.split_first_chunk().ok_or(DecodeRunError::RejectFile)?;
        let (checksum, content) = rest.split_first_chunk().ok_or(DecodeRunError::RejectFile)?;
        if *magic != MAGIC || content.len() > MAX_BYTES {
            return Err(DecodeRunError::RejectFile);
        }
        let found = u32::from_le_bytes(*version);
        if found != SCHEMA_VERSION {
            return Err(DecodeRunError::RejectVersion { found });
        }
        if blake3::hash(content) != blake3::Hash::from_bytes(*checksum) {
            return Err(DecodeRunError::RejectChecksum);
        }
        let config = bincode::config::standard().with_limit::<MAX_BYTES>();
        let (run, read): (Self, usize) = bincode::serde::decode_from_slice(content, config)?;
        if read != content.len() {
            return Err(DecodeRunError::RejectTail(content.len() - read));
        }
        run.check()?;
        Ok(run)
    }

    fn check(&self) -> Result<(), DecodeRunError> {
        let configs: Vec<_> = self.robots.iter().map(|robot| &robot.config).collect();
        let mut violations = validate::scenario(&self.scenario, &configs);
        violations.extend(configs.iter().flat_map(|config| validate::robot(config, &config.name)));
        if let Some(violation) = violations.into_iter().next() {
            return Err(DecodeRunError::CheckKey { key: violation.key, problem: violation.problem });
        }
        let require = |holds: bool, key: &str, problem: &str| match holds {
            true => Ok(()),
            false => Err(DecodeRunError::CheckKey { key: key.to_owned(), problem: problem.to_owned() }),
        };
        require(
            self.ticks == self.scenario.ticks(),
            "ticks",
            "they don't agree with the scenario's duration",
        )?;
        let members = self.robots.iter().map(|robot| &robot.member);
        require(members.eq(&self.scenario.robots), "robots", "they are not the scenario's")?;
        let is_finite = |segment: &Segment| {
            let velocities = segment.velocity_m_s.iter().chain(&segment.angular_velocity_rad_s);
            segment.duration_s > 0.0
                && velocities.chain([&segment.duration_s]).all(|number| number.is_finite())
        };
        require(self.motion.iter().all(is_finite), "motion", "a segment that is not finite")?;
        for robot in &self.robots {
            let hands = validate::grasping_hands(&robot.member, &robot.config);
            require(
                hands.as_ref() == Some(&robot.grasping_hands),
                "grasping_hands",
                "not the member's hands",
            )?;
            let poses = robot.hand_in_object.len() == robot.grasping_hands.len();
            require(poses, "hand_in_object", "not one pose for each grasping hand")?;
            let joints = robot.initial_posture_rad.len() <= MAX_JOINTS;
            require(joints, "initial_posture_rad", "more joints than a frame holds")?;
            let numbers = robot.initial_posture_rad.iter().chain(&robot.initial_base_pose);
            let finite =
                numbers.chain(robot.hand_in_object.iter().flatten()).all(|number| number.is_finite());
            require(finite, "robots", "a posture or pose that is not finite")?;
        }
        Ok(())
    }
}
