//! Where a value comes from, so that an error can say so.

use core::fmt;
use std::path::Path;
use std::sync::Arc;

/// The place that a value was read from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A line of a file, counted from 1.
    Line(Arc<Path>, usize),
    /// A file that does not mention the value.
    File(Arc<Path>),
    /// The command line, as typed: `--set object.mass_kg=4`.
    Option(Arc<str>),
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(path, line) => write!(f, "{}:{line}", path.display()),
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Option(typed) => f.write_str(typed),
        }
    }
}
