//! A sweep with a place for its results.

use super::comparison::compare;
use super::page;
use super::result::SweepResult;
use super::run_folder::RunFolder;
use crate::failure::Failure;
use mikoshi_config::scenario::Thresholds;
use mikoshi_config::{LoadedSweep, SweepRun};
use mikoshi_report::write_sweep;
use std::fs;
use std::path::{Path, PathBuf};

/// What is to be run, and where.
pub struct PlannedSweep<'a> {
    loaded: &'a LoadedSweep,
    runs: Vec<SweepRun>,
    folders: Vec<RunFolder>,
    out: PathBuf,
}

impl<'a> PlannedSweep<'a> {
    /// The first `count` runs of a sweep, with results in `out`.
    ///
    /// # Errors
    /// A scenario can't be loaded with what was drawn.
    pub fn of(loaded: &'a LoadedSweep, count: u64, out: &Path, keeps_logs: bool) -> Result<Self, Failure> {
        let runs = loaded.runs(count);
        let folders = runs
            .iter()
            .map(|run| RunFolder::of(run, &loaded.scenario, out, keeps_logs))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self { loaded, runs, folders, out: out.to_owned() })
    }

    /// Where each run leaves its results.
    pub fn folders(&self) -> &[RunFolder] {
        &self.folders
    }

    /// By what runs are judged; `None` without any.
    pub fn thresholds(&self) -> Option<&Thresholds> {
        self.folders.first().map(RunFolder::thresholds)
    }

    /// When all have run: what they came to, which is written down, too.
    ///
    /// # Errors
    /// A summary that can't be read, a file that can't be written.
    pub fn conclude(&self) -> Result<SweepResult, Failure> {
        let sweep = &self.loaded.sweep;
        let rows = self.runs.iter().zip(&self.folders).map(|(run, folder)| folder.row(run));
        let rows = rows.collect::<Result<_, _>>()?;
        let comparison =
            sweep.comparison.as_ref().map(|comparison| compare(comparison, &self.folders)).transpose()?;
        let result = SweepResult::of(sweep, rows, comparison);
        write(&self.out.join("sweep.json"), &json(&result)?)?;
        if let Some(limits) = self.thresholds() {
            write_sweep(&page::report(sweep, &result, limits), &self.out).map_err(Failure::fault)?;
        }
        Ok(result)
    }
}

/// A result as its file has it.
///
/// # Errors
/// It can't be JSON.
pub fn json(result: &impl serde::Serialize) -> Result<String, Failure> {
    Ok(serde_json::to_string_pretty(result).map_err(Failure::fault)? + "\n")
}

/// Writes a file.
///
/// # Errors
/// The operating system refuses.
pub fn write(path: &Path, text: &str) -> Result<(), Failure> {
    fs::write(path, text).map_err(|error| Failure::fault(error).context(path.display()))
}
