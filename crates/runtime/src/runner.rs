//! Runners: they execute a schedule, and know nothing of what is executed.

use crate::{Call, Position, TickError, TickSchedule};
use core::ops::ControlFlow;
use mikoshi_ipc_types::ServiceId;

/// A service, as a runner sees it.
pub trait Participant {
    /// Which one.
    fn id(&self) -> ServiceId;

    /// Executes one phase: receives its inputs, computes, publishes its outputs.
    ///
    /// # Errors
    /// In lockstep, whatever is returned ends the run.
    fn execute(&mut self, call: Call, tick: u64) -> Result<(), TickError>;
}

impl<T: Participant + ?Sized> Participant for &mut T {
    fn id(&self) -> ServiceId {
        (**self).id()
    }

    fn execute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        (**self).execute(call, tick)
    }
}

impl<T: Participant + ?Sized> Participant for Box<T> {
    fn id(&self) -> ServiceId {
        (**self).id()
    }

    fn execute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        (**self).execute(call, tick)
    }
}

/// What surrounds the ticks of a service that has a process of its own.
pub trait Session {
    /// Meets all others before the first tick.
    ///
    /// # Errors
    /// A process is lost, the run is to stop, or shared memory is full.
    fn start(&self) -> Result<(), TickError>;

    /// Enters a phase; with the first one, a tick.
    ///
    /// # Errors
    /// A process is lost, or the run is to stop.
    fn begin_phase(&self, at: Position) -> Result<(), TickError>;

    /// Meets all others after the last tick, or tells them why there will be no more.
    ///
    /// # Errors
    /// The outcome's own; a process that was lost after the last tick.
    fn finish(&self, outcome: Result<(), TickError>) -> Result<(), TickError>;
}

/// What ended a run early.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{service}, tick {tick}: {error}")]
pub struct RunFault {
    /// In which service.
    pub service: ServiceId,
    /// In which tick.
    pub tick: u64,
    /// What.
    pub error: TickError,
}

/// Runs all services of a schedule in this thread, in canonical order. After each tick `on_tick` is
/// told which it was, for observers, and may end the run.
///
/// Returns the number of ticks that were executed.
///
/// # Errors
/// The first fault of a service.
///
/// # Panics
/// A service of the schedule is not among the participants: a programming error of the caller.
pub fn run_in_one_thread<P: Participant>(
    schedule: &TickSchedule,
    participants: &mut [P],
    ticks: u64,
    mut on_tick: impl FnMut(u64) -> ControlFlow<()>,
) -> Result<u64, RunFault> {
    let calls: Vec<(usize, ServiceId, Call)> = schedule
        .phases()
        .iter()
        .map(|phase| {
            let index = participants.iter().position(|participant| participant.id() == phase.service);
            (index.expect("every service of a schedule takes part"), phase.service, phase.call)
        })
        .collect();
    for tick in 0..ticks {
        for &(index, service, call) in &calls {
            participants[index].execute(call, tick).map_err(|error| RunFault { service, tick, error })?;
        }
        if on_tick(tick).is_break() {
            return Ok(tick + 1);
        }
    }
    Ok(ticks)
}

/// Runs one service of a schedule in this process.
///
/// Returns the number of ticks that were executed: `ticks`.
///
/// # Errors
/// The first fault, of the service or of the session.
pub fn run_service<P: Participant>(
    schedule: &TickSchedule,
    participant: &mut P,
    session: &impl Session,
    ticks: u64,
) -> Result<u64, RunFault> {
    let service = participant.id();
    let calls: Vec<Call> = schedule.phases_of(service).map(|phase| phase.call).collect();
    let mut tick = 0;
    let mut run = || {
        session.start()?;
        while tick < ticks {
            for (phase, &call) in calls.iter().enumerate() {
                session.begin_phase(Position { tick, phase })?;
                participant.execute(call, tick)?;
            }
            tick += 1;
        }
        Ok(())
    };
    let outcome = run();
    session.finish(outcome).map_err(|error| RunFault { service, tick, error })?;
    Ok(ticks)
}
