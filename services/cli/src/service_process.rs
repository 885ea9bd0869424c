//! One service process, whoever started it: watched, ended, asked for its last words.

use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{Board, ProcessWatch, Role, State};
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{Child, ExitStatus};
use std::rc::Rc;

/// Last words of a process that are shown when it failed.
const LAST_LINES: usize = 12;

/// One service process.
pub struct ServiceProcess {
    /// Which service.
    pub service: ServiceId,
    /// What people call it: `bridge`, `servo of robot A`.
    pub label: String,
    /// The robot that it controls.
    pub robot: Option<String>,
    /// What its successors take over, too.
    pub variant: Variant,
    /// How it ended, once it has.
    pub ended: Option<Ended>,
    /// By which it is watched.
    pub handle: Handle,
    /// Where its words go.
    pub log: PathBuf,
}

/// In what a process differs from the others of its kind.
#[derive(Clone, Debug, Default)]
pub struct Variant {
    /// Its description of the run.
    pub spec: Option<PathBuf>,
    /// Its program.
    pub program: Option<PathBuf>,
    /// What else it is told.
    pub arguments: Vec<String>,
}

/// How a process ended.
#[derive(Clone, Copy, Debug)]
pub struct Ended {
    /// By itself or by a signal; of a process that somebody else has started nobody says.
    pub status: Option<ExitStatus>,
    /// Whether it had done its part.
    pub is_success: bool,
    /// Whether the signal was ours, since it would not end.
    pub by_us: bool,
}

/// By which a process is watched.
pub enum Handle {
    /// We have started it.
    Own(Child),
    /// A supervisor before us has.
    Adopted {
        /// Its end.
        watch: ProcessWatch,
        /// Where it said what it had done.
        board: Rc<Board>,
    },
}

impl ServiceProcess {
    /// How it ended, if it has.
    pub fn look(&mut self) -> Option<Ended> {
        if self.ended.is_none() {
            self.ended = match &mut self.handle {
                Handle::Own(child) => {
                    let status = child.try_wait().ok().flatten();
                    status.map(|status| Ended {
                        status: Some(status),
                        is_success: status.success(),
                        by_us: false,
                    })
                }
                Handle::Adopted { watch, board } if watch.has_exited() => {
                    let is_success = has_served(board, self.service, watch);
                    Some(Ended { status: None, is_success, by_us: false })
                }
                Handle::Adopted { .. } => None,
            };
        }
        self.ended
    }

    /// Its process id.
    pub fn id(&self) -> u32 {
        match &self.handle {
            Handle::Own(child) => child.id(),
            Handle::Adopted { watch, .. } => watch.identity().pid,
        }
    }

    /// Whether it has ended otherwise than with success.
    pub fn has_failed(&self) -> bool {
        self.ended.is_some_and(|ended| !ended.is_success)
    }

    /// Of what it died, if it was not of itself.
    pub fn death(&self) -> Option<String> {
        let ended = self.ended.filter(|ended| !ended.is_success)?;
        match ended.status {
            Some(status) => status.signal().map(|signal| format!("killed by signal {signal}")),
            None => Some("died".to_owned()),
        }
    }

    /// Ends it, if it still runs.
    pub fn kill(&mut self) {
        if self.look().is_some() {
            return;
        }
        let status = match &mut self.handle {
            Handle::Own(child) => {
                // It fails for a process that has just ended, which is what we want.
                let _ = child.kill();
                child.wait().ok()
            }
            Handle::Adopted { watch, .. } => {
                watch.kill();
                None
            }
        };
        // It may have ended by itself meanwhile.
        let is_success = status.is_some_and(|status| status.success());
        self.ended = Some(Ended { status, is_success, by_us: !is_success });
    }

    /// The last lines that it wrote, indented; empty if it said nothing.
    pub fn last_words(&self) -> String {
        let text = fs::read(&self.log).map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        let text = text.unwrap_or_default();
        let lines: Vec<_> = text.lines().filter(|line| !line.trim().is_empty()).collect();
        let last = &lines[lines.len().saturating_sub(LAST_LINES)..];
        last.iter().flat_map(|line| ["\n  ", line]).collect()
    }
}

/// Whether this process has done its part in a service, or has left it to a successor.
fn has_served(board: &Board, service: ServiceId, process: &ProcessWatch) -> bool {
    let state = board.states().find_map(|(role, state)| (role == Role::Service(service)).then_some(state));
    board.process_of(service) != Some(process.identity())
        || matches!(state, Some(State::Done | State::Retired))
}
