//! The programs that stand beside this one.

use crate::failure::{Failure, Status};
use mikoshi_ipc_types::ServiceId;
use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// All services in one thread.
pub const IN_PROCESS: &str = "mikoshi-in-process";
/// A service that computes nothing.
pub const EMPTY: &str = "mikoshi-empty";
/// What keeps cores awake.
pub const AWAKE: &str = "mikoshi-awake";
/// What shows a run. It is built apart.
const VIEWER: &str = "mikoshi-view";
/// What a program's exit status is when the loader can't find one of its libraries.
const LOADER_FAILED: i32 = 127;

/// The name of a service's program.
pub fn name_of(service: ServiceId) -> &'static str {
    match service {
        ServiceId::Bridge => "mikoshi-bridge",
        ServiceId::Coordinator => "mikoshi-coordinator",
        ServiceId::Servo(_) => "mikoshi-servo",
    }
}

/// What kind of service it is, by the name that summaries use.
pub fn kind_of(service: ServiceId) -> &'static str {
    match service {
        ServiceId::Bridge => "bridge",
        ServiceId::Coordinator => "coordinator",
        ServiceId::Servo(_) => "servo",
    }
}

/// The path of a program beside this one.
///
/// # Errors
/// It is not there: [`Status::Fault`].
pub fn find(name: &str) -> Result<PathBuf, Failure> {
    find_in(&here()?, name, "make build")
}

/// The path of the program that shows a run.
///
/// # Errors
/// As [`find`].
pub fn find_viewer() -> Result<PathBuf, Failure> {
    find_in(&here()?, VIEWER, "make view")
}

fn here() -> Result<PathBuf, Failure> {
    let this = env::current_exe().map_err(Failure::fault)?;
    Ok(this.parent().unwrap_or(Path::new("")).to_owned())
}

fn find_in(folder: &Path, name: &str, how: &str) -> Result<PathBuf, Failure> {
    let path = folder.join(name);
    match path.is_file() {
        true => Ok(path),
        false => Err(Failure {
            status: Status::Fault,
            message: format!("{} is missing: run `{how}`", path.display()),
        }),
    }
}

/// The version of the simulator's library.
///
/// # Errors
/// The library can't be loaded, or the program that links to it can't be run: [`Status::Fault`].
pub fn simulator_version() -> Result<String, Failure> {
    let program = find(IN_PROCESS)?;
    let output = Command::new(&program)
        .arg("--version")
        .stdin(Stdio::null())
        .output()
        .map_err(|error| Failure::fault(error).context(program.display()))?;
    let told = String::from_utf8_lossy(&output.stderr);
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    } else if output.status.code() == Some(LOADER_FAILED) {
        Err(Failure {
            status: Status::Fault,
            message: format!(
                "MuJoCo's library can't be loaded: run `make setup`, or set MUJOCO_DYNAMIC_LINK_DIR to your \
                 copy and run `make build`\n{}",
                told.trim()
            ),
        })
    } else {
        Err(Failure {
            status: Status::Fault,
            message: format!("{} --version: {}\n{}", program.display(), output.status, told.trim()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_is_missing_is_named_with_the_way_to_get_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let failure = find_in(folder.path(), "mikoshi-bridge", "make build").expect_err("it is empty");
        assert_eq!(failure.status, Status::Fault);
        assert!(failure.message.ends_with("mikoshi-bridge is missing: run `make build`"));
    }
}
