//! The hybrid position/force law (section 3, fig. 4).

mod law;
mod parameters;
mod reform;
mod state;
mod types;

pub use law::HybridLaw;
pub use parameters::{BuildHybridLawError, ForceGains, HandStiffness, HybridParameters};
pub use reform::ReformError;
pub use state::{HybridScratch, HybridState, StartHybridError};
pub use types::{HandInput, HandReference, HybridError, HybridInputs, HybridOutput, HybridReference};
