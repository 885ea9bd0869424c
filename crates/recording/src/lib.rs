//! A run's log: its frames, and beside them, at a lower rate, what the field's tools show of it.
//!
//! What is beside the frames is made of them alone, in the schemas that Foxglove publishes and, where it has none,
//! in schemas that lie in the file: Foxglove, Lichtblick, PlotJuggler and Rerun need no plug-in. Nobody here reads
//! it: what a run was is in its frames.
//!
//! # Glossary
//! - **view**: what one or more topics say of a tick, as messages of a schema.
//! - **topic**: a channel of the log, by the name under which tools list it.
//!
//! # Coordinate frames
//! `world` is where all truly is. `object` and `ROBOT/LINK` are truly there. `object_measured` and `object_ref` are
//! what the coordinator thinks and wants. `ROBOT/odometry` is where the coordinator has the robot's own world;
//! `ROBOT/base_measured` and `ROBOT/HAND_ref` hang there.

#![allow(non_snake_case)]

mod balance;
mod convert;
mod events;
mod frames;
mod joints;
mod recording;
mod scene;
mod shapes;
mod team;
mod timing;
mod topic;
mod views;
mod wrenches;

pub use recording::{DEFAULT_VIEW_HZ, RecordError, Recording};
