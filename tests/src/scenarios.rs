//! Scenarios for tests: those of the project, shortened, or a copy of them to be spoilt.

use crate::programs::workspace;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// One of the project's scenarios.
pub fn of_project(name: &str) -> PathBuf {
    workspace().join("config/scenarios").join(name).with_extension("toml")
}

/// Overrides that make a scenario so short that a test may run it, hybrid control included.
pub const SHORT: [&str; 4] = ["--set", "duration_s=1.0", "--set", "hybrid.start_s=0.2"];

/// Overrides that let a scenario run until somebody ends it.
pub const ENDLESS: [&str; 2] = ["--set", "duration_s=3600"];

/// A copy of the project's configuration.
pub struct Copy {
    folder: TempDir,
}

impl Copy {
    /// Of all scenarios, teams and robots.
    pub fn new() -> Self {
        let copy = Self { folder: tempfile::tempdir().expect("a folder") };
        for part in ["scenarios", "sweeps", "teams", "robots"] {
            let (from, to) = (workspace().join("config").join(part), copy.path(part));
            fs::create_dir(&to).expect("a new folder");
            for entry in fs::read_dir(from).expect("it is there").flatten() {
                if entry.path().is_file() {
                    fs::copy(entry.path(), to.join(entry.file_name())).expect("it can be copied");
                }
            }
        }
        copy
    }

    /// A file of the copy.
    pub fn path(&self, path: impl AsRef<Path>) -> PathBuf {
        self.folder.path().join(path)
    }

    /// The copy's hold scenario.
    pub fn hold(&self) -> PathBuf {
        self.path("scenarios/hold.toml")
    }

    /// Puts `new` in the place of `old`, which must occur, throughout a file.
    pub fn replace(&self, path: &str, old: &str, new: &str) {
        let path = self.path(path);
        let text = fs::read_to_string(&path).expect("it is there");
        assert!(text.contains(old), "{}: no {old:?}", path.display());
        fs::write(&path, text.replace(old, new)).expect("it can be written");
    }
}

impl Default for Copy {
    fn default() -> Self {
        Self::new()
    }
}
