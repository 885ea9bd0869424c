//! `run.mcap`: every frame of a run in a file that the field's tools open.
//!
//! Each topic is a channel `payload/robot`. Messages hold the payload's bytes as they travelled, little
//! endian; the channel's schema lists the fields with type, offset and size, so that a reader needs
//! nothing but the file. What others make of the frames may lie on channels beside them.

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
const BINARY: &str = "application/octet-stream";
const BUFFER_BYTES: usize = 1 << 20;

/// What a channel beside the frames carries.
#[derive(Clone, Copy, Debug)]
pub struct ChannelSchema<'a> {
    /// The name by which tools know what to do with it.
    pub name: &'a str,
    /// The language of `data`, such as `protobuf`.
    pub encoding: &'a str,
    /// The schema itself.
    pub data: &'a [u8],
    /// What messages are encoded in.
    pub message_encoding: &'a str,
}

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
        let writer = options.create(BufWriter::with_capacity(BUFFER_BYTES, file))?;
        let period_ns = (run.scenario.control_period_s * 1e9).round() as u64;
        let mut log = Self { writer, channels: BTreeMap::new(), period_ns };
        log.attach(RUN_ATTACHMENT, BINARY, &run.encode())?;
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
        let name = format!("{REVISION_PREFIX}{tick}-{service}.bin");
        self.attach_at(self.time_ns(tick), &name, BINARY, &run.encode())
    }

    /// Attaches a file, for those who want to see what the run was made of.
    ///
    /// # Errors
    /// The log can't be written.
    pub fn attach(&mut self, name: &str, media_type: &str, data: &[u8]) -> Result<(), WriteLogError> {
        self.attach_at(0, name, media_type, data)
    }

    fn attach_at(
        &mut self,
        log_time: u64,
        name: &str,
        media_type: &str,
        data: &[u8],
    ) -> Result<(), WriteLogError> {
        self.writer.attach(&Attachment {
            log_time,
            create_time: 0,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: Cow::Borrowed(data),
        })?;
        Ok(())
    }

    /// A channel beside the frames. [`LogReader`](crate::LogReader) passes over it.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn add_channel(&mut self, topic: &str, schema: &ChannelSchema<'_>) -> Result<u16, WriteLogError> {
        let id = self.writer.add_schema(schema.name, schema.encoding, schema.data)?;
        Ok(self.writer.add_channel(id, topic, schema.message_encoding, &BTreeMap::new())?)
    }

    /// Appends a message to a channel beside the frames.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn write_beside(&mut self, channel: u16, tick: u64, bytes: &[u8]) -> Result<(), WriteLogError> {
        self.write_message(channel, tick, bytes)
    }

    /// When a tick begins, by the log.
    pub fn time_ns(&self, tick: u64) -> u64 {
        tick * self.period_ns
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
        self.write_message(channel_id, payload.tick, payload.bytes)
    }

    fn write_message(&mut self, channel_id: u16, tick: u64, bytes: &[u8]) -> Result<(), WriteLogError> {
        let time_ns = self.time_ns(tick);
        let header = MessageHeader {
            channel_id,
            sequence: u32::try_from(tick).unwrap_or(u32::MAX),
            log_time: time_ns,
            publish_time: time_ns,
        };
        Ok(self.writer.write_to_known_channel(&header, bytes)?)
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
