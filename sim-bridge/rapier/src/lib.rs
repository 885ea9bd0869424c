//! The physical world a second time: Rapier in the place of MuJoCo, behind the same frames.
//!
//! No controller has seen it: gains, gait and estimators were made with the other engine. What a team does here says
//! what they owe to one simulator, and what to physics.
//!
//! # What is modelled otherwise
//! | | MuJoCo | here |
//! |---|---|---|
//! | robots | generalized coordinates, implicit drives | the same: `Multibody` with springs and damping of its degrees of freedom |
//! | a drive at its torque limit | its force is cut off | it is a torque instead of a spring for that step |
//! | contact | soft, elliptic cone, solved by Newton's method | soft, cone by contact point, solved by sweeps |
//! | a weld | a soft constraint | a [`Spring`](mikoshi_physics::Spring) as stiff as it |
//! | force sensors | of the solver | by Newton's law, from how the carried part moves and what touches it |
//!
//! Not here: meshes, grasps that fail, checkpoints (no successor can go on in this world).

#![allow(non_snake_case)] // Monogram names, as in the crates of mathematics.

mod articulation;
mod contacts;
mod convert;
mod hand;
mod world;

pub use world::World;
