//! The programs under test, built as they are now.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// The `mikoshi` command, with all services beside it.
pub fn mikoshi() -> Command {
    Command::new(folder().join("mikoshi"))
}

/// Where the programs are. They are built once per test program, by the profile of the tests, so that no
/// test runs what was built from yesterday's text.
pub fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        // target/PROFILE/deps/TEST
        let test = env::current_exe().expect("a test knows where it is");
        let folder = test.parent().and_then(Path::parent).expect("tests lie two folders deep").to_owned();
        build(&folder);
        folder
    })
}

fn build(folder: &Path) {
    // Outside of cargo a test takes what is there.
    let Some(cargo) = env::var_os("CARGO") else { return };
    let profile = match folder.file_name().and_then(|name| name.to_str()) {
        Some("debug") | None => "dev",
        Some(profile) => profile,
    };
    let target = folder.parent().expect("a profile's folder lies in the target folder");
    // The whole workspace, as `make build` does it: then nothing is compiled twice.
    let built = Command::new(cargo)
        .args([
            "build",
            "--workspace",
            "--bins",
            "--examples",
            "--quiet",
            "--profile",
            profile,
            "--target-dir",
        ])
        .arg(target)
        .current_dir(workspace())
        .status()
        .expect("cargo runs");
    assert!(built.success(), "the programs under test can't be built");
}

/// Where Talos' description lies: by the environment, or where `scripts/setup-talos` puts it. Nothing is fetched by a test.
pub fn described_robots() -> Option<PathBuf> {
    let fetched =
        || Some(folder().parent()?.join("example-robot-data/cmeel.prefix/share/example-robot-data/robots"));
    let robots = env::var_os("EXAMPLE_ROBOT_DATA").map(PathBuf::from).or_else(fetched)?;
    robots.join("talos_data/robots/talos_reduced_box.urdf").exists().then_some(robots)
}

/// The root of the sources.
pub fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("this package lies in the workspace")
}
