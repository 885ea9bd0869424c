//! A survey: several sweeps that are judged together.

use crate::document::Node;
use crate::error::LoadConfigError;
use crate::load::{find, refuse};
use crate::sweep::{self, LoadedSweep, load_sweep};
use crate::{decode::decode, validate};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Several sweeps, as `config/sweeps/*.toml` names them; those of `NAME.toml` lie in the folder `NAME` beside it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Survey {
    /// Short name, for reports.
    pub name: String,
    /// What it shows, in a sentence.
    pub description: String,
    /// The sweeps' files, without `.toml`.
    pub sweeps: Vec<String>,
    /// How many of the runs of all sweeps must succeed for the survey to.
    pub succeed_min: u64,
}

/// A survey whose sweeps have all been found possible.
#[derive(Clone, Debug)]
pub struct LoadedSurvey {
    /// The survey, checked.
    pub survey: Survey,
    /// Its sweeps, in its order.
    pub sweeps: Vec<LoadedSweep>,
}

/// What a file in `config/sweeps` is.
#[derive(Clone, Debug)]
pub enum SweepFile {
    /// Many runs of one scenario.
    Sweep(Box<LoadedSweep>),
    /// Several sweeps.
    Survey(LoadedSurvey),
}

impl LoadedSurvey {
    /// How many runs there are, of all sweeps.
    pub fn all_runs(&self) -> u64 {
        all_runs(&self.sweeps)
    }
}

fn all_runs(sweeps: &[LoadedSweep]) -> u64 {
    sweeps.iter().fold(0, |sum: u64, loaded| sum.saturating_add(loaded.sweep.all_runs()))
}

/// Loads `DIR/sweeps/NAME.toml`: a survey if it names `sweeps`, else a sweep ([`load_sweep`]).
///
/// # Errors
/// What is wrong with it, or with one of its sweeps, and where.
pub fn load_sweep_file(path: &Path) -> Result<SweepFile, LoadConfigError> {
    let document = Node::read(path)?;
    if document.get("sweeps").is_none() {
        return sweep::of_document(&document, path).map(|sweep| SweepFile::Sweep(Box::new(sweep)));
    }
    let survey: Survey = decode(&document)?;
    let folder = path.with_extension("");
    let mut sweeps = Vec::with_capacity(survey.sweeps.len());
    for (index, name) in survey.sweeps.iter().enumerate() {
        let file =
            find(&folder, name).map_err(|problem| document.key_error(&format!("sweeps.{index}"), problem))?;
        sweeps.push(load_sweep(&file)?);
    }
    refuse(&document, validate::survey(&survey, all_runs(&sweeps)))?;
    Ok(SweepFile::Survey(LoadedSurvey { survey, sweeps }))
}
