//! What travels between hosts: a frame as it is, behind a word on who sends it. All of it may be anything until the
//! gate has looked at it.

use bytemuck::{Pod, Zeroable, bytes_of, pod_read_unaligned};
use mikoshi_ipc_types::MAX_ROBOTS;

/// Opens every message, and names its layout.
const MAGIC: u64 = u64::from_le_bytes(*b"mkslink2");

/// What every message begins with.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Header {
    magic: u64,
    /// The beginning of the run's hash.
    pub run: u64,
    /// Of the link that sends it: a later one has a larger number.
    pub incarnation: u64,
    /// When it was sent, by the sender's clock.
    pub sent_ns: u64,
}

/// Bytes of a header.
pub const HEADER_BYTES: usize = size_of::<Header>();

impl Header {
    /// Of a link of this run.
    pub fn new(run: u64, incarnation: u64, sent_ns: u64) -> Self {
        Self { magic: MAGIC, run, incarnation, sent_ns }
    }

    /// With what follows it.
    pub fn with(&self, body: &[&[u8]]) -> Vec<u8> {
        [&[bytes_of(self)], body].concat().concat()
    }

    /// Takes a message apart; none if it is not one of ours.
    pub fn split(message: &[u8]) -> Option<(Self, &[u8])> {
        let (header, body) = message.split_at_checked(HEADER_BYTES)?;
        let header: Self = pod_read_unaligned(header);
        (header.magic == MAGIC).then_some((header, body))
    }
}

/// Hosts of a team at most, and services.
pub const MAX_PLACES: usize = MAX_ROBOTS + 2;

/// What a host says of itself, all the time.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Hello {
    /// The run's whole hash.
    pub run: [u8; 32],
    /// How often "stop" was said on it: that is heard wherever it is said.
    pub stops: u64,
    /// How far its services are, in canonical order; zeros for those that live elsewhere.
    pub services: [Progress; MAX_PLACES],
    /// What it has heard of the others.
    pub heard: [Heard; MAX_PLACES],
}

/// How far a service is.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Progress {
    /// Its [`State`](mikoshi_runtime::State) as a number.
    pub state: u64,
    /// Its tick.
    pub tick: u64,
    /// How often it has moved from host to host, its move to this one included.
    pub moves: u64,
}

/// When a host was heard last: from it the other one learns how long the way is, and what the clock shows there.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Heard {
    /// When it was sent, by the clock of who sent it; 0 if nothing came yet.
    pub sent_ns: u64,
    /// When it came, by the clock of who heard it.
    pub came_ns: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_taken_apart_as_it_was_put_together_and_nothing_else_is_one() {
        let header = Header::new(1, 2, 3);
        let message = header.with(&[b"ab", b"c"]);
        assert_eq!(Header::split(&message), Some((header, &b"abc"[..])));
        for length in 0..HEADER_BYTES {
            assert_eq!(Header::split(&message[..length]), None);
        }
        for byte in 0..8 {
            let mut other = message.clone();
            other[byte] ^= 1;
            assert_eq!(Header::split(&other), None);
        }
    }
}
