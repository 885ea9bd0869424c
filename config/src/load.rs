//! Reading scenarios and robots: files, overrides, checks.

use crate::decode::decode;
use crate::document::Node;
use crate::document::Value;
use crate::error::{KeyError, LoadConfigError};
use crate::nearest::did_you_mean;
use crate::origin::Origin;
use crate::robot::RobotConfig;
use crate::scenario::Scenario;
use crate::validate::{self, Violation};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// What the folders of scenarios and sweeps are called, in which some of them may have a folder of their own.
const FOLDERS_OF_FILES: [&str; 2] = ["scenarios", "sweeps"];

/// A scenario with the robots that it names, and the places where every key was written.
#[derive(Clone, Debug)]
pub struct LoadedScenario {
    /// The scenario: team beneath, overrides on top, checked.
    pub scenario: Scenario,
    /// Its robots' models, by name.
    pub models: BTreeMap<String, LoadedRobot>,
    document: Node,
}

/// A robot model and its URDF.
#[derive(Clone, Debug)]
pub struct LoadedRobot {
    /// The model.
    pub config: RobotConfig,
    /// The text of its URDF.
    pub urdf: String,
    /// Where that text was read.
    pub urdf_path: PathBuf,
    document: Node,
}

impl LoadedScenario {
    /// An error about a key that only its user can judge, such as a row of C that depends on others:
    /// `problem` says what was found and what was expected.
    pub fn error_at(&self, key: &str, problem: impl Into<String>) -> LoadConfigError {
        self.document.key_error(key, problem).into()
    }
}

impl LoadedRobot {
    /// An error about a key that only its user can judge, such as a link that the URDF lacks: `problem`
    /// says what was found and what was expected.
    pub fn error_at(&self, key: &str, problem: impl Into<String>) -> LoadConfigError {
        self.document.key_error(key, problem).into()
    }
}

/// Loads `DIR/scenarios/NAME.toml`, the team that it names from `DIR/teams` beneath it, `overrides` and
/// `seed` above it, and the robots from `DIR/robots`. Of a scenario that was saved with its robots, it
/// takes those, from `NAME.robots` beside it.
///
/// An override is a key's full path and a value: TOML, or a string that needs no quotes. An empty value
/// takes the key away: `("hybrid.start_s", "")` leaves hybrid control off.
pub fn load_scenario(
    path: &Path,
    overrides: &[(String, String)],
    seed: Option<u64>,
) -> Result<LoadedScenario, LoadConfigError> {
    let edits = overrides.iter().map(|(key, value)| Edit::of_option(key, value)).collect();
    load_with(path, edits, seed)
}

/// A value to be put in place of a scenario's.
pub(crate) struct Edit {
    key: String,
    origin: Origin,
    /// None takes the key away.
    node: Option<Node>,
}

impl Edit {
    /// Puts `node` at `key`; an empty string takes the key away.
    pub fn new(key: &str, node: &Node) -> Self {
        let takes_away = matches!(&node.value, Value::String(text) if text.is_empty());
        let (origin, node) = (node.origin.clone(), Some(node.clone()).filter(|_| !takes_away));
        Self { key: key.to_owned(), origin, node }
    }

    fn of_option(key: &str, value: &str) -> Self {
        Self::new(key, &Node::from_option(&format!("--set {key}={value}"), value))
    }

    fn apply(self, document: &mut Node) -> Result<(), KeyError> {
        match self.node {
            Some(node) => document.set(&self.key, node),
            None => document.unset(&self.key, self.origin),
        }
    }
}

/// The same with overrides from anywhere.
pub(crate) fn load_with(
    path: &Path,
    edits: Vec<Edit>,
    seed: Option<u64>,
) -> Result<LoadedScenario, LoadConfigError> {
    let mut document = Node::read(path)?;
    // The team first: what lies beneath depends on it.
    let (of_team, edits): (Vec<_>, Vec<_>) = edits.into_iter().partition(|edit| edit.key == "team");
    for edit in of_team {
        edit.apply(&mut document)?;
    }
    if let Some(Value::String(team)) = document.get("team").map(|node| &node.value) {
        let team =
            find(&sibling(path, "teams"), team).map_err(|problem| document.key_error("team", problem))?;
        document = document.over(Node::read(&team)?);
    } else if document.get("team").or(document.get("robots")).is_none() {
        return Err(document.key_error("team", "found nothing, expected a team, or robots here").into());
    }
    for edit in edits {
        edit.apply(&mut document)?;
    }
    if let Some(seed) = seed {
        let value = Value::Integer(seed.into());
        document.set("seed", Node { origin: Origin::Option(format!("--seed {seed}").into()), value })?;
    }

    let mut scenario: Scenario = decode(&document)?;
    scenario.coordination_delay_ticks = scenario.coordination_delay_ticks.max(scenario.least_delay_ticks());
    let saved_robots = Some(robots_beside(path)).filter(|folder| folder.is_dir());
    let robots = saved_robots.unwrap_or_else(|| sibling(path, "robots"));
    let models = load_models(&robots, &scenario, &document)?;
    let configs: Vec<_> = scenario.robots.iter().map(|member| &models[&member.model].config).collect();
    refuse(&document, validate::scenario(&scenario, &configs))?;
    Ok(LoadedScenario { scenario, models, document })
}

