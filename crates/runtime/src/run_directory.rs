//! The directory of a run, in shared memory: all that its processes have in common.
//!
//! ```text
//! /dev/shm/mikoshi-UID/       only its user may enter
//!     lock                    held while runs are made and removed
//!     PID-N/                  one run, of the supervisor with this pid
//!         lock                held by the supervisor as long as it lives
//!         board               who is where (see `Board`)
//!         iox/                iceoryx2's own files
//! ```
//!
//! Services that the system starts have theirs in /run/mikoshi, which is their user's. Their run is *kept*: no
//! process holds it together, and it is there until it is removed.

use crate::{Board, Domain};
use rustix::fs::{FlockOperation, flock};
use std::fs::{DirBuilder, File, OpenOptions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

const LOCK: &str = "lock";
/// Marks a run that is there whether or not anybody takes part in it.
const KEPT: &str = "kept";
/// Where the runs of the system's services are.
const SYSTEM_BASE: &str = "/run/mikoshi";

/// Why a run has no directory.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}", path.display())]
pub struct RunDirectoryError {
    /// What was used.
    pub path: PathBuf,
    /// Why it could not be.
    pub source: io::Error,
}

/// The directory of a run, held by its supervisor. Dropping it removes it, with all that the run has in
/// shared memory.
#[derive(Debug)]
pub struct RunDirectory {
    path: PathBuf,
    is_removed: bool,
    /// Locked; closing it unlocks it.
    _lock: File,
}

/// A run that was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundRun {
    /// Its directory.
    pub path: PathBuf,
    /// Whether its supervisor or any of its services still runs, or it is kept.
    pub alive: bool,
}

impl RunDirectory {
    /// Where the runs of this user are.
    pub fn default_base() -> PathBuf {
        let uid = rustix::process::getuid().as_raw();
        let is_ours = |metadata: std::fs::Metadata| metadata.is_dir() && metadata.uid() == uid;
        match std::fs::symlink_metadata(SYSTEM_BASE).is_ok_and(is_ours) {
            true => PathBuf::from(SYSTEM_BASE),
            false => PathBuf::from(format!("/dev/shm/mikoshi-{uid}")),
        }
    }

    /// Makes the directory of a run with this name under `base`, which is kept until [`Self::remove_kept`]. What one
    /// of the same name has left is removed.
    ///
    /// # Errors
    /// Processes of such a run still live; `base` can't be made, or is not ours alone.
    pub fn keep(base: &Path, name: &str) -> Result<Self, RunDirectoryError> {
        let (base, _base_lock) = enter(base)?;
        let path = base.join(name);
        let error = |source| RunDirectoryError { path: path.clone(), source };
        if Board::open(&path).is_ok_and(|board| board.has_living_process()) {
            return Err(error(io::Error::new(io::ErrorKind::AddrInUse, "is still carried out")));
        }
        remove(&path).map_err(error)?;
        DirBuilder::new().mode(0o700).create(&path).map_err(error)?;
        let lock = lock(&path, FlockOperation::NonBlockingLockExclusive)?;
        File::create(path.join(KEPT)).map_err(error)?;
        Ok(Self { path, is_removed: false, _lock: lock })
    }

    /// Removes a run that is kept, if there is one.
    ///
    /// # Errors
    /// A file can't be removed.
    pub fn remove_kept(path: &Path) -> Result<(), RunDirectoryError> {
        remove(path).map_err(|source| RunDirectoryError { path: path.to_owned(), source })
    }

    /// Whether this run is there whether or not anybody takes part in it: who starts its processes is not its
    /// supervisor.
    pub fn is_kept(run: &Path) -> bool {
        run.join(KEPT).exists()
    }

    /// Makes the directory of a new run under `base`, and locks it.
    ///
    /// # Errors
    /// `base` can't be made, or is not ours alone.
    pub fn create(base: &Path) -> Result<Self, RunDirectoryError> {
        let (base, _base_lock) = enter(base)?;
        let pid = std::process::id();
        for number in 0_u32.. {
            let path = base.join(format!("{pid}-{number}"));
            match DirBuilder::new().mode(0o700).create(&path) {
                Ok(()) => {
                    let lock = lock(&path, FlockOperation::NonBlockingLockExclusive)?;
                    return Ok(Self { path, is_removed: false, _lock: lock });
                }
                // Left by a process that had our pid before, or another run of ours.
                Err(source) if source.kind() == io::ErrorKind::AlreadyExists => {}
                Err(source) => return Err(RunDirectoryError { path, source }),
            }
        }
        unreachable!("a directory can't hold all numbers")
    }

