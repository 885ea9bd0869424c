//! Poses, twists and wrenches typed by coordinate frame, and rotations that are right at their edges.
//!
//! Mixing coordinate frames does not compile: [`Pose<A, B>`] composes with `Pose<B, C>` only, a
//! [`Wrench<A>`] is added to a `Wrench<A>` only. Re-expressing and shifting are the only ways across.
//!
//! # Notation
//! Monogram names: `X_WA` is the pose of A in W, `p_HA_W` the vector from H to A in axes of W, `f_B_W`
//! a wrench at B in axes of W. The paper's Σo is [`World`], Σa [`Object`], Σh [`Hand`], Σb [`Tip`].

#![allow(non_snake_case)]

mod euler;
mod frame;
mod pose;
mod rotation;
mod vector;

pub use euler::{euler_rate_matrix, euler_zyx};
pub use frame::{Base, CoordinateFrame, Foot, Hand, Object, Sensor, Tip, World};
pub use pose::Pose;
pub use rotation::{exp, log, skew};
pub use vector::{Twist, Wrench};
