//! Poses, twists and wrenches typed by coordinate frame, and rotations that are right at their edges.
//!
//! Mixing coordinate frames does not compile: [`Pose<A, B>`] composes with `Pose<B, C>` only, a
//! [`Wrench<A>`] is added to a `Wrench<A>` only. Re-expressing and shifting are the only ways across.
//!
//! ```
//! use mikoshi_spatial::{Hand, Object, Pose, Tip, World, Wrench};
//! let (X_WH, X_HB) = (Pose::<World, Hand>::identity(), Pose::<Hand, Tip>::identity());
//! let X_WB: Pose<World, Tip> = X_WH * X_HB;
//! let (f_W, g_A) = (Wrench::<World>::zero(), Wrench::<Object>::zero());
//! let X_WA = Pose::<World, Object>::identity();
//! let sum: Wrench<World> = f_W + g_A.expressed_in(&X_WA);
//! # let _ = (X_WB, sum);
//! ```
//! The inner frames of a composition must agree:
//! ```compile_fail,E0308
//! # use mikoshi_spatial::{Hand, Object, Pose, Tip, World, Wrench};
//! # let (X_WH, X_HB) = (Pose::<World, Hand>::identity(), Pose::<Hand, Tip>::identity());
//! let X_WB: Pose<World, Tip> = X_HB * X_WH;
//! ```
//! Wrenches in different axes don't add up:
//! ```compile_fail,E0308
//! # use mikoshi_spatial::{Hand, Object, Pose, Tip, World, Wrench};
//! # let (f_W, g_A) = (Wrench::<World>::zero(), Wrench::<Object>::zero());
//! let sum: Wrench<World> = f_W + g_A;
//! ```
//! A pose re-expresses only what is in its own inner frame:
//! ```compile_fail,E0308
//! # use mikoshi_spatial::{Hand, Object, Pose, Tip, World, Wrench};
//! # let (f_W, X_WA) = (Wrench::<World>::zero(), Pose::<World, Object>::identity());
//! let f_W: Wrench<World> = f_W.expressed_in(&X_WA);
//! ```
//!
//! # Notation
//! Monogram names: `X_WA` is the pose of A in W, `p_HA_W` the vector from H to A in axes of W, `f_B_W`
//! a wrench at B in axes of W. The paper's Σo is [`World`], Σa [`Object`], Σh [`Hand`], Σb [`Tip`].

#![allow(non_snake_case)]

mod euler;
mod finite;
mod frame;
mod pose;
mod rotation;
mod vector;

pub use euler::{euler_rate_matrix, euler_zyx};
pub use frame::{Base, CoordinateFrame, Foot, Hand, Object, Odometry, Sensor, Tip, World};
pub use pose::Pose;
pub use rotation::{exp, log, skew};
pub use vector::{Twist, Wrench};
