//! The supervisor's end.

use super::{HEAD_BYTES, Kind, SOCKET, Wish};
use crate::socket::{accept, listen};
use crate::wall_clock::{Stopwatch, pause};
use core::time::Duration;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_observation::Observation;
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;

/// What waits for one listener at most.
const LIMIT_BYTES: usize = 32 << 20;
/// Whom this much waits for is waited for, if it wants all.
const BEHIND_BYTES: usize = LIMIT_BYTES / 2;
/// Who takes nothing for so long while something waits for it is given up.
const PATIENCE: Duration = Duration::from_secs(1);
/// Who wants to listen, too, waits at the door.
const MAX_LISTENERS: usize = 16;
const LOOK: Duration = Duration::from_millis(1);

/// Tells listeners what is seen of a run.
pub struct Feed {
    socket: UnixListener,
    robots: usize,
    listeners: Vec<Listening>,
    /// The message that is being made.
    message: Vec<u8>,
}

/// One that listens, or has only connected.
struct Listening {
    stream: UnixStream,
    wish: Option<Wish>,
    pending: VecDeque<u8>,
    ticks_lost: u64,
    since_moved: Stopwatch,
    is_gone: bool,
}

impl Feed {
    /// Of the run in this directory, of a team of so many robots.
    ///
    /// # Errors
    /// There can be no socket.
    pub fn open(run: &Path, robots: usize) -> io::Result<Self> {
        Ok(Self { socket: listen(&run.join(SOCKET))?, robots, listeners: vec![], message: vec![] })
    }

    /// Whether anybody listens.
    #[cfg(test)]
    pub fn has_listeners(&self) -> bool {
        self.listeners.iter().any(|listening| listening.wish.is_some())
    }

    /// Lets listeners in, and sends what waits for them. It never waits.
    pub fn look(&mut self) {
        if self.listeners.len() < MAX_LISTENERS
            && let Some(stream) = accept(&self.socket)
        {
            self.listeners.push(Listening {
                stream,
                wish: None,
                pending: VecDeque::new(),
                ticks_lost: 0,
                since_moved: Stopwatch::start(),
                is_gone: false,
            });
        }
        for listening in &mut self.listeners {
            listening.look();
        }
        self.listeners.retain(|listening| !listening.is_gone);
    }

    /// Whether somebody who wants all that there is has not taken it yet: a run that can wait should.
    pub fn is_behind(&self) -> bool {
        let wants_all = |listening: &&Listening| listening.wish == Some(Wish::All);
        self.listeners.iter().filter(wants_all).any(|listening| listening.pending.len() > BEHIND_BYTES)
    }

    /// Says all of a tick.
    pub fn tick(&mut self, observation: &Observation) {
        if self.listeners.is_empty() {
            return;
        }
        self.message.clear();
        self.message.reserve(HEAD_BYTES + Observation::size_bytes(self.robots));
        self.message.extend([0; HEAD_BYTES]);
        observation.write_to(&mut self.message);
        put_head(&mut self.message, Kind::Tick);
        for listening in &mut self.listeners {
            listening.put_tick(&self.message);
        }
    }

    /// Says that a service has other settings from this tick on.
    pub fn revision(&mut self, tick: u64, service: ServiceId, run: &RunSpec) {
        let index = ServiceId::of_team(self.robots).position(|other| other == service).unwrap_or_default();
        let body = [&tick.to_le_bytes()[..], &(index as u64).to_le_bytes(), &run.encode()].concat();
        self.say(Kind::Revision, &body);
    }

    /// Says that the run has ended, and sends what still waits, as long as it is taken.
    pub fn end(mut self) {
        self.say(Kind::End, &[]);
        loop {
            self.look();
            if self.listeners.iter().all(|listening| listening.pending.is_empty()) {
                break;
            }
            pause(LOOK);
        }
    }

    fn say(&mut self, kind: Kind, body: &[u8]) {
        let message = message_of(kind, body);
        for listening in self.listeners.iter_mut().filter(|listening| listening.wish.is_some()) {
            listening.put_lost();
            listening.put(&message);
        }
    }
}

impl Listening {
    fn look(&mut self) {
        let mut byte = [0];
        match self.stream.read(&mut byte) {
            Ok(0) => self.is_gone = true,
            // Of what it says only the first word counts.
            Ok(_) if self.wish.is_none() => match Wish::of_byte(byte[0]) {
                Some(wish) => {
                    self.wish = Some(wish);
                    self.since_moved = Stopwatch::start();
                }
                None => self.is_gone = true,
            },
            Ok(_) => {}
            Err(error) if is_momentary(&error) => {}
            Err(_) => self.is_gone = true,
        }
        while !self.pending.is_empty() && !self.is_gone {
            match self.stream.write(self.pending.as_slices().0) {
                Ok(written) => {
                    self.pending.drain(..written);
                    self.since_moved = Stopwatch::start();
                }
                Err(error) if is_momentary(&error) => break,
                Err(_) => self.is_gone = true,
            }
        }
        // Nobody waits for who says nothing, and for who takes nothing.
        let is_idle = self.wish.is_some() && self.pending.is_empty();
        self.is_gone |= !is_idle && self.since_moved.elapsed() > PATIENCE;
    }

    fn put_tick(&mut self, message: &[u8]) {
        match self.wish {
            None => {}
            Some(_) if self.pending.len() + message.len() > LIMIT_BYTES => self.ticks_lost += 1,
            Some(_) => {
                self.put_lost();
                self.put(message);
            }
        }
    }

    fn put_lost(&mut self) {
        if self.ticks_lost > 0 {
            let lost = core::mem::take(&mut self.ticks_lost);
            self.put(&message_of(Kind::Lost, &lost.to_le_bytes()));
        }
    }

    fn put(&mut self, message: &[u8]) {
        if self.pending.is_empty() {
            self.since_moved = Stopwatch::start();
        }
        self.pending.extend(message);
    }
}

fn is_momentary(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

fn message_of(kind: Kind, body: &[u8]) -> Vec<u8> {
    let mut message = [&[0; HEAD_BYTES], body].concat();
    put_head(&mut message, kind);
    message
}

/// Writes the head of a message that is complete otherwise.
fn put_head(message: &mut [u8], kind: Kind) {
    let length = u32::try_from(message.len() - HEAD_BYTES).expect("a tick is much smaller");
    message[0] = kind as u8;
    message[1..HEAD_BYTES].copy_from_slice(&length.to_le_bytes());
}
