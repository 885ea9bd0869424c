//! The run in the directory where its processes meet.

use mikoshi_config::{DecodeRunError, RunSpec};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Its name in the run's directory.
const RUN_FILE: &str = "run.bin";
/// The world's description, by its side.
const WORLD_FILE: &str = "world.xml";

/// Why a run can't be passed on.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum RunFileError {
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error("{}: {source}", path.display())]
    Decode { path: PathBuf, source: DecodeRunError },
}

/// Writes a run for all processes that join it.
///
/// # Errors
/// The file can't be written.
pub fn write_run(directory: &Path, run: &RunSpec) -> Result<(), RunFileError> {
    write_spec(&directory.join(RUN_FILE), run)
}

/// Writes a run to a file.
///
/// # Errors
/// The file can't be written.
pub fn write_spec(path: &Path, run: &RunSpec) -> Result<(), RunFileError> {
    fs::write(path, run.encode()).map_err(|source| RunFileError::Io { path: path.to_owned(), source })
}

/// Writes the description of a run's world, in the simulator's language, for people.
///
/// # Errors
/// The file can't be written.
pub fn write_world(directory: &Path, xml: &str) -> Result<(), RunFileError> {
    let path = world_file(directory);
    fs::write(&path, xml).map_err(|source| RunFileError::Io { path, source })
}

/// Where [`write_world`] puts it; there is none before the world has been described.
pub fn world_file(directory: &Path) -> PathBuf {
    directory.join(WORLD_FILE)
}

/// Reads the run of a directory.
///
/// # Errors
/// The file can't be read, or is not a run of this build.
pub fn read_run(directory: &Path) -> Result<RunSpec, RunFileError> {
    read_spec(&directory.join(RUN_FILE))
}

/// Reads a run from a file.
///
/// # Errors
/// The file can't be read, or is not a run of this build.
pub fn read_spec(path: &Path) -> Result<RunSpec, RunFileError> {
    let path = path.to_owned();
    let bytes = fs::read(&path).map_err(|source| RunFileError::Io { path: path.clone(), source })?;
    RunSpec::decode(&bytes).map_err(|source| RunFileError::Decode { path, source })
}
