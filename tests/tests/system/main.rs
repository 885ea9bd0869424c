//! Tests of the command as a user meets it.

mod adoption;
mod bad_input;
mod bridge;
mod check_robot;
mod command;
mod determinism;
mod disturbed;
mod drive;
mod environment;
mod faults;
mod heavy;
mod job;
mod json;
mod latency;
mod leader_follower;
mod lost_grasp;
mod real_time;
mod record;
mod render;
mod replay;
mod report;
mod steer;
mod succession;
mod sweep;
mod top;
mod walking;
