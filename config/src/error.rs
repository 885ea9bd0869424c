//! What can be wrong with what people wrote.

use crate::origin::Origin;
use core::fmt;
use std::io;
use std::path::PathBuf;

/// A configuration could not be loaded. Its text names the place, the key, what was found there and
/// what was expected, one line per key.
#[derive(Debug, thiserror::Error)]
pub enum LoadConfigError {
    /// A file could not be read.
    #[error("{}: cannot be read: {source}", path.display())]
    ReadFile {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// A file, or the value of an option, is not TOML.
    #[error("{origin}: not valid TOML: {message}")]
    ParseToml {
        /// Where the parser stopped.
        origin: Origin,
        /// What it says.
        message: String,
    },
    /// Values that are of the wrong type, out of range, unknown or missing.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    CheckKeys(Vec<KeyError>),
}

/// One key with a value that can't be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyError {
    /// Where the value was written.
    pub origin: Origin,
    /// The key's full path: `robots.0.yaw_deg`.
    pub key: String,
    /// What was found and what was expected.
    pub problem: String,
}

impl fmt::Display for KeyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}: {}", self.origin, self.key, self.problem)
    }
}

impl From<KeyError> for LoadConfigError {
    fn from(error: KeyError) -> Self {
        Self::CheckKeys(vec![error])
    }
}
