//! What a bridge does, whatever its world: it moves frames, goes on where commands don't come, pushes whom somebody
//! wants pushed, adds noise to what sensors read, and says who has fallen.
//!
//! A world implements [`Physics`]; [`BridgeParticipant`] makes a service of it. This crate knows no simulator and no
//! control.

#![allow(non_snake_case)] // Monogram names, as in the crates of mathematics.

mod coast;
mod drive;
mod error;
mod fallback;
mod grasp;
mod ground;
mod hold;
mod noise;
mod object_body;
mod participant;
mod physics;
mod plan;
mod push;
mod random;
mod truth;

pub use drive::{check_commands, drive_reference, steps_in_a_tick};
pub use error::{BuildWorldError, LoadWorldError, StepWorldError};
pub use grasp::{Spring, grasp_offsets};
pub use ground::{Slab, slabs};
pub use hold::{Grip, close_and_open, is_in_reach};
pub use noise::{Noise, SensorCounts};
pub use object_body::ObjectBody;
pub use participant::{BridgeParticipant, BuildBridgeError};
pub use physics::Physics;
pub use push::{ActivePush, PushScript, are_active, begin, force_n};
pub use truth::{Stance, Standing};

/// Standard gravity as simulated worlds have it.
pub const GRAVITY_M_S2: f64 = 9.81;

/// How long a world comes to rest before tick 0: drives give way under the weight, soles sink in, grasps strain. A real
/// team stands before it is asked to do anything.
pub const SETTLING_S: f64 = 1.0;
