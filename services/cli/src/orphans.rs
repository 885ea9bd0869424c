//! Processes of a run that has lost its supervisor, as the system tells of them.

use crate::service_process::Variant;
use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

/// One of them.
#[derive(Debug)]
pub struct Orphan {
    /// Its process id.
    pub pid: u32,
    /// The robot that it controls.
    pub robot: Option<String>,
    /// Whether it was started to take over by itself.
    pub is_standby: bool,
    /// In what it differs from others of its kind.
    pub variant: Variant,
    /// Where its words go.
    pub log: Option<PathBuf>,
}

/// Those of the run in this directory.
///
/// # Errors
/// `/proc` is not to be read.
pub fn orphans_of(run: &Path) -> std::io::Result<Vec<Orphan>> {
    let entries = fs::read_dir("/proc")?.flatten();
    let pids = entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    Ok(pids.filter_map(|pid| Orphan::read(pid, run)).collect())
}

impl Orphan {
    /// Whether its program has this name.
    pub fn is_program(&self, name: &str) -> bool {
        self.variant.program.as_ref().and_then(|program| program.file_name()) == Some(OsStr::new(name))
    }

    /// What the process was started with, if that is this run; processes of others can't be read.
    fn read(pid: u32, run: &Path) -> Option<Self> {
        let process = PathBuf::from(format!("/proc/{pid}"));
        let line = fs::read(process.join("cmdline")).ok()?;
        let arguments: Vec<_> = line.split(|byte| *byte == 0).map(OsStr::from_bytes).collect();
        let value_of = |name: &str| {
            let mut rest = arguments.iter().skip_while(|argument| **argument != name);
            rest.nth(1).copied()
        };
        if value_of("--run") != Some(run.as_os_str()) {
            return None;
        }
        Some(Self {
            pid,
            robot: value_of("--robot").and_then(OsStr::to_str).map(str::to_owned),
            is_standby: arguments.contains(&OsStr::new("--standby")),
            variant: Variant {
                spec: value_of("--spec").map(PathBuf::from),
                program: arguments.first().map(PathBuf::from),
                arguments: vec![],
            },
            log: fs::read_link(process.join("fd/2")).ok().filter(|log| log.is_file()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::process::{Command, Stdio};

    #[test]
    fn a_process_is_found_by_its_run_with_all_that_it_was_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let log = fs::File::create(folder.path().join("log")).expect("a file");
        let mut command = Command::new("sh");
        let waits = "echo ready; read line";
        command.args(["-c", waits, "sh", "--run"]).arg(folder.path());
        command.args(["--standby", "--robot", "B", "--spec", "/a spec"]);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(log);
        let mut child = command.spawn().expect("it starts");
        // For a moment after it has begun the system does not tell its arguments.
        let mut word = [0; 5];
        child.stdout.as_mut().expect("it is a pipe").read_exact(&mut word).expect("it says something");
        let found = orphans_of(folder.path()).expect("/proc is there");
        let [orphan] = &found[..] else { panic!("{found:?}") };
        assert_eq!((orphan.pid, orphan.robot.as_deref(), orphan.is_standby), (child.id(), Some("B"), true));
        assert_eq!(orphan.variant.spec.as_deref(), Some(Path::new("/a spec")));
        assert_eq!(orphan.variant.program.as_deref(), Some(Path::new("sh")));
        assert_eq!(orphan.log.as_deref(), Some(&*folder.path().join("log")));
        assert!(orphans_of(Path::new("/another")).expect("/proc is there").is_empty());
        drop(child.stdin.take());
        child.wait().expect("it ends");
    }
}
