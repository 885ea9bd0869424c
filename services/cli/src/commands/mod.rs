//! One module per command.

pub mod adopt;
pub mod check_robot;
pub mod doctor;
pub mod membership;
pub mod operator;
pub mod plan;
pub mod push;
pub mod record;
pub mod report;
pub mod run;
pub mod set;
pub mod shell;
pub mod status;
pub mod swap;
pub mod sweep;
