//! The folder in which a run leaves its results.

use crate::arguments::ResultsArguments;
use crate::failure::Failure;
use rustix::fs::{FlockOperation, flock};
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// Where runs go that nobody gave a place.
const DEFAULT_PARENT: &str = "runs";
/// Whatever a run leaves, by which a folder with results is recognised and cleared.
const RESULTS: [&str; 8] = [RUN_LOG, SUMMARY, SCENARIO, ROBOTS, WORLD, SERVICE_LOGS, REPORT, LATENCY];
pub(crate) const RUN_LOG: &str = "run.mcap";
pub(crate) const SUMMARY: &str = "summary.json";
const SCENARIO: &str = "scenario.toml";
/// Beside [`SCENARIO`], by its name.
const ROBOTS: &str = "scenario.robots";
const WORLD: &str = "world.xml";
const SERVICE_LOGS: &str = "logs";
/// What `mikoshi latency` measured.
pub(crate) const LATENCY: &str = "latency.json";
/// What `mikoshi report` draws from the others.
pub(crate) const REPORT: &str = "report";

/// A folder that belongs to this run until it is dropped.
#[derive(Debug)]
pub struct OutputDirectory {
    path: PathBuf,
    /// The folder itself, locked: nothing else has to be left in it.
    _lock: File,
}

/// Why a run has no place for its results.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum OpenOutputError {
    #[error("{}: holds the results of an earlier run ({found}): choose another --out, or add --force", path.display())]
    HoldsResults { path: PathBuf, found: &'static str },
    #[error("{}: another run writes its results there: choose another --out", path.display())]
    InUse { path: PathBuf },
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: io::Error },
}

impl From<OpenOutputError> for Failure {
    fn from(error: OpenOutputError) -> Self {
        Self::usage(error).context("--out")
    }
}

impl OutputDirectory {
    /// The folder that was asked for or, if none was, a new one with this name and seed.
    ///
    /// # Errors
    /// As [`OutputDirectory::open`].
    pub fn of(arguments: &ResultsArguments, name: &str, seed: u64) -> Result<Self, OpenOutputError> {
        match &arguments.out {
            Some(path) => Self::open(path, arguments.force),
            None => Self::fresh(name, seed),
        }
    }

    /// The folder `path`, made if it is not there. One that holds results is refused, unless `force`:
    /// then they are removed, and nothing else.
    ///
    /// # Errors
    /// It holds results; another run has it; it can't be made.
    pub fn open(path: &Path, force: bool) -> Result<Self, OpenOutputError> {
        let io_error = |source| OpenOutputError::Io { path: path.to_owned(), source };
        fs::create_dir_all(path).map_err(io_error)?;
        let lock = File::open(path).map_err(io_error)?;
        flock(&lock, FlockOperation::NonBlockingLockExclusive).map_err(|errno| match errno {
            rustix::io::Errno::WOULDBLOCK => OpenOutputError::InUse { path: path.to_owned() },
            other => io_error(other.into()),
        })?;
        if let Some(found) = RESULTS.into_iter().find(|result| path.join(result).exists()) {
            if !force {
                return Err(OpenOutputError::HoldsResults { path: path.to_owned(), found });
            }
            remove_results(path).map_err(io_error)?;
        }
        Ok(Self { path: path.to_owned(), _lock: lock })
    }

    /// A new folder `runs/NAME-SEED`, or with a number behind it where that exists.
    ///
    /// # Errors
    /// It can't be made.
    fn fresh(scenario: &str, seed: u64) -> Result<Self, OpenOutputError> {
        Self::fresh_in(Path::new(DEFAULT_PARENT), scenario, seed)
    }

    fn fresh_in(parent: &Path, scenario: &str, seed: u64) -> Result<Self, OpenOutputError> {
        let io_error = |path: &Path, source| OpenOutputError::Io { path: path.to_owned(), source };
        fs::create_dir_all(parent).map_err(|source| io_error(parent, source))?;
        let mut number = 1_u64;
        loop {
            let name = match number {
                1 => format!("{scenario}-{seed}"),
                _ => format!("{scenario}-{seed}-{number}"),
            };
            let path = parent.join(name);
            match fs::create_dir(&path) {
                Ok(()) => return Self::open(&path, false),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => number += 1,
                Err(error) => return Err(io_error(&path, error)),
            }
        }
    }

    /// Removes what has been written so far, and the folder itself if nothing else is in it.
    pub fn discard(self) {
        // What can't be removed is found by the next run, which says so.
        let _ = remove_results(&self.path);
        let _ = fs::remove_dir(&self.path);
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Every frame of the run.
    pub fn run_log(&self) -> PathBuf {
        self.path.join(RUN_LOG)
    }

    /// What the run came to.
    pub fn summary(&self) -> PathBuf {
        self.path.join(SUMMARY)
    }

    /// The world in the simulator's language.
    pub fn world(&self) -> PathBuf {
        self.path.join(WORLD)
    }

    /// The scenario as it was run, to be run again; its robots lie beside it.
    pub fn scenario(&self) -> PathBuf {
        self.path.join(SCENARIO)
    }

    /// What the services had to say.
    pub fn service_logs(&self) -> PathBuf {
        self.path.join(SERVICE_LOGS)
    }
}

/// Makes sure that this file can be written, and that nothing precious is lost.
///
/// # Errors
/// It is there, and `force` is not; it can't be written: bad usage.
pub fn refuse_to_overwrite(out: &Path, force: bool) -> Result<(), Failure> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(!force).create(true);
    match options.open(out) {
        Ok(_) => Ok(()),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            Err(Failure::usage(format!("{}: exists: choose another, or add --force", out.display())))
        }
        Err(error) => Err(Failure::usage(error).context(out.display())),
    }
}

fn remove_results(folder: &Path) -> io::Result<()> {
    for result in RESULTS.map(|result| folder.join(result)) {
        let removed = if result.is_dir() { fs::remove_dir_all(&result) } else { fs::remove_file(&result) };
        match removed {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_never_overwritten_silently() {
        let parent = tempfile::tempdir().expect("a folder");
        let path = parent.path().join("a/b");
        let ours = OutputDirectory::open(&path, false).expect("it is new");
        fs::write(ours.summary(), "{}").expect("it can be written");
        fs::write(path.join("notes.txt"), "mine").expect("it can be written");
        drop(ours);
        assert!(matches!(
            OutputDirectory::open(&path, false),
            Err(OpenOutputError::HoldsResults { found: "summary.json", .. })
        ));
        let ours = OutputDirectory::open(&path, true).expect("it is forced");
        assert!(!ours.summary().exists() && path.join("notes.txt").exists());
        ours.discard();
        assert!(path.join("notes.txt").exists());
    }

    #[test]
    fn one_folder_serves_one_run_at_a_time() {
        let parent = tempfile::tempdir().expect("a folder");
        let ours = OutputDirectory::open(parent.path(), false).expect("it is new");
        assert!(matches!(OutputDirectory::open(parent.path(), true), Err(OpenOutputError::InUse { .. })));
        drop(ours);
        assert!(OutputDirectory::open(parent.path(), true).is_ok());
    }

    #[test]
    fn runs_without_a_place_get_a_new_one_each() {
        let parent = tempfile::tempdir().expect("a folder");
        let names: Vec<_> = (0..3)
            .map(|_| OutputDirectory::fresh_in(parent.path(), "hold", 4).expect("a new one"))
            .map(|folder| folder.path().strip_prefix(parent.path()).expect("below it").to_owned())
            .collect();
        assert_eq!(names, [Path::new("hold-4"), Path::new("hold-4-2"), Path::new("hold-4-3")]);
    }
}
