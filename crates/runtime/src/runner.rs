//! Runners: they execute a schedule, and know nothing of what is executed.

use crate::{Call, Phase, Position, TickError, TickSchedule};
use core::ops::ControlFlow;
use mikoshi_ipc_types::ServiceId;

/// A service, as a runner sees it. A phase is computed, then published: what lies between them is the
/// moment at which a [`Replaceable`] service is kept for its successor.
pub trait Participant {
    /// Which one.
    fn id(&self) -> ServiceId;

    /// Receives the inputs of a phase and computes its outputs, which nobody sees yet.
    ///
    /// # Errors
    /// In lockstep, whatever is returned ends the run.
    fn compute(&mut self, call: Call, tick: u64) -> Result<(), TickError>;

    /// Publishes what the phase has computed in this tick. It may be done again, also by a successor:
    /// receivers use one frame a tick.
    ///
    /// # Errors
    /// As [`Participant::compute`].
    fn publish(&mut self, call: Call, tick: u64) -> Result<(), TickError>;

    /// Both.
    ///
    /// # Errors
    /// As theirs.
    fn execute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        self.compute(call, tick)?;
        self.publish(call, tick)
    }
}

impl<T: Participant + ?Sized> Participant for Box<T> {
    fn id(&self) -> ServiceId {
        (**self).id()
    }

    fn compute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        (**self).compute(call, tick)
    }

    fn publish(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        (**self).publish(call, tick)
    }
}

/// A service whose process can be replaced at any moment: all that matters of it can be written down, its
/// last outputs included.
pub trait Replaceable: Participant {
    /// Names the layout of what [`Replaceable::save`] writes: builds, and runs, whose services can take one
    /// another's place have the same.
    fn state_schema(&self) -> u64;

    /// Bytes that [`Replaceable::save`] writes at most.
    fn state_bytes(&self) -> usize;

    /// Writes all that matters to the beginning of `checkpoint`, and returns how much that is.
    ///
    /// # Errors
    /// There is less room than [`Replaceable::state_bytes`].
    fn save(&mut self, checkpoint: &mut [u8]) -> Result<usize, TickError>;

    /// Goes on where the one was that saved this. On an error nothing has changed.
    ///
    /// # Errors
    /// No service of this layout has saved it.
    fn load(&mut self, checkpoint: &[u8]) -> Result<(), TickError>;
}

/// What surrounds the ticks of a service that has a process of its own.
pub trait Session {
    /// Takes the service's place: meets all others before the first tick or, where a predecessor was in
    /// charge before, loads what it kept and says which phase that was the last of.
    ///
    /// # Errors
    /// A process is lost, the run is to stop, or shared memory is full; what the predecessor kept can't be
    /// loaded.
    fn start(&self, participant: &mut impl Replaceable) -> Result<Option<Position>, TickError>;

    /// Enters a phase; with the first one, a tick.
    ///
    /// # Errors
    /// A process is lost, the run is to stop, or a successor is in charge.
    fn begin_phase(&self, at: Position) -> Result<(), TickError>;

    /// Keeps what a phase has computed, before anybody else sees it.
    ///
    /// # Errors
    /// It can't be written down.
    fn keep(&self, at: Position, participant: &mut impl Replaceable) -> Result<(), TickError>;

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

/// Runs one service of a schedule in this process, from the first tick or from where its predecessor was.
///
/// A phase is computed, kept, and then published. A successor therefore publishes again what was computed
/// last, and goes on from there; a phase that has no inputs only says what the state holds already, and is
/// simply repeated.
///
/// Returns the number of ticks that were executed: `ticks`.
///
/// # Errors
/// The first fault, of the service or of the session.
pub fn run_service<P: Replaceable>(
    schedule: &TickSchedule,
    participant: &mut P,
    session: &impl Session,
    ticks: u64,
) -> Result<u64, RunFault> {
    let service = participant.id();
    let phases: Vec<&Phase> = schedule.phases_of(service).collect();
    let mut at = Position::default();
    let mut run = || {
        if let Some(kept) = session.start(participant)? {
            at = kept;
            if let Some(phase) = phases.get(kept.phase) {
                let oldest = kept.tick.saturating_sub(schedule.oldest_use(phase));
                for tick in oldest..=kept.tick {
                    participant.publish(phase.call, tick)?;
                }
            }
            at = at.after(phases.len());
        }
        while at.tick < ticks {
            let Some(phase) = phases.get(at.phase) else { return Err(TickError::UnknownCall) };
            session.begin_phase(at)?;
            participant.compute(phase.call, at.tick)?;
            if !phase.inputs.is_empty() {
                session.keep(at, participant)?;
            }
            participant.publish(phase.call, at.tick)?;
            at = at.after(phases.len());
        }
        Ok(())
    };
    let outcome = run();
    session.finish(outcome).map_err(|error| RunFault { service, tick: at.tick, error })?;
    Ok(ticks)
}
