//! What a process keeps for its successor: a file in the run's directory, mapped by the process that
//! writes it and read by the one that takes its place.
//!
//! ```text
//! header   magic, state schema, room in a slot
//! slot 0   sequence, position, length, checksum; the state
//! slot 1   the same
//! ```
//!
//! The slots are written in turn. Wherever the writer is killed, the other slot still holds what it kept
//! before: a slot has no sequence while it is written, and its checksum must be that of what it holds. Every
//! epoch writes a file of its own, so that a process which wakes after its successor took over can spoil
//! nothing.

use crate::{Position, TickError};
use core::sync::atomic::{AtomicU64, Ordering, fence};
use memmap2::MmapMut;
use mikoshi_ipc_types::ServiceId;
use std::fs::OpenOptions;
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64;

/// Names the layout of the file too: another one gets another number.
const MAGIC: u64 = u64::from_le_bytes(*b"mikoshi1");
/// Words of the header, and of what precedes the state in a slot: a cache line each.
const LINE_WORDS: usize = 8;
const LINE_BYTES: usize = LINE_WORDS * size_of::<u64>();

/// Writes one service's checkpoints.
pub(crate) struct CheckpointWriter {
    map: MmapMut,
    slot_bytes: usize,
    /// Of checkpoints that were written.
    count: u64,
}

/// What a successor goes on from.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// The phase that had been computed.
    pub position: Position,
    /// Names the layout of the state.
    pub schema: u64,
    /// The state after it.
    pub state: Vec<u8>,
}

impl CheckpointWriter {
    /// For one epoch of a service of the run in this directory.
    pub(crate) fn create(
        run: &Path,
        service: ServiceId,
        epoch: u64,
        schema: u64,
        state_bytes: usize,
    ) -> io::Result<Self> {
        Self::create_at(&run.join(format!("{}{epoch}", prefix(service))), schema, state_bytes)
    }

    fn create_at(path: &Path, schema: u64, state_bytes: usize) -> io::Result<Self> {
        let slot_bytes = LINE_BYTES + state_bytes.next_multiple_of(LINE_BYTES);
        let size = LINE_BYTES + 2 * slot_bytes;
        let file = OpenOptions::new().read(true).write(true).create_new(true).mode(0o600).open(path)?;
        // Allocated, not only sized: a page that shared memory has no room for would fault in a tick.
        rustix::fs::fallocate(&file, rustix::fs::FallocateFlags::empty(), 0, size as u64)?;
        // SAFETY: the file was just made, nobody truncates it (only its user may enter the run's directory),
        // and nobody else writes to it.
        let mut map = unsafe { memmap2::MmapOptions::new().len(size).populate().map_mut(&file)? };
        for (word, value) in map.chunks_exact_mut(size_of::<u64>()).zip([MAGIC, schema, slot_bytes as u64]) {
            word.copy_from_slice(&value.to_le_bytes());
        }
        Ok(Self { map, slot_bytes, count: 0 })
    }

    /// Keeps what `save` writes: the state after the phase at this position.
    pub(crate) fn write(
        &mut self,
        position: Position,
        save: impl FnOnce(&mut [u8]) -> Result<usize, TickError>,
    ) -> Result<(), TickError> {
        let start = LINE_BYTES + (self.count % 2) as usize * self.slot_bytes;
        let slot = self.map.get_mut(start..start + self.slot_bytes);
        let (line, state) = slot
            .and_then(|slot| slot.split_at_mut_checked(LINE_BYTES))
            .ok_or(TickError::Checkpoint("the file is too short"))?;
        // No sequence, no checkpoint: it must be gone before anything of the slot changes.
        store(line, 0, 0);
        fence(Ordering::Release);
        let length = save(state)?;
        let state = state.get(..length).ok_or(TickError::Checkpoint("the state is larger than it said"))?;
        let checksum = xxh3_64(state);
        self.count += 1;
        for (index, value) in [(1, position.to_word()), (2, length as u64), (3, checksum)] {
            store(line, index, value);
        }
        fence(Ordering::Release);
        store(line, 0, self.count);
        Ok(())
    }
}

/// A store that stays where it is among the fences.
fn store(line: &mut [u8], index: usize, value: u64) {
    let (_, words, _) = {
        // SAFETY: any bit pattern is a valid word, and an atomic has the layout of its integer.
        unsafe { line.align_to_mut::<AtomicU64>() }
    };
    if let Some(word) = words.get(index) {
        word.store(value.to_le(), Ordering::Relaxed);
    }
}

