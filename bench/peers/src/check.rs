//! Whether a carrier delivers every frame, whole, to whom it is meant for, once and in order.

use crate::carrier::Carrier;
use crate::driver::{DriverError, Wait};
use crate::serve::numbers_of;
use crate::team::{self, Task, schedule, services};
use crate::witness::Fault;
use clap::Args;
use mikoshi_runtime::{Double, InMemoryHub, run_in_one_thread};
use std::ops::ControlFlow;

/// What is checked.
#[derive(Debug, Args)]
pub struct Check {
    /// What carries frames
    #[arg(long)]
    carrier: Carrier,
    /// How processes wait
    #[arg(long)]
    wait: Wait,
    /// For how many ticks
    #[arg(long, default_value_t = 300)]
    ticks: u64,
    /// What the coordinator does in one of them
    #[arg(long)]
    fault: Option<Fault>,
}

/// Lets six processes run, looks at every word of every frame, and compares what they came to with the same team in
/// one thread.
///
/// # Errors
/// A frame is not what was sent, or a service came to something else.
pub fn check(check: &Check) -> Result<(), DriverError> {
    let Check { carrier, wait, ticks, fault } = *check;
    let outcome = team::run(Task { carrier, wait, ticks, is_checked: true, fault })?;
    if outcome.numbers != expected(ticks)? {
        return Err(DriverError("services came to something else than in one thread".to_owned()));
    }
    match outcome.times_ns.len() as u64 == ticks {
        true => Ok(()),
        false => Err(DriverError(format!("{} ticks, not {ticks}", outcome.times_ns.len()))),
    }
}

/// What services come to in one thread.
fn expected(ticks: u64) -> Result<Vec<String>, DriverError> {
    let schedule = schedule();
    let hub = InMemoryHub::new(schedule.clone());
    let doubles = services().map(|service| Double::new(&schedule, &hub.transport(service), service));
    let mut doubles = doubles.collect::<Result<Vec<_>, _>>().map_err(DriverError::of)?;
    run_in_one_thread(&schedule, &mut doubles, ticks, |_| ControlFlow::Continue(()))
        .map_err(DriverError::of)?;
    doubles.iter_mut().map(numbers_of).collect()
}
