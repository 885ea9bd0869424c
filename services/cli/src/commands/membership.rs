//! `mikoshi leave` and `mikoshi join`: a robot leaves the team of a run that goes on, or joins it.

use crate::arguments::MembershipArguments;
use crate::control::{Request, ask, find_run};
use crate::failure::Failure;
use crate::print::print_message;

/// Asks a robot to leave, and waits until the coordinator knows of it.
///
/// # Errors
/// There is no such run or robot, it has left already, or too few would be left: bad usage.
pub fn leave(arguments: &MembershipArguments) -> Result<(), Failure> {
    change(arguments, true)
}

/// Asks a robot to join again.
///
/// # Errors
/// There is no such run or robot, or it has not left: bad usage.
pub fn join(arguments: &MembershipArguments) -> Result<(), Failure> {
    change(arguments, false)
}

fn change(arguments: &MembershipArguments, leaves: bool) -> Result<(), Failure> {
    let run = find_run(arguments.run.as_deref())?;
    let request = Request::Membership { robot: arguments.robot.clone(), leaves };
    print_message(&ask(&run, &request)?, arguments.json)
}
