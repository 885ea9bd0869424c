//! The team's controller: it sees hands, and nothing of the robots behind them.
//!
//! Responsibilities: the grasp's geometry (virtual sticks), internal forces and selection, the hybrid
//! law (the paper's section 3), the object's reference, the team's step clock, team modes. It knows no
//! joint, no leg and no simulator, reads no clock, and does no I/O: [`Coordinator::tick`] is a pure function of its state
//! and inputs, and `main.rs` wires it to a transport.

#![allow(non_snake_case)]

mod build;
mod grasp;
mod grips;
mod job;
mod leading;
mod load;
mod membership;
mod object_motion;
mod odometry;
mod operator;
mod participant;
mod reference;
mod rig;
mod safety;
mod step_clock;
mod tick;
mod tips;

pub use build::{BuildCoordinatorError, build_hybrid_law, build_internal_forces, team_arms};
pub use participant::CoordinatorParticipant;
pub use tick::{Coordinator, CoordinatorOutputs, CoordinatorScratch, CoordinatorState};
