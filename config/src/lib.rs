//! Scenarios, teams and robots: schema, validation, resolution.
//!
//! This crate turns files that people write into values that services can trust. It knows no control
//! and no robot kinematics; it reads files, and nothing else of the outside.

pub mod robot;
pub mod run;
pub mod scenario;

pub use robot::RobotConfig;
pub use run::{RobotSpec, RunSpec};
pub use scenario::Scenario;
