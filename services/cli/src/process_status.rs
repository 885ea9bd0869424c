//! What the system says of a process.

use std::fs;

/// `/proc/PID/status`.
pub struct ProcessStatus(String);

impl ProcessStatus {
    /// Of this process; none if it is gone.
    pub fn of(pid: u32) -> Option<Self> {
        fs::read_to_string(format!("/proc/{pid}/status")).ok().map(Self)
    }

    /// The number behind a name and its colon, whatever its unit.
    pub fn number(&self, name: &str) -> Option<u64> {
        let line = self.0.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
        line.split_ascii_whitespace().next()?.parse().ok()
    }
}
