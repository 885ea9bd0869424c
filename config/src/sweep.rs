//! A sweep: many runs of one scenario, by seed over ranges of parameters.

use crate::document::{Node, Value};
use crate::error::LoadConfigError;
use crate::load::{Edit, find, load_with, refuse, sibling};
use crate::{decode::decode, validate};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Many runs of one scenario, as `config/sweeps/*.toml` describe them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Short name, for reports.
    pub name: String,
    /// What it shows, in a sentence.
    pub description: String,
    /// The scenario's file in `config/scenarios`, without `.toml`.
    pub scenario: String,
    /// Number of runs.
    pub runs: u64,
    /// Seed of the first run; each has the one after its predecessor's.
    #[serde(default)]
    pub first_seed: u64,
    /// How many runs must succeed for the sweep to.
    pub succeed_min: u64,
    /// What lies above the scenario in every run, as `--set` does; an empty string takes a key away.
    #[serde(default)]
    pub set: toml::Table,
    /// What every run draws by its seed.
    #[serde(default)]
    pub ranges: Vec<ParameterRange>,
}

/// A key of the scenario whose value is drawn, evenly between two limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterRange {
    /// The key's full path.
    pub key: String,
    /// The least value.
    pub min: f64,
    /// The largest value.
    pub max: f64,
    /// Whether only whole numbers are drawn, both limits among them.
    #[serde(default)]
    pub whole: bool,
}

impl ParameterRange {
    /// The value of the run with this seed. It depends on seed and key only: other ranges may come and go.
    pub fn draw(&self, seed: u64) -> f64 {
        let hash = blake3::hash(format!("{seed} {}", self.key).as_bytes());
        let bits = hash.as_bytes()[..8].iter().fold(0_u64, |bits, byte| bits << 8 | u64::from(*byte));
        // The 53 bits that an f64 in [0, 1) has room for.
        let share = (bits >> 11) as f64 * (1.0 / (1_u64 << 53) as f64);
        match self.whole {
            true => (self.min + (share * (self.max - self.min + 1.0)).floor()).min(self.max),
            false => (self.min + share * (self.max - self.min)).min(self.max),
        }
    }
}

/// A sweep whose every run has been found possible at the limits of its ranges.
#[derive(Clone, Debug)]
pub struct LoadedSweep {
    /// The sweep, checked.
    pub sweep: Sweep,
    /// Its scenario's file.
    pub scenario: PathBuf,
    /// What is set, as overrides.
    set: Vec<(String, String)>,
}

/// One run of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepRun {
    /// Its place among the runs, from 0.
    pub index: u64,
    /// Its seed.
    pub seed: u64,
    /// What was drawn, in the order of the ranges.
    pub parameters: Vec<(String, f64)>,
    /// What makes the scenario this run's, fixed and drawn, for [`load_scenario`](crate::load_scenario).
    pub overrides: Vec<(String, String)>,
}

impl LoadedSweep {
    /// The first `count` runs.
    pub fn runs(&self, count: u64) -> Vec<SweepRun> {
        (0..count).map(|index| self.run(index)).collect()
    }

    fn run(&self, index: u64) -> SweepRun {
        let seed = self.sweep.first_seed.saturating_add(index);
        let draw = |range: &ParameterRange| (range.key.clone(), range.draw(seed));
        let parameters: Vec<_> = self.sweep.ranges.iter().map(draw).collect();
        let drawn = parameters.iter().map(|(key, value)| (key.clone(), value.to_string()));
        let overrides = self.set.iter().cloned().chain(drawn).collect();
        SweepRun { index, seed, parameters, overrides }
    }
}

/// Loads `DIR/sweeps/NAME.toml`, and the scenario that it names from `DIR/scenarios` to check it: with what
/// the first run draws, and at both ends of all ranges.
pub fn load_sweep(path: &Path) -> Result<LoadedSweep, LoadConfigError> {
    let document = Node::read(path)?;
    let sweep: Sweep = decode(&document)?;
    let mut set = Vec::new();
    if let Some(node) = document.get("set") {
        leaves(node, "", &mut set);
    }
    let keys: Vec<_> = set.iter().map(|(key, _)| key.as_str()).collect();
    refuse(&document, validate::sweep(&sweep, &keys))?;
    let scenario = find(&sibling(path, "scenarios"), &sweep.scenario)
        .map_err(|problem| document.key_error("scenario", problem))?;

    for at in ["key", "min", "max"] {
        let value_of = |range: &ParameterRange| match at {
            "min" => range.min,
            "max" => range.max,
            _ => range.draw(sweep.first_seed),
        };
        let fixed = set.iter().map(|(key, node)| Edit::new(key, node));
        let drawn = sweep.ranges.iter().enumerate().map(|(index, range)| {
            let origin = document.locate(&format!("ranges.{index}.{at}"));
            Edit::new(&range.key, &Node { origin, value: number(value_of(range), range.whole) })
        });
        load_with(&scenario, fixed.chain(drawn).collect(), None)?;
    }
    let set =
        set.into_iter().map(|(key, node)| Ok((key, text(&node)?))).collect::<Result<_, LoadConfigError>>()?;
    Ok(LoadedSweep { sweep, scenario, set })
}

fn number(value: f64, whole: bool) -> Value {
    if whole { Value::Integer(value as i128) } else { Value::Float(value) }
}

/// Everything below a table that is none, by its full path.
fn leaves(node: &Node, path: &str, found: &mut Vec<(String, Node)>) {
    match &node.value {
        Value::Table(table) => {
            for (key, node) in table {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                leaves(node, &path, found);
            }
        }
        _ => found.push((path.to_owned(), node.clone())),
    }
}

/// A value as `--set` takes it.
fn text(node: &Node) -> Result<String, LoadConfigError> {
    Ok(match &node.value {
        Value::String(text) if text.is_empty() => String::new(),
        _ => decode::<toml::Value>(node)?.to_string(),
    })
}