    /// Takes over a run that has lost its supervisor.
    ///
    /// # Errors
    /// There is no such run, or its supervisor lives.
    pub fn adopt(path: &Path) -> Result<Self, RunDirectoryError> {
        let error = |source| RunDirectoryError { path: path.to_path_buf(), source };
        let path = path.canonicalize().map_err(error)?;
        let base = path.parent().unwrap_or(&path);
        // While it is held nobody takes the run for dead and removes it.
        let (_, _base_lock) = enter(base)?;
        if !path.join(LOCK).is_file() {
            return Err(error(io::ErrorKind::NotFound.into()));
        }
        let lock = lock(&path, FlockOperation::NonBlockingLockExclusive).map_err(|locking| {
            match locking.source.kind() == io::ErrorKind::WouldBlock {
                true => error(io::Error::new(io::ErrorKind::AddrInUse, "its supervisor lives")),
                false => locking,
            }
        })?;
        Ok(Self { path, is_removed: false, _lock: lock })
    }

    /// The directory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The run's name.
    pub fn id(&self) -> String {
        id_of(&self.path)
    }

    /// All runs under `base`, by name; none if there is no such directory.
    ///
    /// # Errors
    /// `base` is not ours alone, or can't be read.
    pub fn list(base: &Path) -> Result<Vec<FoundRun>, RunDirectoryError> {
        if !base.exists() {
            return Ok(Vec::new());
        }
        let (base, _base_lock) = enter(base)?;
        runs_in(&base)
    }

    /// Removes the runs under `base` of which no process is left, and returns their directories.
    ///
    /// # Errors
    /// `base` is not ours alone, or a run can't be removed.
    pub fn clean_dead(base: &Path) -> Result<Vec<PathBuf>, RunDirectoryError> {
        if !base.exists() {
            return Ok(Vec::new());
        }
        // While it is held nobody makes a run, so that none is taken for dead which is half made.
        let (base, base_lock) = enter(base)?;
        let mut removed = Vec::new();
        for run in runs_in(&base)?.into_iter().filter(|run| !run.alive) {
            remove(&run.path).map_err(|source| RunDirectoryError { path: run.path.clone(), source })?;
            removed.push(run.path);
        }
        drop(base_lock);
        leave(&base)?;
        Ok(removed)
    }

    /// Removes the run: its directory, and its files in shared memory.
    ///
    /// # Errors
    /// A file can't be removed.
    pub fn remove(mut self) -> Result<(), RunDirectoryError> {
        self.remove_all()
    }

    /// Lets go of it, and removes nothing: the run may be adopted.
    pub fn leave_as_it_is(mut self) {
        self.is_removed = true;
    }

    fn remove_all(&mut self) -> Result<(), RunDirectoryError> {
        // Once only: its name may already be that of another run.
        if core::mem::replace(&mut self.is_removed, true) {
            return Ok(());
        }
        remove(&self.path).map_err(|source| RunDirectoryError { path: self.path.clone(), source })?;
        self.path.parent().map_or(Ok(()), leave)
    }
}

impl Drop for RunDirectory {
    fn drop(&mut self) {
        // What can't be removed now is garbage, and cleaned at the next start.
        let _ = self.remove_all();
    }
}

