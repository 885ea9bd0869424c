//! Tests of the command as a user meets it.

mod adoption;
mod bad_input;
mod check_robot;
mod command;
mod determinism;
mod environment;
mod faults;
mod job;
mod latency;
mod leader_follower;
mod lost_grasp;
mod real_time;
mod record;
mod render;
mod replay;
mod report;
mod succession;
mod sweep;
mod walking;
