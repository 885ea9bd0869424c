//! What tests of files share.

use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// The fixture's folder.
pub fn original() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixture")
}

/// A copy of the fixture.
pub fn fixture() -> TempDir {
    let (copy, original) = (TempDir::new().unwrap(), original());
    for folder in ["scenarios", "teams", "robots"] {
        fs::create_dir(copy.path().join(folder)).unwrap();
        for entry in fs::read_dir(original.join(folder)).unwrap() {
            let name = Path::new(folder).join(entry.unwrap().file_name());
            fs::copy(original.join(&name), copy.path().join(&name)).unwrap();
        }
    }
    copy
}
