//! A program in a terminal that is nowhere to be seen: what stands on its screen, and keys that are pressed.

use portable_pty::{Child, CommandBuilder, MasterPty, PtyPair, PtySize, native_pty_system};
use std::fmt::Debug;
use std::io::{Read, Write};
use std::num::NonZeroU16;
use std::process::Command;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::{JoinHandle, spawn};
use vt100::Parser;

/// A terminal with a program in it.
pub struct Screen {
    child: Box<dyn Child + Send + Sync>,
    master: Box<dyn MasterPty + Send>,
    keys: Box<dyn Write + Send>,
    seen: Arc<(Mutex<Seen>, Condvar)>,
    reader: Option<JoinHandle<()>>,
    /// How the terminal was set before the program began.
    before: String,
}

/// What the program has written, and what a terminal makes of it.
struct Seen {
    parser: Parser,
    bytes: Vec<u8>,
    /// Nobody writes any more.
    is_over: bool,
}

/// How a program in a terminal ended.
#[derive(Debug)]
pub struct Left {
    /// Its exit status.
    pub status: u32,
    /// What stands on the screen then.
    pub text: String,
    /// All that it has ever written, escape codes included.
    pub bytes: Vec<u8>,
    /// Whether the terminal is as it was: its own screen, its cursor, its line discipline.
    pub is_restored: bool,
}

impl Screen {
    /// Starts a program on a screen of this many columns and lines.
    pub fn start(command: &Command, columns: u16, lines: u16) -> Self {
        let PtyPair { master, slave } =
            native_pty_system().openpty(size(columns, lines)).expect("a terminal");
        let before = settings(&*master);
        let mut builder = CommandBuilder::new(command.get_program());
        builder.args(command.get_args());
        if let Some(folder) = command.get_current_dir() {
            builder.cwd(folder);
        }
        builder.env("TERM", "xterm-256color");
        for (name, value) in command.get_envs() {
            match value {
                Some(value) => builder.env(name, value),
                None => builder.env_remove(name),
            }
        }
        let child = slave.spawn_command(builder).expect("it can be started");
        // The program alone has the terminal: when it has ended, nothing is left to read.
        drop(slave);
        let parser = Parser::new(number(lines), number(columns), 0);
        let seen = Seen { parser, bytes: vec![], is_over: false };
        let seen = Arc::new((Mutex::new(seen), Condvar::new()));
        let mut output = master.try_clone_reader().expect("a terminal");
        let reader = spawn({
            let seen = Arc::clone(&seen);
            move || {
                let (seen, changed) = &*seen;
                let mut bytes = [0; 4096];
                // When nobody has the terminal any more, reading fails.
                let mut length = output.read(&mut bytes).unwrap_or_default();
                while length > 0 {
                    let mut seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
                    seen.parser.process(&bytes[..length]);
                    seen.bytes.extend_from_slice(&bytes[..length]);
                    drop(seen);
                    changed.notify_all();
                    length = output.read(&mut bytes).unwrap_or_default();
                }
                seen.lock().unwrap_or_else(PoisonError::into_inner).is_over = true;
                changed.notify_all();
            }
        });
        let keys = master.take_writer().expect("a terminal");
        Self { child, master, keys, seen, reader: Some(reader), before }
    }

    /// What stands on the screen.
    pub fn text(&self) -> String {
        self.look(|seen| seen.parser.screen().contents())
    }

    /// Waits until all of this stands on the screen, and returns what does.
    #[track_caller]
    pub fn wait_for(&mut self, texts: &[&str]) -> String {
        self.wait_until(&format!("{texts:?}"), |text| texts.iter().all(|wanted| text.contains(wanted)))
    }

    /// Waits until this is true of what stands on the screen.
    #[track_caller]
    pub fn wait_until(&mut self, what: &str, is_there: impl Fn(&str) -> bool) -> String {
        let (seen, changed) = &*self.seen;
        let mut seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            let text = seen.parser.screen().contents();
            if is_there(&text) {
                return text;
            }
            assert!(!seen.is_over, "it ended without {what}:\n{text}");
            seen = changed.wait(seen).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Presses keys.
    pub fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).and_then(|()| self.keys.flush()).expect("a terminal");
    }

    /// Gives the screen another size.
    pub fn resize(&mut self, columns: u16, lines: u16) {
        self.look(|seen| seen.parser.set_size(number(lines), number(columns)));
        self.master.resize(size(columns, lines)).expect("a terminal");
    }

    /// The process.
    pub fn pid(&self) -> u32 {
        self.child.process_id().expect("it was started")
    }

    /// Waits for its end.
    pub fn wait(mut self) -> Left {
        let status = self.child.wait().expect("it was started").exit_code();
        let after = settings(&*self.master);
        if let Some(reader) = self.reader.take() {
            reader.join().expect("it reads to the end");
        }
        let is_own = self.look(|seen| {
            let screen = seen.parser.screen();
            !screen.alternate_screen() && !screen.hide_cursor()
        });
        let (text, bytes) = self.look(|seen| (seen.parser.screen().contents(), seen.bytes.clone()));
        Left { status, text, bytes, is_restored: is_own && after == self.before }
    }

    fn look<T>(&self, at: impl FnOnce(&mut Seen) -> T) -> T {
        at(&mut self.seen.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

fn size(columns: u16, lines: u16) -> PtySize {
    PtySize { rows: lines, cols: columns, pixel_width: 0, pixel_height: 0 }
}

fn number(value: u16) -> NonZeroU16 {
    NonZeroU16::new(value).expect("a screen has a size")
}

/// The line discipline: echo, line editing, signals by keys.
fn settings(terminal: &dyn MasterPty) -> String {
    fn told(settings: Option<impl Debug>) -> String {
        format!("{:?}", settings.expect("a terminal has settings"))
    }
    told(terminal.get_termios())
}
