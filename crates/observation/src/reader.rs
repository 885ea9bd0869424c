//! Reads what [`LogWriter`](crate::LogWriter) wrote: every payload of a run, to the last bit.
//!
//! What is before a cut or damage is read; [`LogReader::damage`] says afterwards why there is no more.

use crate::canonical::{Kind, Observation, PayloadRef};
use crate::log::{ENCODING, PROFILE, REVISION_PREFIX, RUN_ATTACHMENT, schema_of};
use mcap::McapError;
use mcap::records::{Channel, Record};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mikoshi_config::scenario::Clock;
use mikoshi_config::{DecodeRunError, RunSpec};
use mikoshi_ipc_types::ServiceId;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// No record of ours is longer; a damaged length claims no more memory.
const MAX_RECORD_BYTES: usize = 128 << 20;
const READ_BYTES: usize = 1 << 20;

/// Why a log could not be read.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum ReadLogError {
    #[error("{path}: {source}")]
    Io { path: PathBuf, source: io::Error },
    #[error("{path}: not a log of a run: {found}")]
    RejectFile { path: PathBuf, found: String },
    #[error("{path}: cut or damaged before it says which run it is of: {source}")]
    ReadStart { path: PathBuf, source: McapError },
    #[error("{path}: {source}")]
    DecodeRun { path: PathBuf, source: DecodeRunError },
    #[error("{path}: {topic}: written by another build: {problem}")]
    RejectSchema { path: PathBuf, topic: String, problem: String },
    #[error("{path}: {topic}: {problem}")]
    RejectMessage { path: PathBuf, topic: String, problem: String },
    #[error("{path}: tick {tick} has {found} of its {expected} frames")]
    RejectTick { path: PathBuf, tick: u64, found: usize, expected: usize },
}

/// Reads a run's payloads in the order in which they were recorded.
pub struct LogReader {
    path: PathBuf,
    file: File,
    records: LinearReader,
    run: RunSpec,
    schemas: BTreeMap<u16, Vec<u8>>,
    topics: BTreeMap<u16, Topic>,
    /// Where the payload that was handed out last lies.
    payload: Vec<u8>,
    /// What lies there, if it is of a tick whose turn has not come.
    pending: Option<(Topic, u64)>,
    damage: Option<McapError>,
    is_finished: bool,
}

/// A run as one service has it from a tick on: its process was replaced by one with other settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Revision {
    /// The first tick of the new process.
    pub tick: u64,
    /// Which service.
    pub service: ServiceId,
    /// Its run.
    pub run: RunSpec,
}

/// All revisions in a log. They lie behind the frames that they matter for: a log that is cut may lack them.
///
/// # Errors
/// As [`LogReader::open`]; a revision that is none.
pub fn read_revisions(path: &Path) -> Result<Vec<Revision>, ReadLogError> {
    let robots = LogReader::open(path)?.run().robots.len();
    let io_error = |source| ReadLogError::Io { path: path.to_owned(), source };
    let mut file = File::open(path).map_err(io_error)?;
    // Frames stay packed in their chunks.
    let options =
        LinearReaderOptions::default().with_emit_chunks(true).with_record_length_limit(MAX_RECORD_BYTES);
    let mut records = LinearReader::new_with_options(options);
    let mut revisions = Vec::new();
    // Where the file is cut or damaged, there is no more to find.
    while let Some(Ok(event)) = records.next_event() {
        let (opcode, data) = match event {
            LinearReadEvent::Record { opcode, data } => (opcode, data),
            LinearReadEvent::ReadRequest(need) => {
                feed(&mut records, &mut file, need).map_err(io_error)?;
                continue;
            }
        };
        let Ok(Record::Attachment { header, data, .. }) = mcap::parse_record(opcode, data) else { continue };
        let Some(name) = header.name.strip_prefix(REVISION_PREFIX) else { continue };
        let found =
            name.strip_suffix(".bin").and_then(|name| name.split_once('-')).and_then(|(tick, name)| {
                let service = ServiceId::of_team(robots).find(|service| service.to_string() == name)?;
                Some((tick.parse().ok()?, service))
            });
        let reject = || ReadLogError::RejectFile {
            path: path.to_owned(),
            found: format!("a revision of nobody, {:?}", header.name),
        };
        let (tick, service) = found.ok_or_else(reject)?;
        let decode = |source| ReadLogError::DecodeRun { path: path.to_owned(), source };
        revisions.push(Revision { tick, service, run: RunSpec::decode(&data).map_err(decode)? });
    }
    Ok(revisions)
}

/// What a channel carries, and whose it is.
#[derive(Clone, Copy)]
struct Topic {
    kind: &'static Kind,
    robot: usize,
}

