//! Carries the frames of a run between the hosts of a team.
//!
//! On every host a link holds the places of the services that live elsewhere: those here know nothing of it. What they
//! publish goes to those who wait for it there, and what those elsewhere say is published here in their place, once the
//! [gate] has let it through.
//!
//! # Glossary
//! - **crossing**: a frame that goes from one host to others.
//! - **stand-in**: who holds the place of a service that lives elsewhere.
//! - **beat**: the word of the clock's host that a tick has begun.
//! - **hello**: what a host says of itself: which run, how far its services are, whom it has heard when.

pub mod carry;
pub mod certify;
pub mod checkpoint;
pub mod expiry;
pub mod gate;
pub mod keys;
pub mod latency;
pub mod measure;
pub mod message;
pub mod peers;
pub mod ports;
pub mod report;
pub mod session;
pub mod standby;
pub mod task;
pub mod traffic;
