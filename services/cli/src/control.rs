//! What a supervisor can be asked while its run goes on: one line of JSON through a socket in the run's
//! directory, and one line back.

use crate::failure::{Failure, Status};
use crate::socket::{accept, listen};
use crate::wall_clock::Stopwatch;
use core::time::Duration;
use mikoshi_runtime::{Board, RunDirectory};
use serde::{Deserialize, Serialize};
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

const SOCKET: &str = "control";
/// A request is short, and comes at once.
const MAX_REQUEST_BYTES: usize = 1 << 16;
const MAX_REQUEST_TIME: Duration = Duration::from_secs(1);
/// Who wants more at a time waits at the door.
const MAX_CLIENTS: usize = 8;

/// What is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Request {
    /// Another process takes a service's place.
    Swap {
        /// `bridge`, `coordinator`, or the name of a robot.
        service: String,
        /// Keys and values in place of the run's.
        #[serde(default)]
        set: Vec<(String, String)>,
        /// The program, if it is to be another one.
        #[serde(default)]
        program: Option<PathBuf>,
    },
    /// Something in the simulated world is pushed.
    Push {
        /// `object`, or the name of a robot.
        on: String,
        /// In the world.
        force_n: [f64; 3],
        /// For how long.
        for_s: f64,
    },
    /// The coordinator goes on with other settings.
    Set {
        /// Keys and values in place of the run's.
        set: Vec<(String, String)>,
    },
    /// A robot leaves the team, or joins it.
    Membership {
        /// Its name.
        robot: String,
        /// Whether it leaves.
        leaves: bool,
    },
    /// The team stops, and stands.
    Stop,
    /// The team goes on after a safe stop.
    Resume,
}

/// What came of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "reply", rename_all = "kebab-case")]
pub enum Reply {
    /// It was done.
    Done {
        /// In words.
        message: String,
    },
    /// It was not done, and nothing has changed.
    Refused {
        /// Why.
        message: String,
    },
}

/// The supervisor's end.
pub struct Control {
    listener: UnixListener,
    clients: Vec<Client>,
}

/// Somebody who asks.
pub struct Client {
    stream: UnixStream,
    request: Vec<u8>,
    since: Stopwatch,
}

impl Control {
    /// Listens in this run's directory.
    ///
    /// # Errors
    /// There can be no socket.
    pub fn listen(run: &Path) -> io::Result<Self> {
        Ok(Self { listener: listen(&run.join(SOCKET))?, clients: Vec::new() })
    }

    /// The next request, if there is a whole one. It never waits.
    pub fn next(&mut self) -> Option<(Request, Client)> {
        if self.clients.len() < MAX_CLIENTS
            && let Some(stream) = accept(&self.listener)
        {
            self.clients.push(Client { stream, request: Vec::new(), since: Stopwatch::start() });
        }
        let index = self.clients.iter_mut().position(|client| client.read() != Reading::Unfinished)?;
        let mut client = self.clients.swap_remove(index);
        if client.read() == Reading::Gone {
            return None;
        }
        match serde_json::from_slice(&client.request) {
            Ok(request) => Some((request, client)),
            Err(error) => {
                client.refuse(format!("not a request: {error}"));
                None
            }
        }
    }
}

#[derive(PartialEq, Eq)]
enum Reading {
    Unfinished,
    Whole,
    Gone,
}

impl Client {
    fn read(&mut self) -> Reading {
        let mut bytes = [0; 4096];
        while !self.request.ends_with(b"\n") {
            match self.stream.read(&mut bytes) {
                Ok(0) => return Reading::Gone,
                Ok(length) => self.request.extend_from_slice(&bytes[..length]),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    let is_late = self.since.elapsed() > MAX_REQUEST_TIME;
                    return if is_late { Reading::Gone } else { Reading::Unfinished };
                }
                Err(_) => return Reading::Gone,
            }
            if self.request.len() > MAX_REQUEST_BYTES {
                return Reading::Gone;
            }
        }
        Reading::Whole
    }

    /// Says that it was done.
    pub fn done(self, message: String) {
        self.reply(&Reply::Done { message });
    }

    /// Says that it was not done, and why.
    pub fn refuse(self, message: String) {
        self.reply(&Reply::Refused { message });
    }

    fn reply(mut self, reply: &Reply) {
        let mut line = serde_json::to_vec(reply).unwrap_or_default();
        line.push(b'\n');
        // Who has gone meanwhile does not want to know.
        let _ = self.stream.set_nonblocking(false);
        let _ = self.stream.set_write_timeout(Some(MAX_REQUEST_TIME));
        let _ = self.stream.write_all(&line);
    }
}

/// The run of this name or, without one, the only run there is.
///
/// # Errors
/// There is none, or more than one: bad usage.
pub fn find_run(name: Option<&str>) -> Result<PathBuf, Failure> {
    find_run_that(name, "runs", |_| true)
}

