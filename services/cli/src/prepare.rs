//! From what was typed to a run that can be carried out.

use crate::arguments::ScenarioArguments;
use crate::failure::Failure;
use mikoshi_config::{LoadedScenario, RunSpec, load_scenario};
use mikoshi_cooperation::{HybridLaw, TeamArms};
use mikoshi_coordinator::{BuildCoordinatorError, build_hybrid_law, team_arms};
use mikoshi_resolution::{resolve, tick_schedule};
use mikoshi_runtime::TickSchedule;
use std::path::PathBuf;

/// A run, and what its services will build from it.
pub struct Prepared {
    /// The run.
    pub run: RunSpec,
    /// Its arms in hand order.
    pub arms: TeamArms,
    /// Its hybrid law.
    pub law: HybridLaw,
    /// Its schedule.
    pub schedule: TickSchedule,
    /// Whether its services are to compute nothing.
    pub is_empty: bool,
    /// What is the bridge in place of the simulator.
    pub bridge: Option<PathBuf>,
}

/// Reads, checks and resolves a scenario.
///
/// # Errors
/// Whatever is wrong with it: [`Status::Usage`](crate::failure::Status::Usage).
pub fn prepare(arguments: &ScenarioArguments) -> Result<Prepared, Failure> {
    prepare_paced(arguments, false)
}

/// The same, paced by the clock if so wished, whatever the scenario says.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_paced(arguments: &ScenarioArguments, by_the_clock: bool) -> Result<Prepared, Failure> {
    let mut overrides = arguments.overrides.clone();
    overrides.extend(by_the_clock.then(|| ("clock".to_owned(), "wall".to_owned())));
    let loaded = load_scenario(&arguments.scenario, &overrides, arguments.seed).map_err(Failure::usage)?;
    let run = resolve(&loaded).map_err(Failure::usage)?;
    assemble(run, |error| place(&loaded, error))
}

/// The same of a run that is known already.
///
/// # Errors
/// It is of another build: [`Status::Usage`](crate::failure::Status::Usage).
pub fn prepare_resolved(run: RunSpec) -> Result<Prepared, Failure> {
    assemble(run, Failure::usage)
}

/// `tell` says what is wrong with the law.
fn assemble(run: RunSpec, tell: impl FnOnce(BuildCoordinatorError) -> Failure) -> Result<Prepared, Failure> {
    let arms = team_arms(&run).map_err(Failure::usage)?;
    let law = build_hybrid_law(&run).map_err(tell)?;
    let schedule = tick_schedule(&run).map_err(Failure::usage)?;
    Ok(Prepared { run, arms, law, schedule, is_empty: false, bridge: None })
}

/// Says where what the law objects to was written.
fn place(loaded: &LoadedScenario, error: BuildCoordinatorError) -> Failure {
    match &error {
        BuildCoordinatorError::InternalForces(problem) => {
            Failure::usage(loaded.error_at("hybrid.internal_forces", problem.to_string()))
        }
        BuildCoordinatorError::UnknownRow { found, expected } => {
            let axes = &loaded.scenario.hybrid.axes;
            let index = axes.iter().position(|axis| axis.row == *found).unwrap_or_default();
            let problem = format!("found {found:?}, expected one of {expected}");
            Failure::usage(loaded.error_at(&format!("hybrid.axes.{index}.row"), problem))
        }
        _ => Failure::usage(error),
    }
}
