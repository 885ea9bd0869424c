//! `mikoshi adopt`: a run whose supervisor was killed is looked after again.

use super::run::carry_out;
use crate::arguments::AdoptArguments;
use crate::control::find_run_that;
use crate::failure::{Failure, Status};
use crate::prepare::prepare_resolved;
use crate::supervisor;
use mikoshi_resolution::read_run;
use mikoshi_runtime::Board;

/// Adopts a run, and sees it to its end.
///
/// # Errors
/// There is no such run, or its supervisor lives: bad usage. A fault of the system.
pub fn adopt(arguments: &AdoptArguments) -> Result<Status, Failure> {
    let has_none = |board: &Board| !board.is_supervised();
    let directory = find_run_that(arguments.run.as_deref(), "runs without a supervisor", has_none)?;
    let run = read_run(&directory).map_err(Failure::fault)?;
    let prepared = prepare_resolved(run)?;
    carry_out(&prepared, &arguments.results, arguments.json, false, |prepared, out, observer| {
        supervisor::adopt(&directory, prepared, out, observer)
    })
}
