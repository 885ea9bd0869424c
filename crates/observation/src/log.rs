//! `run.mcap`: every frame of a run in a file that the field's tools open.
//!
//! Each topic is a channel `payload/robot`. Messages hold the payload's bytes as they travelled, little
//! endian; the channel's schema lists the fields with type, offset and size, so that a reader needs
//! nothing but the file.

use crate::canonical::{Observation, PayloadRef};
use core::fmt::Write as _;
use mcap::records::MessageHeader;
use mcap::{Attachment, Compression, WriteOptions, Writer};
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{
    Field, JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Scalar, Sensors, TeamCommand,
    TeamState,
};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

const ENCODING: &str = "mikoshi";
const BUFFER_BYTES: usize = 1 << 20;

/// Why a log could not be written.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum WriteLogError {
    #[error("can't create {path}: {source}")]
    Create { path: PathBuf, source: std::io::Error },
    #[error("can't write the log: {0}")]
    Write(#[from] mcap::McapError),
}

/// Writes a run's frames.
pub struct LogWriter {
    writer: Writer<BufWriter<File>>,
    channels: BTreeMap<(&'static str, usize), u16>,
    period_ns: u64,
}

impl LogWriter {
    /// A log at `path`, with the run's description attached.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn create(path: &Path, run: &RunSpec) -> Result<Self, WriteLogError> {
        let file =
            File::create(path).map_err(|source| WriteLogError::Create { path: path.to_owned(), source })?;
        let options = WriteOptions::new().compression(Some(Compression::Lz4)).profile("mikoshi");
        let mut writer = options.create(BufWriter::with_capacity(BUFFER_BYTES, file))?;
        let bytes = run.encode();
        writer.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: "run.bin".to_owned(),
            media_type: "application/octet-stream".to_owned(),
            data: Cow::Borrowed(&bytes),
        })?;
        let period_ns = (run.scenario.control_period_s * 1e9).round() as u64;
        let mut log = Self { writer, channels: BTreeMap::new(), period_ns };
        let names: Vec<&str> = run.robots.iter().map(|robot| robot.member.name.as_str()).collect();
        log.add_channels::<Sensors>(&names)?;
        log.add_channels::<ObjectTruth>(&["team"])?;
        log.add_channels::<RobotTruth>(&names)?;
        log.add_channels::<RobotState>(&names)?;
        log.add_channels::<TeamCommand>(&names)?;
        log.add_channels::<TeamState>(&["team"])?;
        log.add_channels::<JointCommand>(&names)?;
        Ok(log)
    }

    fn add_channels<P: Payload>(&mut self, names: &[&str]) -> Result<(), WriteLogError> {
        let schema = self.writer.add_schema(P::TYPE_NAME, ENCODING, schema_of(P::FIELDS).as_bytes())?;
        for (robot, name) in names.iter().enumerate() {
            let topic = format!("{}/{name}", P::NAME);
            let channel = self.writer.add_channel(schema, &topic, ENCODING, &BTreeMap::new())?;
            self.channels.insert((P::NAME, robot), channel);
        }
        Ok(())
    }

    /// Appends all frames of a tick.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn write(&mut self, observation: &Observation) -> Result<(), WriteLogError> {
        let mut result = Ok(());
        observation.for_each_payload(|payload| {
            if result.is_ok() {
                result = self.write_payload(&payload);
            }
        });
        result
    }

    fn write_payload(&mut self, payload: &PayloadRef<'_>) -> Result<(), WriteLogError> {
        let Some(&channel_id) = self.channels.get(&(payload.name, payload.robot)) else {
            return Ok(());
        };
        let time_ns = payload.tick * self.period_ns;
        let header = MessageHeader {
            channel_id,
            sequence: u32::try_from(payload.tick).unwrap_or(u32::MAX),
            log_time: time_ns,
            publish_time: time_ns,
        };
        Ok(self.writer.write_to_known_channel(&header, payload.bytes)?)
    }

    /// Writes the index and closes the file.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn finish(mut self) -> Result<(), WriteLogError> {
        self.writer.finish()?;
        Ok(())
    }
}

/// One line a field: name, type, offset, size in bytes.
fn schema_of(fields: &[Field]) -> String {
    let mut schema = String::new();
    for field in fields {
        let scalar = match field.scalar {
            Scalar::Float => "f64",
            Scalar::Integer => "u64",
        };
        // Writing to a String can't fail.
        let _ = writeln!(schema, "{} {scalar} {} {}", field.name, field.offset_bytes, field.size_bytes);
    }
    schema
}