/// The name of the run in this directory.
pub(crate) fn id_of(run: &Path) -> String {
    run.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Makes `base` if need be, checks that it is ours alone, and locks it.
fn enter(base: &Path) -> Result<(PathBuf, File), RunDirectoryError> {
    let error = |source| RunDirectoryError { path: base.to_path_buf(), source };
    match DirBuilder::new().mode(0o700).create(base) {
        Err(source) if source.kind() != io::ErrorKind::AlreadyExists => return Err(error(source)),
        _ => {}
    }
    // Shared memory is writable for all: a directory that somebody else has put there is not ours.
    let metadata = std::fs::symlink_metadata(base).map_err(error)?;
    if !metadata.is_dir() || metadata.uid() != rustix::process::getuid().as_raw() {
        return Err(error(io::Error::new(io::ErrorKind::PermissionDenied, "belongs to somebody else")));
    }
    if metadata.mode() & 0o077 != 0 {
        return Err(error(io::Error::new(
            io::ErrorKind::PermissionDenied,
            "is open to others (chmod 700 would close it)",
        )));
    }
    let base = base.canonicalize().map_err(error)?;
    let lock = lock(&base, FlockOperation::LockExclusive)?;
    // Its last user may have removed it while we waited for the lock.
    match std::fs::metadata(base.join(LOCK))
        .is_ok_and(|file| lock.metadata().is_ok_and(|m| m.ino() == file.ino()))
    {
        true => Ok((base, lock)),
        false => enter(&base),
    }
}

/// Removes `base` if it is the usual one and no run is left in it.
fn leave(base: &Path) -> Result<(), RunDirectoryError> {
    if base != RunDirectory::default_base() {
        return Ok(());
    }
    let (base, _base_lock) = enter(base)?;
    if runs_in(&base)?.is_empty() {
        // A file that somebody has put there keeps it.
        let _ = std::fs::remove_file(base.join(LOCK)).and_then(|()| std::fs::remove_dir(&base));
    }
    Ok(())
}

fn lock(directory: &Path, operation: FlockOperation) -> Result<File, RunDirectoryError> {
    let path = directory.join(LOCK);
    OpenOptions::new()
        .write(true)
        .create(true)
        .truncate(false)
        .mode(0o600)
        .open(&path)
        .and_then(|file| Ok(flock(&file, operation).map(|()| file)?))
        .map_err(|source| RunDirectoryError { path, source })
}

fn runs_in(base: &Path) -> Result<Vec<FoundRun>, RunDirectoryError> {
    let error = |source| RunDirectoryError { path: base.to_path_buf(), source };
    let mut runs = Vec::new();
    for entry in std::fs::read_dir(base).map_err(error)? {
        let entry = entry.map_err(error)?;
        if entry.file_type().map_err(error)?.is_dir() {
            let path = entry.path();
            runs.push(FoundRun { alive: is_alive(&path), path });
        }
    }
    runs.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(runs)
}

/// A run lives while its supervisor holds the lock, or one of its processes still runs.
fn is_alive(run: &Path) -> bool {
    let is_locked = match File::open(run.join(LOCK)) {
        Ok(file) => flock(&file, FlockOperation::NonBlockingLockShared).is_err(),
        Err(_) => false,
    };
    is_locked || RunDirectory::is_kept(run) || Board::open(run).is_ok_and(|board| board.has_living_process())
}

fn remove(run: &Path) -> io::Result<()> {
    // The directory goes last: if this is interrupted, it is found again.
    Domain::of(run).remove()?;
    match std::fs::remove_dir_all(run) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Role;
    use crate::wait::WaitPolicy;
    use crate::{Entry, Member};
    use mikoshi_ipc_types::ServiceId;
    use std::os::unix::fs::PermissionsExt;

    fn base() -> tempfile::TempDir {
        tempfile::Builder::new()
            .permissions(std::fs::Permissions::from_mode(0o700))
            .tempdir()
            .expect("a directory")
    }

    #[test]
    fn a_run_is_there_until_its_supervisor_lets_go() {
        let base = base();
        let (one, other) = (RunDirectory::create(base.path()), RunDirectory::create(base.path()));
        let (one, other) = (one.expect("a run"), other.expect("another run"));
        assert_ne!(one.id(), other.id());
        assert_eq!(std::fs::metadata(one.path()).expect("it is there").mode() & 0o777, 0o700);
        let alive: Vec<_> = RunDirectory::list(base.path()).expect("a list").into_iter().collect();
        assert!(alive.len() == 2 && alive.iter().all(|run| run.alive));
        assert_eq!(RunDirectory::clean_dead(base.path()).expect("nothing fails"), Vec::<PathBuf>::new());

        one.remove().expect("it can be removed");
        drop(other);
        assert_eq!(RunDirectory::list(base.path()).expect("a list"), []);
    }

    #[test]
    fn what_a_dead_supervisor_left_is_removed_and_nothing_else() {
        let base = base();
        let living = RunDirectory::create(base.path()).expect("a run");
        let dead = base.path().canonicalize().expect("a path").join("1-0");
        std::fs::create_dir(&dead).expect("it can be made");
        std::fs::write(dead.join("lock"), "").expect("it can be made");
        assert_eq!(RunDirectory::clean_dead(base.path()).expect("nothing fails"), [dead]);
        assert!(living.path().exists());
    }

    #[test]
    fn a_run_whose_services_live_is_not_garbage() {
        let base = base();
        let orphaned = base.path().canonicalize().expect("a path").join("1-0");
        std::fs::create_dir(&orphaned).expect("it can be made");
        Board::create(&orphaned, &[ServiceId::Bridge], false).expect("a board");
        let role = Role::Service(ServiceId::Bridge);
        let member = Member::join(&orphaned, role, WaitPolicy::default(), Entry::Vacant).expect("a place");
        assert_eq!(RunDirectory::clean_dead(base.path()).expect("nothing fails"), Vec::<PathBuf>::new());
        drop(member);
    }

    #[test]
    fn a_run_is_adopted_once_its_supervisor_is_gone_and_by_one_only() {
        let base = base();
        let run = RunDirectory::create(base.path()).expect("a run");
        let path = run.path().to_owned();
        let error = RunDirectory::adopt(&path).expect_err("it has a supervisor");
        assert!(error.to_string().contains("its supervisor lives"), "{error}");

        let orphaned = base.path().canonicalize().expect("a path").join("1-0");
        std::fs::create_dir(&orphaned).expect("it can be made");
        assert!(RunDirectory::adopt(&orphaned).is_err(), "it is no run");
        std::fs::write(orphaned.join(LOCK), "").expect("it can be made");
        let adopted = RunDirectory::adopt(&orphaned).expect("nobody has it");
        RunDirectory::adopt(&orphaned).expect_err("it has been adopted");
        drop(adopted);
        assert!(!orphaned.exists(), "it ended with its second supervisor");
    }

    #[test]
    fn a_run_that_is_kept_needs_nobody_and_makes_room_for_the_next_of_its_name() {
        let base = base();
        let kept = RunDirectory::keep(base.path(), "team").expect("a run");
        let path = kept.path().to_owned();
        kept.leave_as_it_is();
        assert_eq!(RunDirectory::clean_dead(base.path()).expect("nothing fails"), Vec::<PathBuf>::new());
        assert!(RunDirectory::is_kept(&path) && RunDirectory::list(base.path()).expect("a list")[0].alive);

        Board::create(&path, &[ServiceId::Bridge], false).expect("a board");
        let role = Role::Service(ServiceId::Bridge);
        let member = Member::join(&path, role, WaitPolicy::default(), Entry::Vacant).expect("a place");
        let error = RunDirectory::keep(base.path(), "team").expect_err("somebody takes part in it");
        assert!(error.to_string().contains("still carried out"), "{error}");
        drop(member);
        // Its process lives on: here that is the test's own.
        RunDirectory::remove_kept(&path).expect("it can be removed");
        RunDirectory::remove_kept(&path).expect("there is none");
        RunDirectory::keep(base.path(), "team").expect("a new one").leave_as_it_is();
        assert!(Board::open(&path).is_err());
    }

    #[test]
    fn a_base_that_others_may_enter_is_refused() {
        let base = base();
        std::fs::set_permissions(base.path(), std::fs::Permissions::from_mode(0o755)).expect("it is ours");
        let error = RunDirectory::create(base.path()).expect_err("it is open");
        assert!(error.to_string().contains("chmod 700"), "{error}");
    }

    #[test]
    fn a_base_that_can_not_be_made_is_an_error_that_names_it() {
        let error = RunDirectory::create(Path::new("/nonexistent/base")).expect_err("there is no such place");
        assert!(error.to_string().contains("/nonexistent/base"), "{error}");
        assert_eq!(RunDirectory::list(Path::new("/nonexistent/base")).expect("no runs"), []);
    }
}
