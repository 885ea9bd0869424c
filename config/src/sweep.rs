//! A sweep: many runs of one scenario, by seed over ranges of parameters and over grids of them.

mod comparison;
pub(crate) mod grid;
mod range;

pub use comparison::Comparison;
pub use grid::GridAxis;
pub use range::ParameterRange;

use crate::document::{Node, Value};
use crate::error::LoadConfigError;
use crate::load::{Edit, find, load_with, refuse, sibling};
use crate::{decode::decode, validate};
use grid::Grid;
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
    /// Number of runs: of every point of the grid, where there is one.
    pub runs: u64,
    /// Seed of the first run; each has the one after its predecessor's. All points of a grid have the same.
    #[serde(default)]
    pub first_seed: u64,
    /// How many of all runs must succeed for the sweep to.
    pub succeed_min: u64,
    /// What lies above the scenario in every run, as `--set` does; an empty string takes a key away.
    #[serde(default)]
    pub set: toml::Table,
    /// What every run draws by its seed.
    #[serde(default)]
    pub ranges: Vec<ParameterRange>,
    /// What takes all of its values, each with each.
    #[serde(default)]
    pub grid: Vec<GridAxis>,
    /// What the runs are compared with.
    #[serde(default)]
    pub comparison: Option<Comparison>,
}

impl Sweep {
    /// How many runs there are, of all points of the grid.
    pub fn all_runs(&self) -> u64 {
        self.runs.saturating_mul(self.points())
    }

    /// Keys whose values tell runs apart, in the order in which runs have them: those of the grid, then
    /// those that are drawn.
    pub fn parameters(&self) -> impl Iterator<Item = &str> {
        let grid = self.grid.iter().map(|axis| axis.key.as_str());
        grid.chain(self.ranges.iter().map(|range| range.key.as_str()))
    }

    fn points(&self) -> u64 {
        grid::size(&self.grid)
    }
}

/// A sweep that has been found possible at the limits of its ranges and with every value of its grid.
#[derive(Clone, Debug)]
pub struct LoadedSweep {
    /// The sweep, checked.
    pub sweep: Sweep,
    /// Its scenario's file.
    pub scenario: PathBuf,
    /// What is set, as overrides.
    set: Vec<(String, String)>,
    grid: Grid,
}

/// One run of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepRun {
    /// Its place among the runs, from 0.
    pub index: u64,
    /// Its seed.
    pub seed: u64,
    /// Its place in the grid, then what was drawn.
    pub parameters: Vec<(String, f64)>,
    /// What makes the scenario this run's, for [`load_scenario`](crate::load_scenario).
    pub overrides: Vec<(String, String)>,
}

impl LoadedSweep {
    /// The first `count` runs: all points of the grid with one seed, then with the next.
    pub fn runs(&self, count: u64) -> Vec<SweepRun> {
        (0..count).map(|index| self.run(index)).collect()
    }

    fn run(&self, index: u64) -> SweepRun {
        let points = self.sweep.points();
        let seed = self.sweep.first_seed.saturating_add(index / points);
        let point = self.grid.point(index % points);
        let draw = |range: &ParameterRange| (range.key.clone(), range.draw(seed));
        let drawn: Vec<_> = self.sweep.ranges.iter().map(draw).collect();
        let drawn_texts = drawn.iter().map(|(key, value)| (key.clone(), value.to_string()));
        let overrides = self.set.iter().cloned().chain(point.overrides).chain(drawn_texts).collect();
        let parameters = point.parameters.into_iter().chain(drawn.iter().cloned()).collect();
        SweepRun { index, seed, parameters, overrides }
    }
}

/// Loads `DIR/sweeps/NAME.toml`, and the scenario that it names from `DIR/scenarios` to check it: with what
/// the first run draws, at both ends of all ranges, and with every value of the grid.
pub fn load_sweep(path: &Path) -> Result<LoadedSweep, LoadConfigError> {
    of_document(&Node::read(path)?, path)
}

/// The same of what was read from `path`.
pub(crate) fn of_document(document: &Node, path: &Path) -> Result<LoadedSweep, LoadConfigError> {
    let sweep: Sweep = decode(document)?;
    let mut set = Vec::new();
    if let Some(node) = document.get("set") {
        leaves(node, "", &mut set);
    }
    let keys: Vec<_> = set.iter().map(|(key, _)| key.as_str()).collect();
    let followers: Vec<_> = (0..sweep.grid.len()).map(|axis| grid::followers(document, axis)).collect();
    refuse(document, validate::sweep(&sweep, &keys, &followers))?;
    let scenario = find(&sibling(path, "scenarios"), &sweep.scenario)
        .map_err(|problem| document.key_error("scenario", problem))?;

    let grid = Grid::of(document, &sweep.grid)?;
    let samples = grid.samples();
    let check = |at: &str, point: &[(String, Node)]| {
        let value_of = |range: &ParameterRange| match at {
            "min" => range.min,
            "max" => range.max,
            _ => range.draw(sweep.first_seed),
        };
        let fixed = set.iter().chain(point).map(|(key, node)| Edit::new(key, node));
        let drawn = sweep.ranges.iter().enumerate().map(|(index, range)| {
            let origin = document.locate(&format!("ranges.{index}.{at}"));
            Edit::new(&range.key, &Node { origin, value: number(value_of(range), range.whole) })
        });
        load_with(&scenario, fixed.chain(drawn).collect(), None).map(|_| ())
    };
    let first = samples.first().map_or(&[][..], Vec::as_slice);
    for at in ["key", "min", "max"] {
        check(at, first)?;
    }
    for point in samples.iter().skip(1) {
        check("key", point)?;
    }
    let set =
        set.into_iter().map(|(key, node)| Ok((key, text(&node)?))).collect::<Result<_, LoadConfigError>>()?;
    Ok(LoadedSweep { sweep, scenario, set, grid })
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