/// What this service kept last, in whatever epoch; none if it has kept nothing yet.
pub(crate) fn latest(run: &Path, service: ServiceId) -> io::Result<Option<Checkpoint>> {
    let mut latest: Option<Checkpoint> = None;
    for path in files(run, service)? {
        for checkpoint in read(&std::fs::read(path)?).into_iter().flatten() {
            if latest.as_ref().is_none_or(|other| other.position <= checkpoint.position) {
                latest = Some(checkpoint);
            }
        }
    }
    Ok(latest)
}

/// What this epoch of a service has kept last; none if that is nothing, or is being written.
///
/// # Errors
/// It can't be read.
pub fn kept_by(run: &Path, service: ServiceId, epoch: u64) -> io::Result<Option<Checkpoint>> {
    let bytes = match std::fs::read(run.join(format!("{}{epoch}", prefix(service)))) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        bytes => bytes?,
    };
    Ok(read(&bytes).into_iter().flatten().max_by_key(|checkpoint| checkpoint.position))
}

/// Has nobody go on from what any epoch of this service has kept here.
pub(crate) fn discard(run: &Path, service: ServiceId) -> io::Result<()> {
    files(run, service)?.into_iter().try_for_each(std::fs::remove_file)
}

/// What a service on another host has kept, for a successor on this one.
pub struct CheckpointCopy {
    run: PathBuf,
    service: ServiceId,
    /// Once something has come, and what of it has the room of what it is.
    writer: Option<(CheckpointWriter, u64, usize)>,
}

/// The epoch of nobody, by which copies are known.
const COPY_EPOCH: u64 = 0;

impl CheckpointCopy {
    /// For this service of the run in this directory.
    pub fn new(run: &Path, service: ServiceId) -> Self {
        Self { run: run.to_path_buf(), service, writer: None }
    }

    /// The last that was kept.
    ///
    /// # Errors
    /// It can't be read.
    pub fn latest(&self) -> io::Result<Option<Checkpoint>> {
        kept_by(&self.run, self.service, COPY_EPOCH)
    }

    /// Keeps it.
    ///
    /// # Errors
    /// It can't be written.
    pub fn keep(&mut self, checkpoint: &Checkpoint) -> io::Result<()> {
        let Checkpoint { position, schema, state } = checkpoint;
        let fits = |(_, of, room): &(CheckpointWriter, u64, usize)| of == schema && state.len() <= *room;
        if !self.writer.as_ref().is_some_and(fits) {
            // It gets its name with what it holds: what was there before is good until then.
            let path = self.run.join(format!("copy-of-{}", self.service));
            let _ = std::fs::remove_file(&path);
            let mut writer = CheckpointWriter::create_at(&path, *schema, state.len())?;
            Self::write(&mut writer, *position, state)?;
            std::fs::rename(&path, self.run.join(format!("{}{COPY_EPOCH}", prefix(self.service))))?;
            self.writer = Some((writer, *schema, state.len()));
            return Ok(());
        }
        self.writer.as_mut().map_or(Ok(()), |(writer, ..)| Self::write(writer, *position, state))
    }

    fn write(writer: &mut CheckpointWriter, position: Position, state: &[u8]) -> io::Result<()> {
        let save = |room: &mut [u8]| {
            let room = room.get_mut(..state.len()).ok_or(TickError::Checkpoint("no room"))?;
            room.copy_from_slice(state);
            Ok(state.len())
        };
        writer.write(position, save).map_err(io::Error::other)
    }
}

fn prefix(service: ServiceId) -> String {
    format!("checkpoint-{service}-")
}

fn files(run: &Path, service: ServiceId) -> io::Result<Vec<PathBuf>> {
    let prefix = prefix(service);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(run)? {
        let entry = entry?;
        if entry.file_name().to_string_lossy().starts_with(&prefix) {
            files.push(entry.path());
        }
    }
    Ok(files)
}

