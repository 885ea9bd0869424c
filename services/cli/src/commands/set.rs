//! `mikoshi set`: gains, limits and references of a run that goes on.

use crate::arguments::SetArguments;
use crate::control::{Request, ask, find_run};
use crate::failure::Failure;
use crate::print::print_message;

/// Asks for all of them at once, and waits until they are in force.
///
/// # Errors
/// There is no such run, a setting is wrong, or can't change in the middle of a run: bad usage, and nothing has changed.
pub fn set(arguments: &SetArguments) -> Result<(), Failure> {
    let run = find_run(arguments.run.as_deref())?;
    let request = Request::Set { set: arguments.settings.clone() };
    print_message(&ask(&run, &request)?, arguments.json)
}
