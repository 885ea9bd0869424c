//! Writing a scenario so that it can be run again, wherever it lies.

use crate::load::robots_beside;
use crate::run::RunSpec;
use crate::scenario::Scenario;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A scenario that TOML has no words for.
pub type ScenarioTextError = toml::ser::Error;

/// A scenario could not be saved.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum SaveScenarioError {
    #[error("{}: cannot be written: {source}", path.display())]
    WriteFile { path: PathBuf, source: io::Error },
    #[error("a scenario that TOML has no words for: {0}")]
    Encode(#[from] ScenarioTextError),
}

/// A run's scenario as a file, with its team and all overrides in it.
///
/// # Errors
/// TOML has no words for it.
pub fn scenario_text(run: &RunSpec) -> Result<String, ScenarioTextError> {
    toml::to_string(&Scenario { team: None, ..run.scenario.clone() })
}

/// Writes a run's scenario to `path`, with its team and all overrides in it, and its robots into the
/// folder `NAME.robots` beside it: [`load_scenario`](crate::load_scenario) finds it whole. Meshes stay
/// where they are, and are named by absolute paths.
pub fn save_scenario(run: &RunSpec, path: &Path) -> Result<(), SaveScenarioError> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| SaveScenarioError::WriteFile { path, source }
    };
    let write = |path: &Path, text: &str| fs::write(path, text).map_err(failed(path));

    write(path, &scenario_text(run)?)?;
    let folder = robots_beside(path);
    fs::create_dir_all(&folder).map_err(failed(&folder))?;
    for robot in &run.robots {
        let (model, mut config) = (&robot.member.model, robot.config.clone());
        config.urdf = format!("{model}.urdf");
        write(&folder.join(&config.urdf), &robot.urdf)?;
        write(&folder.join(format!("{model}.toml")), &toml::to_string(&config)?)?;
    }
    Ok(())
}
