//! Symmetry position/force hybrid control of one object by n arms: sections 2 and 3 of Wu, Ogawa and
//! Konno, "Symmetry position/force hybrid control for cooperative object transportation using multiple
//! humanoid robots", Advanced Robotics 30(2), 2016. "Eq." in this crate is an equation of that paper.
//!
//! This crate knows no robot, no joint, no clock and no I/O. It takes hand poses and hand wrenches and
//! gives hand references; whoever can report and follow hand poses can take part.
//!
//! # From hands to the object and back
//! ```text
//!  hand pose, hand wrench
//!        │ virtual stick (fig. 2, A1)
//!  tip pose y_b, tip wrench q_b
//!        │ h = [W; C] q_b (11),  z = Uᵀ y_b (27)
//!  generalized force h_c and position z_c: row 0 the object, rows 1.. the internal forces
//!        │ hybrid law (37, 39, fig. 4): errors (I − S)(z_r − z_c) and S (h_r − h_c)
//!        │ δy_b = [W; C]ᵀ δz and q_b = U h (7), back through the virtual sticks
//!  hand references
//! ```
//!
//! All 6 × 6 blocks of W, C, W⁻, V and U are scalar multiples of the identity, so only the n × n scalar
//! matrices exist here; [`InternalForces`] applies them to six-vectors.
//!
//! # Axes
//! Row 0 is in world axes, rows 1.. are in the object's (eqs. 28 to 30).
//!
//! # Glossary
//! - **arm**, **hand**: one grasping arm; n of them hold the object, numbered in *hand order*: robot by
//!   robot, and within a robot as its configuration lists them.
//! - **tip** B*i*: the end of hand *i*'s virtual stick; it coincides with the object's frame A at the grasp.
//! - **row**: one 6-vector of the generalized vectors: row 0 is the object, the others are internal.

#![allow(non_snake_case)]

mod gain_bound;
mod generalized;
mod hybrid;
mod internal_forces;
mod linear;
mod selection;
mod team_arms;
mod torque;
mod virtual_stick;
mod workspace;

pub use gain_bound::{RECOMMENDED_SHARE, critical_loop_gain, loop_gain};
pub use generalized::{Generalized, GeneralizedForce, GeneralizedPosition, GeneralizedVelocity};
pub use hybrid::{
    BuildHybridLawError, ForceGains, HandInput, HandReference, HandStiffness, HybridError, HybridInputs,
    HybridLaw, HybridOutput, HybridParameters, HybridReference, HybridScratch, HybridState, StartHybridError,
};
pub use internal_forces::{
    BuildInternalForcesError, InternalForces, RowCombination, change_of_representation, pair_matrix,
    pairwise_forces,
};
pub use linear::Linear;
pub use selection::{Axis, Control, Selection};
pub use team_arms::{BuildTeamArmsError, RobotArms, TeamArms};
pub use torque::{joint_torques, tip_wrenches};
pub use virtual_stick::VirtualStick;
pub use workspace::{WorkspaceScratch, generalized_velocity};