/// The same among those of which this is true.
///
/// # Errors
/// As [`find_run`].
pub fn find_run_that(
    name: Option<&str>,
    what_it_does: &str,
    is_meant: impl Fn(&Board) -> bool,
) -> Result<PathBuf, Failure> {
    let mut runs = RunDirectory::list(&RunDirectory::default_base()).map_err(Failure::fault)?;
    runs.retain(|run| run.alive && Board::open(&run.path).is_ok_and(|board| is_meant(&board)));
    let name_of = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let names: Vec<_> = runs.iter().map(|run| name_of(&run.path)).collect();
    let usage = |message: String| Failure { status: Status::Usage, message };
    let index = match name {
        Some(name) => names.iter().position(|other| other == name).ok_or_else(|| {
            usage(format!("--run: found {name:?}, expected what {what_it_does}: {}", names.join(", ")))
        })?,
        None if runs.len() == 1 => 0,
        None if runs.is_empty() => return Err(usage(format!("nothing {what_it_does}"))),
        None => return Err(usage(format!("several runs: choose one by --run: {}", names.join(", ")))),
    };
    Ok(runs.swap_remove(index).path)
}

/// Asks the supervisor of a run, and waits for what comes of it.
///
/// # Errors
/// Nobody listens, or it is refused: bad usage.
pub fn ask(run: &Path, request: &Request) -> Result<String, Failure> {
    let failed = |error: io::Error| Failure::fault(error).context(run.join(SOCKET).display());
    let mut stream = UnixStream::connect(run.join(SOCKET)).map_err(failed)?;
    let mut line = serde_json::to_vec(request).map_err(Failure::fault)?;
    line.push(b'\n');
    stream.write_all(&line).map_err(failed)?;
    let mut reply = String::new();
    BufReader::new(stream).read_line(&mut reply).map_err(failed)?;
    match serde_json::from_str(&reply) {
        Ok(Reply::Done { message }) => Ok(message),
        Ok(Reply::Refused { message }) => Err(Failure { status: Status::Usage, message }),
        Err(_) => Err(Failure::fault("the run has ended without an answer")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swap() -> Request {
        Request::Swap { service: "A".to_owned(), set: vec![("a.b".into(), "1".into())], program: None }
    }

    fn next(control: &mut Control) -> (Request, Client) {
        loop {
            if let Some(found) = control.next() {
                return found;
            }
        }
    }

    #[test]
    fn what_is_asked_is_heard_and_what_is_answered_too() {
        let run = tempfile::tempdir().expect("a folder");
        let mut control = Control::listen(run.path()).expect("a socket");
        std::thread::scope(|scope| {
            let asking = scope.spawn(|| ask(run.path(), &swap()));
            let (request, client) = next(&mut control);
            assert_eq!(request, swap());
            client.done("in tick 7".to_owned());
            assert_eq!(asking.join().expect("no panic").expect("it was done"), "in tick 7");

            let asking = scope.spawn(|| ask(run.path(), &swap()));
            next(&mut control).1.refuse("no such robot".to_owned());
            let failure = asking.join().expect("no panic").expect_err("it was refused");
            assert_eq!((failure.status, failure.message.as_str()), (Status::Usage, "no such robot"));
        });
    }

    #[test]
    fn whoever_sends_nonsense_or_half_a_request_disturbs_nobody() {
        let run = tempfile::tempdir().expect("a folder");
        let mut control = Control::listen(run.path()).expect("a socket");
        let connect = || UnixStream::connect(run.path().join(SOCKET)).expect("it listens");
        let _silent = connect();
        let mut half = connect();
        half.write_all(b"{\"request\":").expect("it is read");
        drop(connect());
        for nonsense in [&b"{}\n"[..], b"\xff\xfe\n", b"{\"request\":\"swap\",\"service\":\"A\",\"x\":1}\n"] {
            let mut stream = connect();
            stream.write_all(nonsense).expect("it is read");
            let mut reply = String::new();
            stream.set_nonblocking(true).expect("a socket");
            while !reply.ends_with('\n') {
                assert!(control.next().is_none());
                let _ = stream.read_to_string(&mut reply);
            }
            assert!(reply.contains("refused") && reply.contains("not a request"), "{reply}");
        }
        std::thread::scope(|scope| {
            let asking = scope.spawn(|| ask(run.path(), &swap()));
            next(&mut control).1.done(String::new());
            assert!(asking.join().expect("no panic").is_ok());
        });
    }

    #[test]
    fn a_run_that_ends_leaves_nobody_waiting() {
        let run = tempfile::tempdir().expect("a folder");
        let mut control = Control::listen(run.path()).expect("a socket");
        std::thread::scope(|scope| {
            let asking = scope.spawn(|| ask(run.path(), &swap()));
            drop(next(&mut control));
            let failure = asking.join().expect("no panic").expect_err("nobody answers");
            assert_eq!(failure.status, Status::Fault);
        });
    }
}
