//! From a run to those who look at it.

use crate::layout::Layout;
use crate::outlet::Outlet;
use crate::stage::Stage;
use mikoshi::arguments::WatchArguments;
use mikoshi::aside::step_aside;
use mikoshi::failure::{Failure, Status, as_lines};
use mikoshi::feed::{Heard, Wish};
use mikoshi::interrupts::Interrupts;
use mikoshi::print::{print_error, print_file};
use mikoshi::watched_run::WatchedRun;

/// Shows a run to its end, or until somebody interrupts; a page stays until then.
///
/// # Errors
/// There is no such run, or no place to show it at: bad usage. The file can't be written, or the port is taken.
pub fn show(arguments: &WatchArguments) -> Result<Status, Failure> {
    let interrupts = Interrupts::listen().map_err(Failure::fault)?;
    // Who looks at a run is never waited for.
    let mut watched = WatchedRun::open(arguments.run.as_deref(), Wish::Some)?;
    if watched.is_live() {
        step_aside(&watched.run.scenario.placement);
    }
    let outlet = Outlet::open(arguments, &watched.run.scenario)?;
    let stream = outlet.stream();
    Layout::of(&watched.run, watched.is_live()).send(stream).map_err(Failure::fault)?;
    let mut stage = Stage::set(stream.clone(), &watched, arguments.hz)?;
    let is_live = watched.is_live();
    while interrupts.received().is_none() {
        match watched.hear()? {
            Heard::Tick(observation) => stage.show(observation).map_err(Failure::fault)?,
            Heard::End => break,
            Heard::Silence => {
                print_error(&as_lines("warning", "nobody speaks any more: the run's supervisor is gone"));
                break;
            }
            // What is shown is a sample anyway, and of no service's settings.
            Heard::Lost(_) | Heard::Revision { .. } | Heard::Nothing => {}
        }
    }
    outlet.finish(&interrupts, is_live)?;
    if let Some(file) = &arguments.save {
        print_file(file, arguments.json)?;
    }
    Ok(Status::Met)
}
