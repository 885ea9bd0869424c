//! What a receiver makes of a frame that came from outside.

use crate::board::Charge;
use crate::{Position, TickError, Topic};
use core::cmp::Ordering;
use mikoshi_ipc_types::{Frame, Payload};

/// A frame is either used or passed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// It is what was waited for.
    Use,
    /// It is older: a duplicate by a successor, or the words of a fenced predecessor.
    PassOver,
}

/// Judges a frame that has been copied out of shared memory. It was published in this phase of its
/// publisher, for which `charge` says who speaks.
pub(crate) fn judge<P: Payload>(
    frame: &Frame<P>,
    topic: Topic,
    phase: usize,
    charge: Charge,
    expected_tick: u64,
) -> Result<Verdict, TickError> {
    let envelope = &frame.envelope;
    if envelope.schema_hash != P::SCHEMA_HASH {
        return Err(TickError::WrongSchema { topic });
    }
    if envelope.robot != topic.robot as u64 {
        return Err(TickError::WrongRobot { topic, found: envelope.robot });
    }
    match envelope.epoch.cmp(&charge.epoch) {
        // What a predecessor said before it lost its place counts; the rest its successor says again.
        Ordering::Less if Position { tick: envelope.tick, phase } >= charge.since => {
            return Ok(Verdict::PassOver);
        }
        Ordering::Greater => {
            return Err(TickError::WrongEpoch { topic, announced: charge.epoch, found: envelope.epoch });
        }
        Ordering::Less | Ordering::Equal => {}
    }
    match envelope.tick.cmp(&expected_tick) {
        Ordering::Less => return Ok(Verdict::PassOver),
        Ordering::Greater => {
            return Err(TickError::FutureTick { topic, expected: expected_tick, found: envelope.tick });
        }
        Ordering::Equal => {}
    }
    match frame.payload.first_non_finite() {
        Some(field) => Err(TickError::NotFinite { topic, tick: envelope.tick, field: field.name }),
        None => Ok(Verdict::Use),
    }
}
