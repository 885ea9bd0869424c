//! The contract between Mikoshi's processes: what travels, under which name, within which limits.
//!
//! This crate knows no control, no clock and no transport; it holds no logic beyond the layout of
//! frames. Everything that travels is `#[repr(C)]`, of fixed size, without padding, and made of
//! integers and `f64` only: any bit pattern is a valid value, so a frame can be copied out of shared
//! memory *before* it is checked.
//!
//! # Glossary
//! - **payload**: what a service says in one tick. It is deterministic: the identity of a run is the
//!   sequence of its payloads.
//! - **envelope**: who says it, when, under which schema. Epoch and stamp lie outside the identity.
//! - **frame**: envelope and payload, the unit that is published. (A *coordinate* frame is a marker
//!   type of `mikoshi-spatial`, not a frame of this crate.)
//! - **hand order**: robot by robot; within a robot in the order of its configuration (right, left).

mod envelope;
mod layout;
mod limits;
pub mod operator;
mod payloads;
mod service;

pub use envelope::{Envelope, Frame};
pub use layout::{Audience, Field, Payload, Scalar, ServicePayload, WireType, schema_hash};
pub use limits::{
    FALLBACK_PARTS, MAX_COORDINATION_DELAY_TICKS, MAX_FEET, MAX_HANDS, MAX_HANDS_OF_TEAM, MAX_JOINTS,
    MAX_ROBOTS,
};
pub use operator::{Drive, OperatorInput, Push};
pub use payloads::{
    JointCommand, ObjectTruth, PoseWire, RobotState, RobotTruth, Sensors, TeamCommand, TeamState, TwistWire,
    WrenchWire, all_hands, flag, member_fault, member_stage, mode, stop_cause,
};
pub use service::ServiceId;