/// Loads the robot `model` and its URDF from the folder `dir`.
pub fn load_robot(dir: &Path, model: &str) -> Result<LoadedRobot, LoadConfigError> {
    let path = find(dir, model).map_err(|problem| KeyError {
        origin: Origin::File(dir.into()),
        key: "model".to_owned(),
        problem,
    })?;
    let document = Node::read(&path)?;
    let mut config: RobotConfig = decode(&document)?;
    refuse(&document, validate::robot(&config, model))?;
    for (name, folder) in &mut config.packages {
        // Absolute: every process of a run finds the same meshes, wherever it was started.
        let place =
            expanded(folder).map_err(|problem| document.key_error(&format!("packages.{name}"), problem))?;
        let found = std::path::absolute(dir.join(place)).ok().filter(|found| found.is_dir());
        *folder = found.and_then(|found| found.into_os_string().into_string().ok()).ok_or_else(|| {
            let problem = format!("found {folder:?}, expected a folder beside this file");
            document.key_error(&format!("packages.{name}"), problem)
        })?;
    }
    let place = expanded(&config.urdf).map_err(|problem| document.key_error("urdf", problem))?;
    let urdf_path = dir.join(place);
    let urdf = fs::read_to_string(&urdf_path).map_err(|error| {
        let problem = format!("found {:?}, expected a file beside this one: {error}", config.urdf);
        document.key_error("urdf", problem)
    })?;
    Ok(LoadedRobot { config, urdf, urdf_path, document })
}

/// A path that may begin with an environment variable, as `${NAME}/`, or what is wrong with it.
fn expanded(path: &str) -> Result<PathBuf, String> {
    let Some((name, rest)) = path.strip_prefix("${").and_then(|rest| rest.split_once('}')) else {
        return Ok(path.into());
    };
    match std::env::var_os(name).filter(|value| !value.is_empty()) {
        Some(value) => Ok(Path::new(&value).join(rest.trim_start_matches('/'))),
        None => Err(format!("found {path:?}, expected the environment variable {name} to say where that is")),
    }
}

fn load_models(
    dir: &Path,
    scenario: &Scenario,
    document: &Node,
) -> Result<BTreeMap<String, LoadedRobot>, LoadConfigError> {
    let mut models = BTreeMap::new();
    for (index, member) in scenario.robots.iter().enumerate() {
        if !models.contains_key(&member.model) {
            find(dir, &member.model)
                .map_err(|problem| document.key_error(&format!("robots.{index}.model"), problem))?;
            models.insert(member.model.clone(), load_robot(dir, &member.model)?);
        }
    }
    Ok(models)
}

pub(crate) fn refuse(document: &Node, violations: Vec<Violation>) -> Result<(), LoadConfigError> {
    if violations.is_empty() {
        return Ok(());
    }
    let errors =
        violations.into_iter().map(|violation| document.key_error(&violation.key, violation.problem));
    Err(LoadConfigError::CheckKeys(errors.collect()))
}

/// Where the robots of a saved scenario are.
pub(crate) fn robots_beside(scenario: &Path) -> PathBuf {
    scenario.with_extension("robots")
}

/// The folder `name` beside the one that holds scenarios, or sweeps: the file's own folder, unless the one
/// above is called so.
pub(crate) fn sibling(file: &Path, name: &str) -> PathBuf {
    let above = |folder: &Path| match folder.file_name() {
        Some(_) => folder.parent().unwrap_or(Path::new("")).to_owned(),
        None => folder.join(".."),
    };
    let folder = file.parent().unwrap_or(Path::new(""));
    let outer = above(folder);
    // By its true name: from within, it may have been typed as `..`.
    let real = if outer.as_os_str().is_empty() { Path::new(".") } else { &outer };
    let is_of_files = std::fs::canonicalize(real)
        .is_ok_and(|real| real.file_name().is_some_and(|name| FOLDERS_OF_FILES.iter().any(|of| name == *of)));
    above(if is_of_files { &outer } else { folder }).join(name)
}

/// `DIR/NAME.toml`, or what is wrong with the name.
pub(crate) fn find(dir: &Path, name: &str) -> Result<PathBuf, String> {
    let known = names_in(dir);
    if known.iter().any(|known| known == name) {
        return Ok(dir.join(format!("{name}.toml")));
    }
    let hint = did_you_mean(name, &known);
    match known.as_slice() {
        [] => Err(format!(
            "found {name:?}, expected {name}.toml in {}, which holds no TOML file",
            dir.display()
        )),
        known => {
            Err(format!("found {name:?}, expected one of {} in {}{hint}", known.join(", "), dir.display()))
        }
    }
}

/// Names of the TOML files in a folder, sorted; none where there is no folder.
fn names_in(dir: &Path) -> Vec<String> {
    let files = fs::read_dir(dir).into_iter().flatten().flatten().map(|entry| entry.path());
    let tomls = files.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    let mut names: Vec<_> =
        tomls.filter_map(|path| path.file_stem().and_then(|stem| stem.to_str()).map(str::to_owned)).collect();
    names.sort();
    names
}