impl LogReader {
    /// Opens a log and reads which run it is of.
    ///
    /// # Errors
    /// The file can't be read, is none of ours, or ends before it says of which run it is.
    pub fn open(path: &Path) -> Result<Self, ReadLogError> {
        Self::open_with(path, true)
    }

    /// The same, but what is damaged is read as it is, as far as it can be read at all: for those who have
    /// something to compare it with.
    ///
    /// # Errors
    /// As [`LogReader::open`].
    pub fn open_unchecked(path: &Path) -> Result<Self, ReadLogError> {
        Self::open_with(path, false)
    }

    fn open_with(path: &Path, is_checked: bool) -> Result<Self, ReadLogError> {
        let path = path.to_owned();
        let mut file = File::open(&path).map_err(|source| ReadLogError::Io { path: path.clone(), source })?;
        let options = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(is_checked)
            .with_validate_chunk_crcs(is_checked)
            .with_validate_data_section_crc(is_checked)
            .with_record_length_limit(MAX_RECORD_BYTES);
        let mut records = LinearReader::new_with_options(options);
        let foreign = |found: &str| ReadLogError::RejectFile { path: path.clone(), found: found.to_owned() };
        let run = loop {
            let event = match records.next_event() {
                Some(Ok(event)) => event,
                Some(Err(McapError::BadMagic)) => return Err(foreign("no MCAP file")),
                Some(Err(source)) => return Err(ReadLogError::ReadStart { path, source }),
                None => return Err(foreign("it holds nothing")),
            };
            let (opcode, data) = match event {
                LinearReadEvent::Record { opcode, data } => (opcode, data),
                LinearReadEvent::ReadRequest(need) => {
                    feed(&mut records, &mut file, need)
                        .map_err(|source| ReadLogError::Io { path: path.clone(), source })?;
                    continue;
                }
            };
            match mcap::parse_record(opcode, data) {
                Ok(Record::Header(header)) if header.profile != PROFILE => {
                    return Err(foreign(&format!("an MCAP file of profile {:?}", header.profile)));
                }
                Ok(Record::Attachment { header, data, .. }) if header.name == RUN_ATTACHMENT => {
                    break RunSpec::decode(&data)
                        .map_err(|source| ReadLogError::DecodeRun { path: path.clone(), source })?;
                }
                Ok(Record::Message { .. } | Record::DataEnd(_)) => {
                    return Err(foreign(&format!("it lacks {RUN_ATTACHMENT}")));
                }
                Ok(_) => {}
                Err(source) => return Err(ReadLogError::ReadStart { path, source }),
            }
        };
        Ok(Self {
            path,
            file,
            records,
            run,
            schemas: BTreeMap::new(),
            topics: BTreeMap::new(),
            payload: Vec::new(),
            pending: None,
            damage: None,
            is_finished: false,
        })
    }

    /// The run.
    pub fn run(&self) -> &RunSpec {
        &self.run
    }

    /// Why there is no more to read, if the file ends too early or is damaged from there on.
    pub fn damage(&self) -> Option<&McapError> {
        self.damage.as_ref()
    }

