//! From a loaded scenario to a run.
//!
//! This is where files meet robots: carry postures and grasps become a posture and a base pose for
//! every robot, or an error that says which grasp is out of reach. It knows no control of a tick and no
//! simulator, and opens no transport; tests of services use it as the command does.

#![allow(non_snake_case)]

mod check;
mod hosts;
mod motion;
mod robot;
mod run_file;
mod schedule;
mod surface;

pub use check::{CheckedRobot, check_robot};
pub use hosts::{Crossing, crossings, services_on_board};
pub use run_file::{RunFileError, read_run, read_spec, world_file, write_run, write_spec, write_world};
pub use schedule::{placement_of, tick_schedule};

use mikoshi_config::{LoadConfigError, LoadedScenario, RunSpec};
use robot::{Models, resolve_robot};

/// The run of a scenario: every robot stands at tick 0, and holds, or where there is a job is about to.
///
/// # Errors
/// A URDF or a robot's configuration can't be used, or a grasp is out of reach: with file and line.
pub fn resolve(loaded: &LoadedScenario) -> Result<RunSpec, LoadConfigError> {
    let scenario = &loaded.scenario;
    let models = Models::load(loaded)?;
    let robots = scenario
        .robots
        .iter()
        .enumerate()
        .map(|(index, member)| resolve_robot(loaded, &models, index, member))
        .collect::<Result<_, _>>()?;
    let motion =
        scenario.motion.as_ref().map_or_else(Vec::new, |motion| motion::segments(motion, scenario.seed));
    Ok(RunSpec { ticks: scenario.ticks(), scenario: scenario.clone(), robots, motion })
}
