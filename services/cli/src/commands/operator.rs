//! `mikoshi stop` and `mikoshi resume`: the operator's words.

use crate::arguments::OperatorArguments;
use crate::control::{Request, ask, find_run};
use crate::failure::Failure;
use crate::print::print_out;

/// Stops the team of a run: the object comes to rest, feet finish their step, hands go on to hold.
///
/// # Errors
/// There is no such run.
pub fn stop(arguments: &OperatorArguments) -> Result<(), Failure> {
    say(arguments, &Request::Stop)
}

/// Lets it go on.
///
/// # Errors
/// There is no such run.
pub fn resume(arguments: &OperatorArguments) -> Result<(), Failure> {
    say(arguments, &Request::Resume)
}

fn say(arguments: &OperatorArguments, request: &Request) -> Result<(), Failure> {
    let message = ask(&find_run(arguments.run.as_deref())?, request)?;
    print_out(&format!("{message}\n"));
    Ok(())
}