/// What both slots of a file hold, as far as they are whole.
fn read(bytes: &[u8]) -> [Option<Checkpoint>; 2] {
    let word = |at: usize| {
        let bytes = bytes.get(at..at + size_of::<u64>())?;
        bytes.try_into().ok().map(u64::from_le_bytes)
    };
    let header = |index: usize| word(index * size_of::<u64>());
    let (Some(MAGIC), Some(schema), Some(slot_bytes)) = (header(0), header(1), header(2)) else {
        return [None, None];
    };
    let slot_bytes = usize::try_from(slot_bytes).unwrap_or(usize::MAX).min(bytes.len());
    let slot = |index: usize| {
        let start = LINE_BYTES + index * slot_bytes;
        let field = |index: usize| word(start + index * size_of::<u64>());
        field(0).filter(|sequence| *sequence != 0)?;
        let length = usize::try_from(field(2)?).ok().filter(|length| *length <= slot_bytes)?;
        let state = bytes.get(start + LINE_BYTES..start + LINE_BYTES + length)?;
        let is_whole = field(3)? == xxh3_64(state);
        is_whole.then_some(Checkpoint {
            position: Position::from_word(field(1)?),
            schema,
            state: state.to_vec(),
        })
    };
    [slot(0), slot(1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SERVICE: ServiceId = ServiceId::Servo(1);

    fn at(tick: u64) -> Position {
        Position { tick, phase: 1 }
    }

    fn writer(run: &Path, epoch: u64) -> CheckpointWriter {
        CheckpointWriter::create(run, SERVICE, epoch, 4711, 100).expect("there is room")
    }

    fn keep(writer: &mut CheckpointWriter, tick: u64) {
        let written = writer.write(at(tick), |state| {
            state[..100].fill(tick as u8);
            Ok(100)
        });
        assert_eq!(written, Ok(()));
    }

    fn latest_tick(run: &Path) -> Option<u64> {
        let found = latest(run, SERVICE).expect("it is readable")?;
        assert_eq!((found.schema, found.position.phase), (4711, 1));
        assert!(found.state == [found.position.tick as u8; 100]);
        Some(found.position.tick)
    }

    #[test]
    fn the_last_checkpoint_of_any_epoch_is_found() {
        let run = tempfile::tempdir().expect("a directory");
        assert_eq!(latest_tick(run.path()), None);
        let mut first = writer(run.path(), 1);
        assert_eq!(latest_tick(run.path()), None);
        for tick in 0..5 {
            keep(&mut first, tick);
            assert_eq!(latest_tick(run.path()), Some(tick));
        }
        let mut second = writer(run.path(), 2);
        assert_eq!(latest_tick(run.path()), Some(4));
        keep(&mut second, 5);
        assert_eq!(latest_tick(run.path()), Some(5));
        let other = latest(run.path(), ServiceId::Servo(11)).expect("it is readable");
        assert_eq!(other, None, "servo-1 is not servo-11");
    }

    #[test]
    fn wherever_a_writer_stops_the_checkpoint_before_is_whole() {
        let run = tempfile::tempdir().expect("a directory");
        let mut writer = writer(run.path(), 1);
        keep(&mut writer, 0);
        keep(&mut writer, 1);
        for written in 0..=100 {
            let stopped = writer.write(at(2), |state| {
                state[..written].fill(2);
                Err(TickError::Aborted)
            });
            assert_eq!(stopped, Err(TickError::Aborted));
            assert_eq!(latest_tick(run.path()), Some(1));
        }
    }

    #[test]
    fn a_flipped_bit_costs_no_more_than_one_checkpoint() {
        let run = tempfile::tempdir().expect("a directory");
        let mut writer = writer(run.path(), 1);
        keep(&mut writer, 0);
        keep(&mut writer, 1);
        let path = files(run.path(), SERVICE).expect("it is readable").remove(0);
        let whole = std::fs::read(&path).expect("it is readable");
        let (state_of_second, length) = (2 * LINE_BYTES + writer.slot_bytes, 100);
        for byte in state_of_second..state_of_second + length {
            let mut damaged = whole.clone();
            damaged[byte] ^= 16;
            let [first, second] = read(&damaged);
            assert_eq!(first.map(|found| found.position), Some(at(0)));
            assert_eq!(second, None);
        }
    }

    #[test]
    fn what_is_no_checkpoint_is_none() {
        let run = tempfile::tempdir().expect("a directory");
        let mut writer = writer(run.path(), 1);
        keep(&mut writer, 0);
        let path = files(run.path(), SERVICE).expect("it is readable").remove(0);
        let whole = std::fs::read(&path).expect("it is readable");
        for length in 0..2 * LINE_BYTES + 100 {
            assert_eq!(read(&whole[..length]), [None, None], "{length} bytes");
        }
        for word in 0..LINE_WORDS {
            let mut absurd = whole.clone();
            absurd[8 * word..8 * word + 8].fill(0xff);
            let _ = read(&absurd);
            let mut absurd = whole.clone();
            absurd[LINE_BYTES + 8 * word..LINE_BYTES + 8 * word + 8].fill(0xff);
            let _ = read(&absurd);
        }
    }

    #[test]
    fn a_state_that_does_not_fit_is_an_error() {
        let run = tempfile::tempdir().expect("a directory");
        let mut writer = writer(run.path(), 1);
        assert!(matches!(writer.write(at(0), |_| Ok(1000)), Err(TickError::Checkpoint(_))));
        assert_eq!(latest_tick(run.path()), None);
    }
}
