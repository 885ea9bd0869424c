//! The other end: whoever wants to see a run.

use super::{HEAD_BYTES, Kind, SOCKET, Wish};
use crate::failure::Failure;
use core::time::Duration;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_observation::Observation;
use std::io::{self, BufReader, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;

/// How long it waits before it says that it has heard nothing.
const PATIENCE: Duration = Duration::from_millis(100);
/// No description of a run is as large.
const MAX_BODY_BYTES: usize = 64 << 20;

/// Hears what a supervisor sees of its run.
pub struct Listener {
    stream: BufReader<UnixStream>,
    observation: Observation,
    robots: usize,
    /// What has come of the message that comes.
    message: Vec<u8>,
}

/// What was heard.
#[derive(Debug)]
pub enum Heard<'a> {
    /// All frames of a tick.
    Tick(&'a Observation),
    /// A service has other settings from this tick on.
    Revision {
        /// The first tick.
        tick: u64,
        /// Which service.
        service: ServiceId,
        /// The run as it has it.
        run: Box<RunSpec>,
    },
    /// So many ticks were lost, since this process was too slow.
    Lost(u64),
    /// The run has ended.
    End,
    /// Nothing yet.
    Nothing,
    /// Nobody speaks any more: the supervisor was killed, or has given this process up.
    Silence,
}

/// Listens to the supervisor of the run in this directory, for whoever was told to watch it.
///
/// # Errors
/// The supervisor is gone: bad usage.
pub fn listen_to(run: &Path, robots: usize, wish: Wish) -> Result<Listener, Failure> {
    Listener::connect(run, robots, wish).map_err(|error| match error.kind() {
        ErrorKind::ConnectionRefused | ErrorKind::NotFound => {
            Failure::usage("the run's supervisor is gone: `mikoshi adopt` looks after it")
        }
        _ => Failure::fault(error),
    })
}

impl Listener {
    /// Listens to the supervisor of the run in this directory, of a team of so many robots.
    ///
    /// # Errors
    /// Nobody speaks there.
    pub fn connect(run: &Path, robots: usize, wish: Wish) -> io::Result<Self> {
        let mut stream = UnixStream::connect(run.join(SOCKET))?;
        stream.write_all(&[wish as u8])?;
        stream.set_read_timeout(Some(PATIENCE))?;
        let largest = Observation::size_bytes(robots) + HEAD_BYTES;
        Ok(Self {
            stream: BufReader::with_capacity(largest, stream),
            observation: Observation::for_team(robots),
            robots,
            message: vec![],
        })
    }

    /// The next that is said, or after a moment nothing.
    ///
    /// # Errors
    /// It is not what a supervisor of this build says.
    pub fn hear(&mut self) -> io::Result<Heard<'_>> {
        let strange = |what: &str| io::Error::new(ErrorKind::InvalidData, what.to_owned());
        match self.fill(HEAD_BYTES)? {
            Filled::Whole => {}
            Filled::Partly => return Ok(Heard::Nothing),
            Filled::Never => return Ok(Heard::Silence),
        }
        let kind = Kind::of_byte(self.message[0]).ok_or_else(|| strange("an unknown message"))?;
        let length: [u8; 4] = self.message[1..HEAD_BYTES].try_into().unwrap_or_default();
        let length = u32::from_le_bytes(length) as usize;
        let is_possible = match kind {
            Kind::Tick => length == Observation::size_bytes(self.robots),
            Kind::Revision => (16..=MAX_BODY_BYTES).contains(&length),
            Kind::Lost => length == 8,
            Kind::End => length == 0,
        };
        if !is_possible {
            return Err(strange("a message of another length"));
        }
        match self.fill(HEAD_BYTES + length)? {
            Filled::Whole => {}
            Filled::Partly => return Ok(Heard::Nothing),
            Filled::Never => return Ok(Heard::Silence),
        }
        let message = core::mem::take(&mut self.message);
        let body = &message[HEAD_BYTES..];
        let number = |index: usize| {
            let bytes = body.get(8 * index..8 * index + 8).and_then(|bytes| bytes.try_into().ok());
            u64::from_le_bytes(bytes.unwrap_or_default())
        };
        match kind {
            Kind::Tick if self.observation.read_from(body) => Ok(Heard::Tick(&self.observation)),
            Kind::Tick => Err(strange("a tick of another build")),
            Kind::Revision => {
                let service = ServiceId::of_team(self.robots).nth(number(1) as usize);
                let service = service.ok_or_else(|| strange("an unknown service"))?;
                let run = RunSpec::decode(&body[16..]).map_err(|error| strange(&error.to_string()))?;
                Ok(Heard::Revision { tick: number(0), service, run: Box::new(run) })
            }
            Kind::Lost => Ok(Heard::Lost(number(0))),
            Kind::End => Ok(Heard::End),
        }
    }

    /// Reads until so much of the message has come.
    fn fill(&mut self, length: usize) -> io::Result<Filled> {
        while self.message.len() < length {
            let had = self.message.len();
            let wanted = (length - had).min(1 << 16);
            self.message.resize(had + wanted, 0);
            let read = self.stream.read(&mut self.message[had..]);
            self.message.truncate(had + *read.as_ref().unwrap_or(&0));
            match read {
                Ok(0) => return Ok(Filled::Never),
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    return Ok(Filled::Partly);
                }
                Err(error) if error.kind() == ErrorKind::ConnectionReset => return Ok(Filled::Never),
                Err(error) => return Err(error),
            }
        }
        Ok(Filled::Whole)
    }
}

enum Filled {
    Whole,
    Partly,
    Never,
}
