//! The unit that is published: an envelope around a payload.

use crate::Payload;
use core::fmt;
use iceoryx2::prelude::ZeroCopySend;

/// Who says it, and when. Outside the identity of a run, but for `tick` and `robot`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Envelope {
    /// [`Payload::SCHEMA_HASH`] of the payload that follows.
    pub schema_hash: u64,
    /// Incarnation of the publishing service: receivers accept the announced one only.
    pub epoch: u64,
    /// The control tick that the payload belongs to.
    pub tick: u64,
    /// Index of the robot in its team, or 0 for payloads of the team.
    pub robot: u64,
    /// When it was published, on the publisher's monotonic clock; 0 where no clock is read, here and below.
    pub stamp_ns: u64,
    /// When its publisher had heard the last of its inputs, or gave up waiting for it.
    pub heard_ns: u64,
    /// When its publisher had computed what came of that, and kept it.
    pub kept_ns: u64,
    /// When the phase that says it was due to begin; 0 in lockstep.
    pub due_ns: u64,
}

/// Envelope and payload. Zeroed before use, so that unused tails are zero.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Frame<P: Payload> {
    /// Who and when.
    pub envelope: Envelope,
    /// What.
    pub payload: P,
}

impl<P: Payload> Frame<P> {
    /// A frame of zeros that carries the payload's schema hash.
    pub fn zeroed() -> Self {
        Self {
            envelope: Envelope { schema_hash: P::SCHEMA_HASH, ..Envelope::default() },
            payload: P::zeroed(),
        }
    }
}

impl<P: Payload> fmt::Debug for Frame<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct(P::NAME).field("envelope", &self.envelope).field("payload", &self.payload).finish()
    }
}

// SAFETY: a frame is `repr(C)`, consists of two `Pod` values (no pointers, no padding inside either),
// and its type name identifies its layout by the schema hash.
unsafe impl<P: Payload> ZeroCopySend for Frame<P> {
    unsafe fn type_name() -> &'static str {
        P::TYPE_NAME
    }
}
