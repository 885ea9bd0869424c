//! How one robot keeps its balance: the linear inverted pendulum with a load in its hands, and the
//! stabiliser.
//!
//! This module knows no joints: it says how soles and centre of mass are to move beside the gait, and
//! the inverse kinematics does it. It does no I/O and allocates nothing.

mod distribution;
mod ground_tilt;
mod nearest;
mod pendulum;
mod pull;
mod side;
mod stabiliser;

pub use distribution::{FootLoad, distribute};
pub use ground_tilt::GroundTilt;
pub use nearest::nearest_in_polygon;
pub use pendulum::{ExternalLoad, GRAVITY_M_S2, Pendulum};
pub use pull::PulledRobot;
pub use side::{PerFoot, Side};
pub use stabiliser::{Stabilisation, Stabiliser, StabiliserConfig, StabiliserInputs, StabiliserState};
