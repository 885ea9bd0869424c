//! The physical world: MuJoCo behind Mikoshi's frames.
//!
//! This crate knows physics, drives, sensors and contacts. It knows no control: what robots do is in
//! their joint commands. With those who compute them it shares the robots' descriptions, and what a zero
//! moment point and a support polygon are.
//!
//! # Glossary
//! - **tick**: one period of control; **step**: one period of physics, several a tick.
//! - **truth**: what the simulator knows, for observers; **readings**: what sensors say, for services.
//! - **hands** are grasping hands, in the order of [`RobotSpec::grasping_hands`]; index i of a frame's
//!   hands is the i-th of them.
//!
//! [`RobotSpec::grasping_hands`]: mikoshi_config::RobotSpec::grasping_hands

#![allow(non_snake_case)] // Monogram names, as in the crates of mathematics.

mod failures;
mod grasp;
mod grip;
mod layout;
mod logging;
mod mjcf;
mod object_body;
mod pose;
mod pushes;
mod readings;
mod robot;
mod tally;
mod truth;
mod world;

pub use mjcf::{MAX_PICTURE_HEIGHT, MAX_PICTURE_WIDTH, OBJECT, qualified};
pub use world::{World, world_xml};

use mikoshi_physics::BuildWorldError;

const ENGINE: &str = "MuJoCo";

/// The simulator's own objection.
fn rejects(what: impl ToString) -> BuildWorldError {
    BuildWorldError::Simulator { engine: ENGINE, what: what.to_string() }
}
