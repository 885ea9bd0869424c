//! Scenarios, teams and robots: schema, validation, resolution.
//!
//! This crate turns files that people write into values that services can trust. It knows no control
//! and no robot kinematics; it reads files, and nothing else of the outside.
//!
//! ```text
//! --set, --seed  ─────────── over ┐
//! config/scenarios/NAME.toml over ├──▶ Scenario ──┐
//! config/teams/TEAM.toml ─────────┘               ├──▶ RunSpec: one file that every service reads
//! config/robots/MODEL.toml, URDF ──▶ LoadedRobot ─┘
//! ```
//!
//! `config/sweeps/NAME.toml` names a scenario and what lies over it in each of many runs, or sweeps that are judged together.

mod coordination;
mod decode;
mod document;
mod error;
mod grasp;
pub mod hosts;
mod job;
mod load;
mod membership;
mod motion;
mod nearest;
mod operator;
mod origin;
pub mod robot;
pub mod run;
mod save;
pub mod scenario;
mod sharing;
mod survey;
pub mod sweep;
mod validate;
mod world;

pub use error::{KeyError, LoadConfigError};
pub use load::{LoadedRobot, LoadedScenario, load_robot, load_scenario};
pub use origin::Origin;
pub use robot::RobotConfig;
pub use run::{DecodeRunError, RobotSpec, RunSpec};
pub use save::{SaveScenarioError, ScenarioTextError, save_scenario, scenario_text};
pub use scenario::Scenario;
pub use survey::{LoadedSurvey, Survey, SweepFile, load_sweep_file};
pub use sweep::{LoadedSweep, Sweep, SweepRun, load_sweep};
