//! The iceoryx2 domain of one run: a root path and a prefix that no other run has, so that runs which
//! happen side by side can't meet, and what one leaves behind can be told from what another needs.

use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, Path as IceoryxPath, SemanticString};
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

/// Where POSIX shared memory lives on Linux; iceoryx2 has no other place.
const SHARED_MEMORY: &str = "/dev/shm";
const PREFIX: &str = "mikoshi_";

/// Why a domain can't be used.
#[derive(Debug, thiserror::Error)]
pub enum DomainError {
    /// There is no shared memory.
    #[error("no shared memory in {SHARED_MEMORY}: {0} (is a tmpfs mounted there?)")]
    NoSharedMemory(io::Error),
    /// There is too little of it.
    #[error(
        "shared memory is full: the run needs {} MiB in {SHARED_MEMORY}, {} MiB are free \
         (`mikoshi doctor` shows what lies there)",
        required_bytes.div_ceil(1 << 20),
        free_bytes >> 20
    )]
    NoSpace {
        /// What the run needs.
        required_bytes: u64,
        /// What there is.
        free_bytes: u64,
    },
    /// The run's path is too long or holds what iceoryx2 can't take.
    #[error("{}: not a usable path for iceoryx2", .0.display())]
    UnusablePath(PathBuf),
}

/// The domain of one run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Domain {
    root: PathBuf,
    prefix: String,
}

impl Domain {
    /// The domain of the run in this directory.
    pub fn of(run: &Path) -> Self {
        Self { root: run.join("iox"), prefix: format!("{PREFIX}{:016x}_", fnv1a(run.as_os_str().as_bytes())) }
    }

    /// Fails unless shared memory has room for this much: it is touched when a run starts, and where
    /// there is none left the touch would kill the process.
    ///
    /// # Errors
    /// [`DomainError::NoSharedMemory`], [`DomainError::NoSpace`].
    pub fn check_space(required_bytes: u64) -> Result<(), DomainError> {
        let status =
            rustix::fs::statvfs(SHARED_MEMORY).map_err(|errno| DomainError::NoSharedMemory(errno.into()))?;
        let free_bytes = status.f_bavail.saturating_mul(status.f_frsize);
        if free_bytes < required_bytes {
            return Err(DomainError::NoSpace { required_bytes, free_bytes });
        }
        Ok(())
    }

    /// iceoryx2's configuration.
    ///
    /// # Errors
    /// [`DomainError::UnusablePath`].
    pub fn config(&self) -> Result<Config, DomainError> {
        let unusable = || DomainError::UnusablePath(self.root.clone());
        let root = IceoryxPath::new(self.root.as_os_str().as_bytes()).map_err(|_| unusable())?;
        let mut config = Config::default();
        config.global.set_root_path(&root);
        config.global.prefix = FileName::new(self.prefix.as_bytes()).map_err(|_| unusable())?;
        // All processes of a run start at once and on few cores.
        config.global.creation_timeout = core::time::Duration::from_secs(10);
        // The run's supervisor removes the whole domain; services that search it for dead nodes while
        // others start or end would only be in each other's way.
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.service.cleanup_dead_nodes_on_open = false;
        Ok(config)
    }

    /// Its files in shared memory. Those in the run's directory go with that.
    ///
    /// # Errors
    /// Shared memory can't be read.
    pub fn shared_memory_files(&self) -> io::Result<Vec<PathBuf>> {
        files_with(&self.prefix)
    }

    /// Takes its files in shared memory away from other users: iceoryx2 lets everybody write to one of them, a
    /// counter of processes.
    ///
    /// # Errors
    /// Shared memory can't be read.
    pub fn close_to_others(&self) -> io::Result<()> {
        for file in self.shared_memory_files()? {
            match std::fs::metadata(&file).map(|metadata| metadata.mode() & 0o077) {
                Ok(0) => {}
                // One that is gone by now needs no closing.
                _ => drop(std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o600))),
            }
        }
        Ok(())
    }

    /// Removes its files in shared memory.
    ///
    /// # Errors
    /// Shared memory can't be read, or a file can't be removed.
    pub fn remove(&self) -> io::Result<()> {
        for file in self.shared_memory_files()? {
            match std::fs::remove_file(file) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        Ok(())
    }

    /// Files of ours in shared memory that belong to none of these runs: their directory was removed by
    /// hand, or lies elsewhere. Nothing removes them unasked.
    ///
    /// # Errors
    /// Shared memory can't be read.
    pub fn orphans(runs: &[PathBuf]) -> io::Result<Vec<PathBuf>> {
        let known: Vec<_> = runs.iter().map(|run| Self::of(run).prefix).collect();
        let mut files = files_with(PREFIX)?;
        files.retain(|file| {
            let name = file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            !known.iter().any(|prefix| name.starts_with(prefix))
        });
        Ok(files)
    }
}

/// Files of this user in shared memory whose names start so.
fn files_with(prefix: &str) -> io::Result<Vec<PathBuf>> {
    let uid = rustix::process::getuid().as_raw();
    let mut files = Vec::new();
    for entry in std::fs::read_dir(SHARED_MEMORY)? {
        let entry = entry?;
        if entry.file_name().as_bytes().starts_with(prefix.as_bytes())
            && entry.metadata().is_ok_and(|metadata| metadata.is_file() && metadata.uid() == uid)
        {
            files.push(entry.path());
        }
    }
    files.sort();
    Ok(files)
}

fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_runs_have_different_prefixes() {
        let (one, other) = (Domain::of(Path::new("/a/1-0")), Domain::of(Path::new("/b/1-0")));
        assert_ne!(one.prefix, other.prefix);
        assert!(one.config().is_ok());
    }

    #[test]
    fn a_run_that_needs_more_than_there_is_does_not_start() {
        let error = Domain::check_space(u64::MAX).expect_err("nobody has as much");
        assert!(error.to_string().contains("shared memory is full"), "{error}");
        Domain::check_space(1).expect("there is a byte");
    }

    #[test]
    fn a_path_that_is_too_long_is_rejected() {
        let run = PathBuf::from(format!("/{}", "long/".repeat(200)));
        assert!(matches!(Domain::of(&run).config(), Err(DomainError::UnusablePath(_))));
    }

    #[test]
    fn other_users_have_no_part_in_a_domain() {
        let domain = Domain::of(Path::new("/test/closed"));
        let file = format!("{SHARED_MEMORY}/{}1.data", domain.prefix);
        std::fs::write(&file, "x").expect("it is writable");
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o666)).expect("it is ours");
        domain.close_to_others().expect("it is readable");
        assert_eq!(std::fs::metadata(&file).expect("it is there").mode() & 0o777, 0o600);
        domain.remove().expect("it can be removed");
    }

    #[test]
    fn files_of_a_domain_are_found_by_its_prefix_and_removed_alone() {
        let (one, other) = (Domain::of(Path::new("/test/one")), Domain::of(Path::new("/test/other")));
        for domain in [&one, &other] {
            std::fs::write(format!("{SHARED_MEMORY}/{}1.data", domain.prefix), "x").expect("it is writable");
        }
        assert!(Domain::orphans(&[]).expect("it is readable").len() >= 2);
        one.remove().expect("it can be removed");
        assert_eq!(one.shared_memory_files().expect("it is readable"), Vec::<PathBuf>::new());
        assert_eq!(other.shared_memory_files().expect("it is readable").len(), 1);
        other.remove().expect("it can be removed");
    }
}
