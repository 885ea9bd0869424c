//! What a robot knows of itself: where its base is, what its hands and feet apply, where its support
//! ends. All of it from its own sensors.

mod base;
mod force_sensor;
mod pivoting;
mod support_polygon;

pub use base::{BaseEstimate, BaseEstimator, BaseEstimatorGains, BaseEstimatorState, FootContact, Readings};
pub use force_sensor::{CarriedMotion, ForceTorqueSensor, zero_moment_point};
pub use pivoting::Pivoting;
pub use support_polygon::{SoleRectangle, SupportPolygon};
