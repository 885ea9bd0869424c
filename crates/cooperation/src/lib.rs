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
//! ```
//! use mikoshi_cooperation::{
//!     ForceGains, GeneralizedForce, GeneralizedPosition, HandInput, HandStiffness, HybridInputs, HybridLaw,
//!     HybridParameters, HybridReference, HybridState, InternalForces, Selection, TeamArms, VirtualStick,
//! };
//! use mikoshi_spatial::{Hand, Object, Pose, Twist, World, Wrench};
//! use nalgebra::{UnitQuaternion, Vector3};
//!
//! // Two one-armed robots hold an object between them, 1 m apart.
//! let at = |x| Pose::<Object, Hand>::new(Vector3::new(x, 0.0, 0.0), UnitQuaternion::identity());
//! let sticks = [at(-0.5), at(0.5)].map(|X_AH| VirtualStick::from_hand_in_object(&X_AH));
//! let internal_forces = InternalForces::balanced_tree(&TeamArms::numbered(&[1, 1])?);
//! assert_eq!(internal_forces.names(), ["object", "A|B"]);
//!
//! let stiffness = HandStiffness { n_m: 1000.0, nm_rad: 300.0 };
//! let parameters = HybridParameters {
//!     period_s: 0.005,
//!     kz: 0.05,
//!     kh: ForceGains::of_loop_gain(0.02, 0.05, stiffness),
//!     selection: Selection::object_position_internal_force(2),
//!     filter_hz: 10.0,
//!     lead_limit_m: 0.02,
//!     lead_limit_rad: 0.05,
//!     approach_limit_m_s: 0.01,
//!     approach_limit_rad_s: 0.02,
//! };
//! let law = HybridLaw::new(internal_forces, parameters)?;
//! let mut state = HybridState::<2>::at_grasp(&sticks)?;
//! let (mut scratch, mut out) = (law.scratch(), law.output());
//!
//! // Each presses with 10 N against the other.
//! let X_WA = Pose::<World, Object>::identity();
//! let hand = |x, force| {
//!     let pose = X_WA * at(x);
//!     let wrench = Wrench::new(Vector3::new(force, 0.0, 0.0), Vector3::zeros());
//!     HandInput { pose, pose_commanded: pose, wrench }
//! };
//! let hands = [hand(-0.5, 10.0), hand(0.5, -10.0)];
//! let reference = HybridReference {
//!     force: &GeneralizedForce::zero(2),
//!     position: &GeneralizedPosition::at_grasp(X_WA, 2),
//!     object_twist: Twist::zero(),
//! };
//! let inputs = HybridInputs { hands: &hands, grasp_yield: Twist::zero(), reference: Some(reference) };
//! law.act(&mut state, &mut scratch, &inputs, &mut out)?;
//!
//! // So each gives way by 2 % of what its 10 N compress.
//! assert_eq!(out.force.internal[0].force.x, 10.0);
//! assert!((out.hands[0].pose.translation.x - (-0.5 - 0.02 * 10.0 / 1000.0)).abs() < 1e-12);
//! assert!((out.hands[1].pose.translation.x - (0.5 + 0.02 * 10.0 / 1000.0)).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
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
mod landmark;
mod linear;
mod load;
mod parting;
mod selection;
mod team_arms;
mod torque;
mod virtual_stick;
mod workspace;

pub use gain_bound::{RECOMMENDED_SHARE, critical_loop_gain};
pub use generalized::{Generalized, GeneralizedForce, GeneralizedPosition, GeneralizedVelocity};
pub use hybrid::{
    BuildHybridLawError, ForceGains, HandInput, HandReference, HandStiffness, HybridError, HybridInputs,
    HybridLaw, HybridOutput, HybridParameters, HybridReference, HybridScratch, HybridState, ReformError,
    StartHybridError,
};
pub use internal_forces::{
    BuildInternalForcesError, FormError, Formation, FormedForces, InternalForces, OBJECT_ROW, RowCombination,
    change_of_representation, pair_matrix, pairwise_forces,
};
pub use landmark::{BuildLandmarkError, FrameCorrection, Landmark, LandmarkParameters, Sighting};
pub use linear::Linear;
pub use load::{
    Bearer, CarriedBody, LoadIdentifier, LoadIdentifierState, largest_moment_of_equal_tips_nm, share_load,
};
pub use parting::{Gap, Parting, PartingLimits};
pub use selection::{Axis, Control, Selection};
pub use team_arms::{BuildTeamArmsError, RobotArms, TeamArms};
pub use torque::{joint_torques, tip_wrenches};
pub use virtual_stick::VirtualStick;
pub use workspace::{WorkspaceScratch, generalized_velocity};
