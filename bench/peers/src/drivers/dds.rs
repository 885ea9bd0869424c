//! CycloneDDS, of the system: over the loopback interface, without multicast, reliable, nothing dropped.
//!
//! Whatever the wait, CycloneDDS's own threads sleep in the kernel and hand frames on: one that yields only takes them
//! from there without sleeping. Its shared memory needs a daemon beside the processes, and is not used.

use crate::driver::{Driver, DriverError, End, Receiver, Sender, Wait};
use core::ffi::{CStr, c_char};
use mikoshi_ipc_types::ServiceId;
use std::ffi::CString;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

#[allow(missing_docs)]
unsafe extern "C" {
    fn peers_dds_participant(domain: u32, configuration: *const c_char) -> i32;
    fn peers_dds_writer(participant: i32, name: *const c_char) -> i32;
    fn peers_dds_reader(participant: i32, name: *const c_char) -> i32;
    fn peers_dds_waitset(participant: i32, reader: i32) -> i32;
    fn peers_dds_wait(waitset: i32) -> i32;
    fn peers_dds_matched(writer: i32) -> i32;
    fn peers_dds_write(writer: i32, bytes: *const u8, length: u32) -> i32;
    fn peers_dds_take(reader: i32, bytes: *mut u8, length: u32) -> i32;
    fn peers_dds_error(code: i32) -> *const c_char;
}

const CONFIGURATION: &CStr = c"<General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>\
<AllowMulticast>false</AllowMulticast></General>\
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>20</MaxAutoParticipantIndex>\
<Peers><Peer address=\"localhost\"/></Peers></Discovery>";

/// Domains whose ports exist, but for the usual ones.
const DOMAINS: core::ops::Range<u64> = 100..230;

fn checked(code: i32) -> Result<i32, DriverError> {
    if code >= 0 {
        return Ok(code);
    }
    // SAFETY: it names every code, by a string that lives as long as the program.
    Err(DriverError::of(unsafe { CStr::from_ptr(peers_dds_error(code)) }.to_string_lossy()))
}

fn name_of(end: End) -> Result<CString, DriverError> {
    // In a topic's name a hyphen is not allowed.
    CString::new(end.name().replace('-', "_")).map_err(DriverError::of)
}

/// CycloneDDS.
pub struct Dds {
    participant: i32,
    wait: Wait,
}

impl Driver for Dds {
    type Sender = Writer;
    type Receiver = Reader;

    fn open(place: &Path, _: ServiceId, wait: Wait) -> Result<Self, DriverError> {
        let mut hasher = DefaultHasher::new();
        place.hash(&mut hasher);
        let domain = DOMAINS.start + hasher.finish() % (DOMAINS.end - DOMAINS.start);
        // SAFETY: the configuration is a string that lives across the call.
        let participant = checked(unsafe { peers_dds_participant(domain as u32, CONFIGURATION.as_ptr()) })?;
        Ok(Self { participant, wait })
    }

    fn sender(&self, end: End) -> Result<Writer, DriverError> {
        let name = name_of(end)?;
        // SAFETY: the name is a string that lives across the call.
        let writer = checked(unsafe { peers_dds_writer(self.participant, name.as_ptr()) })?;
        Ok(Writer { writer, is_connected: !end.has_reader })
    }

    fn receiver(&self, end: End) -> Result<Reader, DriverError> {
        let name = name_of(end)?;
        // SAFETY: the name is a string that lives across the call.
        let reader = checked(unsafe { peers_dds_reader(self.participant, name.as_ptr()) })?;
        let waitset = match self.wait {
            // SAFETY: numbers only.
            Wait::Blocking => Some(checked(unsafe { peers_dds_waitset(self.participant, reader) })?),
            Wait::Yielding => None,
        };
        Ok(Reader { reader, waitset })
    }
}

/// Writes frames.
pub struct Writer {
    writer: i32,
    is_connected: bool,
}

impl Sender for Writer {
    fn send(&mut self, frame: &[u8]) -> Result<(), DriverError> {
        let writer = self.writer;
        if !self.is_connected {
            Wait::yield_until(|| {
                // SAFETY: numbers only.
                let matched = checked(unsafe { peers_dds_matched(writer) })?;
                Ok::<_, DriverError>((matched > 0).then_some(()))
            })?;
            self.is_connected = true;
        }
        // SAFETY: the bytes live across the call, which only reads them.
        checked(unsafe { peers_dds_write(writer, frame.as_ptr(), frame.len() as u32) }).map(|_| ())
    }
}

/// Takes frames.
pub struct Reader {
    reader: i32,
    waitset: Option<i32>,
}

impl Receiver for Reader {
    fn receive(&mut self, frame: &mut [u8]) -> Result<(), DriverError> {
        let reader = self.reader;
        let mut take = || {
            // SAFETY: so many bytes can be written there.
            let taken = checked(unsafe { peers_dds_take(reader, frame.as_mut_ptr(), frame.len() as u32) })?;
            Ok::<_, DriverError>((taken > 0).then_some(()))
        };
        let Some(waitset) = self.waitset else { return Wait::yield_until(take) };
        loop {
            if take()?.is_some() {
                return Ok(());
            }
            // SAFETY: numbers only.
            checked(unsafe { peers_dds_wait(waitset) })?;
        }
    }
}
