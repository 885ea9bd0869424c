//! Which process is meant, and whether it still runs.

use core::fmt;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
use std::io;

/// A process that can't be mistaken for a later one with the same pid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProcessIdentity {
    /// Process id.
    pub pid: u32,
    /// When it started, in clock ticks since boot.
    pub start_time: u64,
}

impl fmt::Display for ProcessIdentity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.pid)
    }
}

impl ProcessIdentity {
    /// Linux gives pids of up to 22 bits.
    const PID_BITS: u32 = 22;

    /// As one word, so that it changes hands at once. Never 0.
    pub(crate) fn to_word(self) -> u64 {
        self.start_time << Self::PID_BITS | u64::from(self.pid)
    }

    pub(crate) fn from_word(word: u64) -> Option<Self> {
        let pid = (word & ((1 << Self::PID_BITS) - 1)) as u32;
        (pid != 0).then_some(Self { pid, start_time: word >> Self::PID_BITS })
    }

    /// This process.
    ///
    /// # Errors
    /// `/proc` is not mounted.
    pub fn own() -> io::Result<Self> {
        Self::of(std::process::id())?.ok_or_else(|| io::Error::other("this process is not in /proc"))
    }

    /// The process that has this pid now; none if there is none, or if it has exited and only waits
    /// for its parent.
    ///
    /// # Errors
    /// `/proc` can't be read.
    pub fn of(pid: u32) -> io::Result<Option<Self>> {
        let stat = match std::fs::read_to_string(format!("/proc/{pid}/stat")) {
            Ok(stat) => stat,
            // ESRCH: it exited between open and read.
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) if error.raw_os_error() == Some(rustix::io::Errno::SRCH.raw_os_error()) => {
                return Ok(None);
            }
            Err(error) => return Err(error),
        };
        Ok(start_time(&stat).map(|start_time| Self { pid, start_time }))
    }

    /// Whether it still runs. What can't be known counts as alive: nobody's files are to be removed by
    /// mistake.
    pub fn is_alive(&self) -> bool {
        Self::of(self.pid).map_or(true, |process| process == Some(*self))
    }
}

/// Field 22 of `/proc/PID/stat`; none for a zombie. The name in field 2 may hold blanks and
/// parentheses, so that fields are counted from its last parenthesis.
fn start_time(stat: &str) -> Option<u64> {
    let (_, after_name) = stat.rsplit_once(')')?;
    let mut fields = after_name.split_ascii_whitespace();
    match fields.next()? {
        "Z" | "X" => None,
        _ => fields.nth(18)?.parse().ok(),
    }
}

/// A hold on a process, by which its end is seen without reading `/proc` and even if its parent does
/// not collect it.
#[derive(Debug)]
pub struct ProcessWatch {
    identity: ProcessIdentity,
    /// None if it was gone before it could be watched.
    descriptor: Option<OwnedFd>,
}

impl ProcessWatch {
    /// Of this process.
    pub fn new(identity: ProcessIdentity) -> Self {
        let pid = i32::try_from(identity.pid).ok().and_then(Pid::from_raw);
        let descriptor = pid
            .and_then(|pid| pidfd_open(pid, PidfdFlags::empty()).ok())
            // Asked after opening: the descriptor can no longer move to another process.
            .filter(|_| identity.is_alive());
        Self { identity, descriptor }
    }

    /// Which process it is.
    pub fn identity(&self) -> ProcessIdentity {
        self.identity
    }

    /// Kills it, if it still runs; no other process can be hit.
    pub fn kill(&self) {
        if let Some(descriptor) = &self.descriptor {
            // It fails for a process that has just ended, which is what is wanted.
            let _ = pidfd_send_signal(descriptor, Signal::KILL);
        }
    }

    /// Whether it has ended.
    pub fn has_exited(&self) -> bool {
        let Some(descriptor) = &self.descriptor else { return true };
        let mut descriptors = [PollFd::new(descriptor, PollFlags::IN)];
        let now = Timespec { tv_sec: 0, tv_nsec: 0 };
        poll(&mut descriptors, Some(&now)).is_ok_and(|ready| ready > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::{Command, Stdio};

    #[test]
    fn a_name_with_parentheses_does_not_hide_the_start_time() {
        let fields = (4..=21).map(|field| field.to_string()).collect::<Vec<_>>().join(" ");
        assert_eq!(start_time(&format!("7 (a) (b c) S {fields} 4711 0")), Some(4711));
        assert_eq!(start_time(&format!("7 (a) Z {fields} 4711 0")), None);
        assert_eq!(start_time("nonsense"), None);
    }

    #[test]
    fn a_process_is_alive_until_it_ends_even_if_nobody_collects_it() {
        let mut child =
            Command::new("cat").stdin(Stdio::piped()).stdout(Stdio::null()).spawn().expect("cat runs");
        let identity = ProcessIdentity::of(child.id()).expect("/proc is there").expect("it runs");
        let watch = ProcessWatch::new(identity);
        assert!(identity.is_alive() && !watch.has_exited());

        drop(child.stdin.take());
        while identity.is_alive() {
            std::thread::yield_now();
        }
        assert!(watch.has_exited());
        assert!(ProcessWatch::new(identity).has_exited());
        child.wait().expect("it can be collected");
    }

    #[test]
    fn a_process_that_is_watched_can_be_killed() {
        let mut child =
            Command::new("cat").stdin(Stdio::piped()).stdout(Stdio::null()).spawn().expect("cat runs");
        let watch =
            ProcessWatch::new(ProcessIdentity::of(child.id()).expect("/proc is there").expect("it runs"));
        watch.kill();
        assert!(!child.wait().expect("it can be collected").success());
        assert!(watch.has_exited());
        watch.kill();
    }

    #[test]
    fn another_process_with_the_same_pid_is_another_process() {
        let own = ProcessIdentity::own().expect("/proc is there");
        assert!(own.is_alive());
        let earlier = ProcessIdentity { start_time: own.start_time + 1, ..own };
        assert!(!earlier.is_alive());
        assert!(ProcessWatch::new(earlier).has_exited());
    }
}
