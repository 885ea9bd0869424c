//! From a loaded scenario to a run.
//!
//! This is where files meet robots: carry postures and grasps become a posture and a base pose for
//! every robot, or an error that says which grasp is out of reach. It knows no control of a tick, no
//! transport and no simulator; tests of services use it as the command does.

#![allow(non_snake_case)]

mod schedule;
mod surface;

pub use schedule::tick_schedule;