    /// The next payload; none at the end, or where a cut or damage begins.
    ///
    /// # Errors
    /// The file can't be read; a payload whose layout is not this build's.
    pub fn next_payload(&mut self) -> Result<Option<PayloadRef<'_>>, ReadLogError> {
        let Some((topic, tick)) = self.next_topic()? else { return Ok(None) };
        let bytes = self.payload.as_slice();
        Ok(Some(PayloadRef { name: topic.kind.name, robot: topic.robot, tick, bytes }))
    }

    /// Puts all payloads of the next tick into `observation`; `false` at the end, or where a cut or damage
    /// begins. Epochs and stamps are not recorded, and are zero. What was lost in wall-clock time stays as it was.
    ///
    /// # Errors
    /// The file can't be read; a payload whose layout is not this build's; a tick that lacks frames.
    pub fn read_tick(&mut self, observation: &mut Observation) -> Result<bool, ReadLogError> {
        let expected = Kind::ALL.iter().map(|kind| kind.count(self.run.robots.len())).sum();
        let may_lack_frames = self.run.scenario.clock == Clock::Wall;
        let (mut found, mut current) = (0, None);
        while found < expected {
            let next = self.next_topic()?;
            let reject = |tick| ReadLogError::RejectTick { path: self.path.clone(), tick, found, expected };
            let (topic, tick) = match next {
                Some((topic, tick)) if current.is_none_or(|current| current == tick) => (topic, tick),
                Some(next) if may_lack_frames => {
                    self.pending = Some(next);
                    return Ok(true);
                }
                Some((_, tick)) => return Err(reject(current.unwrap_or(tick))),
                None => return Ok(may_lack_frames && self.damage.is_none() && found > 0),
            };
            current = Some(tick);
            let bytes = self.payload.as_slice();
            let payload = PayloadRef { name: topic.kind.name, robot: topic.robot, tick, bytes };
            if !observation.take(&payload) {
                return Err(reject(tick));
            }
            found += 1;
        }
        Ok(true)
    }

    /// The next payload, which then lies in `self.payload`.
    fn next_topic(&mut self) -> Result<Option<(Topic, u64)>, ReadLogError> {
        if let Some(pending) = self.pending.take() {
            return Ok(Some(pending));
        }
        while !self.is_finished {
            if let Some(found) = self.advance()? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// One step through the file: at most one payload, which then lies in `self.payload`.
    fn advance(&mut self) -> Result<Option<(Topic, u64)>, ReadLogError> {
        let record = match self.records.next_event() {
            None => {
                self.is_finished = true;
                return Ok(None);
            }
            Some(Ok(LinearReadEvent::ReadRequest(need))) => {
                feed(&mut self.records, &mut self.file, need)
                    .map_err(|source| ReadLogError::Io { path: self.path.clone(), source })?;
                return Ok(None);
            }
            Some(Ok(LinearReadEvent::Record { opcode, data })) => mcap::parse_record(opcode, data),
            Some(Err(error)) => Err(error),
        };
        match record {
            Ok(Record::Schema { header, data }) => {
                self.schemas.insert(header.id, data.into_owned());
            }
            Ok(Record::Channel(channel)) if channel.message_encoding == ENCODING => {
                let topic = topic_of(&self.path, &self.run, &self.schemas, &channel)?;
                self.topics.insert(channel.id, topic);
            }
            Ok(Record::Message { header, data }) => {
                // What others have added to the file is none of ours.
                let Some(topic) = self.topics.get(&header.channel_id).copied() else {
                    return Ok(None);
                };
                if data.len() != topic.kind.size_bytes {
                    let problem = format!(
                        "tick {} has {} bytes, expected {}",
                        header.sequence,
                        data.len(),
                        topic.kind.size_bytes
                    );
                    let topic = topic.kind.name.to_owned();
                    return Err(ReadLogError::RejectMessage { path: self.path.clone(), topic, problem });
                }
                self.payload.clear();
                self.payload.extend_from_slice(&data);
                return Ok(Some((topic, header.sequence.into())));
            }
            Ok(_) => {}
            Err(error) => {
                self.damage = Some(error);
                self.is_finished = true;
            }
        }
        Ok(None)
    }
}

/// Hands the next bytes of the file to the reader; none at its end.
fn feed(records: &mut LinearReader, file: &mut File, need: usize) -> io::Result<()> {
    let read = file.read(records.insert(need.clamp(1, READ_BYTES)))?;
    records.notify_read(read);
    Ok(())
}

/// What a channel carries, if its schema is this build's.
fn topic_of(
    path: &Path,
    run: &RunSpec,
    schemas: &BTreeMap<u16, Vec<u8>>,
    channel: &Channel,
) -> Result<Topic, ReadLogError> {
    let reject = |problem: String| ReadLogError::RejectSchema {
        path: path.to_owned(),
        topic: channel.topic.clone(),
        problem,
    };
    let (name, owner) = channel.topic.split_once('/').unwrap_or((&channel.topic, ""));
    let kind = Kind::ALL.iter().find(|kind| kind.name == name);
    let kind = kind.ok_or_else(|| reject("this build knows no such payload".to_owned()))?;
    let found = schemas.get(&channel.schema_id).map(Vec::as_slice).unwrap_or_default();
    let found = String::from_utf8_lossy(found);
    let expected = schema_of(kind.fields);
    if let Some(difference) = first_difference(&found, &expected) {
        return Err(reject(difference));
    }
    let robot = match kind.is_per_robot {
        true => run.robots.iter().position(|robot| robot.member.name == owner),
        false => Some(0),
    };
    let robot = robot.ok_or_else(|| reject(format!("the run has no robot {owner:?}")))?;
    Ok(Topic { kind, robot })
}

/// The first line in which two schemas part.
fn first_difference(found: &str, expected: &str) -> Option<String> {
    let (mut found, mut expected) = (found.lines(), expected.lines());
    loop {
        match (found.next(), expected.next()) {
            (None, None) => return None,
            (Some(found), Some(expected)) if found == expected => {}
            (found, expected) => {
                let quoted =
                    |line: Option<&str>| line.map_or("nothing".to_owned(), |line| format!("`{line}`"));
                return Some(format!("found {}, expected {}", quoted(found), quoted(expected)));
            }
        }
    }
}
