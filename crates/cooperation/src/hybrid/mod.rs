//! The hybrid position/force law (section 3, fig. 4).

mod law;
mod loop_gain;
mod parameters;
mod state;
mod types;

pub use law::HybridLaw;
pub use loop_gain::HandStiffness;
pub use parameters::{BuildHybridLawError, HybridParameters, RowGains};
pub use state::{HybridScratch, HybridState, StartHybridError};
pub use types::{HandInput, HandReference, HybridError, HybridInputs, HybridOutput, HybridReference};
