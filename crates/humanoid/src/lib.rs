//! One humanoid robot: model, kinematics, whole-body inverse kinematics, estimation, balance.
//!
//! This crate knows no other robot, no team, no clock, no transport and no simulator. It reads no
//! files, except that loading a model looks whether a mesh that it names exists.
//!
//! # Notation
//! Monogram names as in `mikoshi-spatial`. Joint vectors are in the order of [`Model::joints`].
//! Generalized velocities stack the base's linear velocity, its angular velocity (both of the root
//! link's origin, in world axes) and the joint velocities.

#![allow(non_snake_case)]

pub mod balance;
pub mod estimate;
pub mod gait;
pub mod ik;
pub mod kinematics;
pub mod model;
pub mod statics;

pub use ik::{IkConfig, IkGains, IkReport, IkScratch, IkState, IkTargets, WholeBodyIk};
pub use kinematics::Kinematics;
pub use model::{FrameId, Model};
