//! What a receiver makes of a frame that came from outside.

use crate::{TickError, Topic};
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

/// Judges a frame that has been copied out of shared memory.
pub(crate) fn judge<P: Payload>(
    frame: &Frame<P>,
    topic: Topic,
    announced_epoch: u64,
    expected_tick: u64,
) -> Result<Verdict, TickError> {
    let envelope = &frame.envelope;
    if envelope.schema_hash != P::SCHEMA_HASH {
        return Err(TickError::WrongSchema { topic });
    }
    if envelope.robot != topic.robot as u64 {
        return Err(TickError::WrongRobot { topic, found: envelope.robot });
    }
    match envelope.epoch.cmp(&announced_epoch) {
        Ordering::Less => return Ok(Verdict::PassOver),
        Ordering::Greater => {
            return Err(TickError::WrongEpoch { topic, announced: announced_epoch, found: envelope.epoch });
        }
        Ordering::Equal => {}
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
