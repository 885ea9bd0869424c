//! `mikoshi swap`: another process takes a service's place while the team carries.

use crate::arguments::SwapArguments;
use crate::control::{Request, ask, find_run};
use crate::failure::Failure;
use crate::print::print_message;

/// Asks a run's supervisor for it, and waits until the new process is in charge.
///
/// # Errors
/// There is no such run or service, or the new process can't go on from the old one's state: bad usage.
pub fn swap(arguments: &SwapArguments) -> Result<(), Failure> {
    let run = find_run(arguments.run.as_deref())?;
    let program = arguments.program.as_ref();
    let program = program
        .map(|path| path.canonicalize().map_err(|error| Failure::usage(error).context(path.display())));
    let request = Request::Swap {
        service: arguments.service.clone(),
        set: arguments.overrides.clone(),
        program: program.transpose()?,
    };
    let message = ask(&run, &request)?;
    print_message(&message, arguments.json)
}
