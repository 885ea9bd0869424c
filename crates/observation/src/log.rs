//! `run.mcap`: every frame of a run in a file that the field's tools open.
//!
//! Each topic is a channel `payload/robot`. Messages hold the payload's bytes as they travelled, little
//! endian; the channel's schema lists the fields with type, offset and size, so that a reader needs
//! nothing but the file.

use crate::canonical::{Kind, Observation, PayloadRef};
use core::fmt::Write as _;
use mcap::records::MessageHeader;
use mcap::{Attachment, Compression, WriteOptions, Writer};
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{Field, Scalar, ServiceId};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

pub(crate) const PROFILE: &str = "mikoshi";
pub(crate) const ENCODING: &str = "mikoshi";
/// The attachment that holds the [`RunSpec`].
pub(crate) const RUN_ATTACHMENT: &str = "run.bin";
/// Opens the names of attachments that hold the run as one service has it from a tick on.
pub(crate) const REVISION_PREFIX: &str = "run-from-";
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
        let options = WriteOptions::new().compression(Some(Compression::Lz4)).profile(PROFILE);
        let mut writer = options.create(BufWriter::with_capacity(BUFFER_BYTES, file))?;
        let bytes = run.encode();
        writer.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: RUN_ATTACHMENT.to_owned(),
            media_type: "application/octet-stream".to_owned(),
            data: Cow::Borrowed(&bytes),
        })?;
        let period_ns = (run.scenario.control_period_s * 1e9).round() as u64;
        let mut log = Self { writer, channels: BTreeMap::new(), period_ns };
        let names: Vec<&str> = run.robots.iter().map(|robot| robot.member.name.as_str()).collect();
        for kind in Kind::ALL {
            log.add_channels(kind, if kind.is_per_robot { &names } else { &["team"] })?;
        }
        Ok(log)
    }

    fn add_channels(&mut self, kind: &Kind, names: &[&str]) -> Result<(), WriteLogError> {
        let schema = self.writer.add_schema(kind.type_name, ENCODING, schema_of(kind.fields).as_bytes())?;
        for (robot, name) in names.iter().enumerate() {
            let topic = format!("{}/{name}", kind.name);
            let channel = self.writer.add_channel(schema, &topic, ENCODING, &BTreeMap::new())?;
            self.channels.insert((kind.name, robot), channel);
        }
        Ok(())
    }

    /// Attaches the run as this service has it from this tick on.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn write_revision(
        &mut self,
        tick: u64,
        service: ServiceId,
        run: &RunSpec,
    ) -> Result<(), WriteLogError> {
        let bytes = run.encode();
        self.writer.attach(&Attachment {
            log_time: tick * self.period_ns,
            create_time: 0,
            name: format!("{REVISION_PREFIX}{tick}-{service}.bin"),
            media_type: "application/octet-stream".to_owned(),
            data: Cow::Borrowed(&bytes),
        })?;
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
pub(crate) fn schema_of(fields: &[Field]) -> String {
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
