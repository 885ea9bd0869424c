//! What the parts cost.
//!
//! Time is measured in one program and one run ([`rounds`]): the servo's tick on what a walking robot was told, its
//! parts, and beside them what Pinocchio and Eigen take for the same numbers. Time goes into reports; what is judged is
//! the number of instructions, which is the same today and tomorrow (`src/bin/hot-path.rs`, `tests/instructions.rs`).

#![allow(non_snake_case)] // Monogram names, as in the crates of mathematics.

pub mod beside_pinocchio;
pub mod bridge;
pub mod parts;
pub mod pinocchio;
pub mod postures;
pub mod recorder;
pub mod recording;
pub mod rounds;
pub mod services;
pub mod table;

/// Ideal robots that walk, as the tests of the gait have them.
#[path = "../../crates/humanoid/tests/team/mod.rs"]
mod team;
