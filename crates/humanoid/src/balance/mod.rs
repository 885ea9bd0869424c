//! How one robot keeps its balance: the linear inverted pendulum with a load in its hands.

mod pendulum;
mod side;

pub use pendulum::{ExternalLoad, GRAVITY_M_S2, Pendulum};
pub use side::{PerFoot, Side};
