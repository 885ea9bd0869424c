//! `mikoshi push`: disturbs the simulated world of a run.

use crate::arguments::PushArguments;
use crate::control::{Request, ask, find_run};
use crate::failure::Failure;
use crate::print::print_message;

/// Asks for a push, and waits until the world has heard of it.
///
/// # Errors
/// There is no such run or body, or nobody pushes so hard or so long: bad usage.
pub fn push(arguments: &PushArguments) -> Result<(), Failure> {
    let run = find_run(arguments.run.as_deref())?;
    let PushArguments { on, force_n, for_s, .. } = arguments;
    let request = Request::Push { on: on.clone(), force_n: *force_n, for_s: *for_s };
    print_message(&ask(&run, &request)?, arguments.json)
}
