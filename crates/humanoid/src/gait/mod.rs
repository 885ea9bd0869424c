//! How one robot walks with its team: where the feet belong under the hands (Fig. 6), the step clock
//! that all robots share, swing foot, reference of the zero moment point, and preview control.
//!
//! This module knows no other robot, no joints and no time but ticks; it does no I/O and, but for
//! [`Gait::new`], allocates nothing. What changes from tick to tick is in [`GaitState`], a plain value.
//!
//! # Glossary
//! - **step**: a weight shift and the swing that follows it. Its index counts from the walk's start.
//! - **swing side**: the team's word; a mirrored robot swings its other foot.
//! - **foothold**: where a sole is commanded to stand.
//! - **zero moment point (ZMP)**: where the ground's reaction acts. The **extended** one also holds what
//!   the hands carry, and is what the centre of mass obeys.

mod coming_to_rest;
mod controller;
mod expected_ground;
mod foot_placement;
mod ground_pose;
mod machine;
mod preview;
mod riccati;
mod settling;
mod sole_tracking;
mod step_adjustment;
mod step_clock;
mod step_planner;
mod swing;
mod team_clock;
mod zmp_reference;

pub use coming_to_rest::ComingToRest;
pub use controller::{FootReference, Gait, GaitConfig, GaitInputs, GaitReference, GaitState, Trouble};
pub use expected_ground::ExpectedGround;
pub use foot_placement::{FootError, FootPlacement, HandCentre, MAX_HANDS};
pub use ground_pose::{GroundPose, heading, wrap};
pub use machine::{GaitPhase, PlannedStep, SwingingFoot, TransitionInputs};
pub use preview::{PreviewConfig, PreviewControl, PreviewState, SolvePreviewError};
pub use riccati::solve_discrete_riccati;
pub use settling::Settling;
pub use sole_tracking::{SoleCorrection, SoleTracking};
pub use step_adjustment::{AdjustedStep, StepAdjustment, StepInHand};
pub use step_clock::{StepClock, StepTiming};
pub use step_planner::StepLimits;
pub use swing::{BentSwing, Foothold, Swing, SwingChange, SwingConfig, SwingContact, quintic, swing_foot};
pub use team_clock::{StepWish, TeamClock};
pub use zmp_reference::ZmpReference;
