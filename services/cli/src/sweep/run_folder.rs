//! Where one run of a sweep leaves its results, and whether they are there.

use super::result::{Figures, Row};
use crate::failure::Failure;
use crate::output_directory::OutputDirectory;
use mikoshi_config::scenario::Thresholds;
use mikoshi_config::{LoadedScenario, Scenario, SweepRun, load_scenario};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The folder of one run.
pub struct RunFolder {
    /// What people call the run.
    pub label: String,
    scenario_file: PathBuf,
    seed: u64,
    overrides: Vec<(String, String)>,
    /// The scenario with all that this run lays over it.
    scenario: LoadedScenario,
    path: PathBuf,
    keeps_log: bool,
}

impl RunFolder {
    /// The folder of `run` among the results of its sweep in `out`.
    ///
    /// # Errors
    /// The scenario can't be loaded with what was drawn.
    pub fn of(run: &SweepRun, scenario_file: &Path, out: &Path, keeps_log: bool) -> Result<Self, Failure> {
        let label = format!("run {} (seed {})", run.index, run.seed);
        let scenario = load_scenario(scenario_file, &run.overrides, Some(run.seed))
            .map_err(|error| Failure::usage(error).context(&label))?;
        Ok(Self {
            label,
            scenario_file: scenario_file.to_owned(),
            seed: run.seed,
            overrides: run.overrides.clone(),
            scenario,
            path: out.join("runs").join(format!("{:03}", run.index)),
            keeps_log,
        })
    }

    /// `program` with the arguments that make it carry out this run.
    pub fn command(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        command.arg("run").arg(&self.scenario_file).args(["--in-process", "--quiet", "--force", "--out"]);
        command.arg(&self.path).args(["--seed", &self.seed.to_string()]);
        for (key, value) in &self.overrides {
            command.arg("--set").arg(format!("{key}={value}"));
        }
        command
    }

    /// The scenario with all that lies over it.
    pub fn loaded(&self) -> &LoadedScenario {
        &self.scenario
    }

    /// By what the run is judged.
    pub fn thresholds(&self) -> &Thresholds {
        &self.scenario.scenario.thresholds
    }

    /// Where the run says what is wrong.
    pub fn errors(&self) -> PathBuf {
        self.path.with_extension("log")
    }

    /// Makes the folder in which all runs have theirs.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn make_parent(&self) -> Result<(), Failure> {
        let parent = self.path.parent().unwrap_or(Path::new(""));
        fs::create_dir_all(parent).map_err(|error| Failure::fault(error).context(parent.display()))
    }

    /// Whether this very run, with the same parameters, has been carried out, here or in an earlier sweep.
    pub fn is_finished(&self) -> bool {
        let Ok(summary) = self.summary() else { return false };
        let ended = summary["ticks"] == self.scenario.scenario.ticks() || !faults(&summary).is_empty();
        ended
            && load_scenario(&self.path.join("scenario.toml"), &[], None)
                .is_ok_and(|saved| self.is_same(&saved))
    }

    /// Whether a saved scenario is this run's: it has its team in itself, and names URDFs as their robots.
    fn is_same(&self, saved: &LoadedScenario) -> bool {
        let ours = &self.scenario;
        let models_are_same = ours.models.iter().all(|(name, ours)| {
            saved.models.get(name).is_some_and(|saved| {
                let mut config = saved.config.clone();
                config.urdf.clone_from(&ours.config.urdf);
                saved.urdf == ours.urdf && config == ours.config
            })
        });
        models_are_same && saved.scenario == Scenario { team: None, ..ours.scenario.clone() }
    }

    /// Takes away what nobody needs of a finished run.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn tidy(&self) -> Result<(), Failure> {
        let log = self.path.join("run.mcap");
        let said_nothing = fs::metadata(self.errors()).is_ok_and(|errors| errors.len() == 0);
        for path in [Some(log).filter(|_| !self.keeps_log), Some(self.errors()).filter(|_| said_nothing)] {
            match path.as_ref().map(fs::remove_file) {
                Some(Err(error)) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(Failure::fault(error).context(&self.label));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Takes away what a run that was ended has left.
    pub fn discard(&self) {
        let _ = fs::remove_file(self.errors());
        // What can't be removed is found by the next sweep, which says so.
        if let Ok(folder) = OutputDirectory::open(&self.path, true) {
            folder.discard();
        }
    }

    /// What a finished run came to.
    ///
    /// # Errors
    /// Its summary can't be read.
    pub fn row(&self, run: &SweepRun) -> Result<Row, Failure> {
        let summary = self.summary().map_err(|failure| failure.context(&self.label))?;
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let mut failures: Vec<_> = summary["failures"].as_array().into_iter().flatten().map(text).collect();
        failures.extend(faults(&summary).iter().map(|fault| {
            format!(
                "fault of the {} in tick {}: {}",
                text(&fault["service"]),
                fault["tick"],
                text(&fault["code"])
            )
        }));
        Ok(Row {
            run: run.index,
            seed: run.seed,
            parameters: run.parameters.iter().cloned().collect(),
            passed: summary["passed"] == true,
            failures,
            figures: Figures::of(&summary),
        })
    }

    /// The summary of a finished run.
    ///
    /// # Errors
    /// It can't be read.
    pub fn summary(&self) -> Result<Value, Failure> {
        let path = self.path.join("summary.json");
        let text = fs::read(&path).map_err(|error| Failure::fault(error).context(path.display()))?;
        serde_json::from_slice(&text).map_err(|error| Failure::fault(error).context(path.display()))
    }
}

fn faults(summary: &Value) -> &[Value] {
    summary["faults"].as_array().map_or(&[], Vec::as_slice)
}
