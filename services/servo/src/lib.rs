//! One robot's controller: it knows its own body, and neither the other robots nor the object's
//! controller.
//!
//! Responsibilities: the robot's own state (base by stance feet and IMU, hands by forward kinematics,
//! hand wrenches by wrist sensors), its gait and balance, its whole-body inverse kinematics (eq. 41), its
//! limits. [`Servo::sense`] and [`Servo::act`] are pure functions of state and inputs; they read no
//! clock and do no I/O, and `main.rs` wires them to a transport.

#![allow(non_snake_case)]

mod anew;
mod coast;
mod credible;
mod fallback;
mod foresight;
mod legs;
mod participant;
mod robot;
mod tick;

pub use participant::{BuildServoError, ServoParticipant};
pub use robot::{BuildRobotError, Robot};
pub use tick::{Servo, ServoScratch, ServoState};
