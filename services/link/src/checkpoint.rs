//! What a service has kept, on its way to the host that stands by for it: a checkpoint behind the same header as a
//! frame, and judged as strictly.

use crate::gate::Refusal;
use crate::message::Header;
use bytemuck::{Pod, Zeroable, bytes_of, pod_read_unaligned};
use mikoshi_runtime::{Checkpoint, Position};

/// No checkpoint is larger: a coordinator of sixteen robots keeps a tenth of a megabyte.
pub const MAX_CHECKPOINT_BYTES: usize = 256 << 10;
/// Ticks that a checkpoint may be ahead of the clock: what tells the tick may itself be on its way.
const FUTURE_TICKS: u64 = 64;
/// Phases of a service are fewer.
const MAX_PHASES: u64 = 16;

/// What precedes the state.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
struct Head {
    tick: u64,
    phase: u64,
    schema: u64,
    /// Of what follows: the beginning of its hash.
    digest: u64,
}

fn digest(state: &[u8]) -> u64 {
    u64::from_le_bytes(*blake3::hash(state).as_bytes().first_chunk().unwrap_or(&[0; 8]))
}

/// The message that carries it.
pub(crate) fn message(header: &Header, checkpoint: &Checkpoint) -> Vec<u8> {
    let Checkpoint { position, schema, state } = checkpoint;
    let (tick, phase) = (position.tick, position.phase as u64);
    let head = Head { tick, phase, schema: *schema, digest: digest(state) };
    header.with(&[bytes_of(&head), state])
}

/// What the host to which it comes knows at the moment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Now {
    /// The beginning of the run's hash.
    pub run: u64,
    /// The incarnation of the sender's link, as it has introduced itself; 0 before.
    pub incarnation: u64,
    /// Whether the sender may say now how far the service is.
    pub is_entitled: bool,
    /// The tick that the clock is in.
    pub tick: u64,
}

/// Judges what is said under one key.
#[derive(Debug, Default)]
pub(crate) struct Judge {
    /// What came last, or was held before anything came.
    pub last: Option<Position>,
}

impl Judge {
    /// The checkpoint in this message, if a successor may go on from it.
    pub(crate) fn judge(&mut self, message: &[u8], now: Now) -> Result<Checkpoint, Refusal> {
        if message.len() > MAX_CHECKPOINT_BYTES {
            return Err(Refusal::Malformed);
        }
        let (header, body) = Header::split(message).ok_or(Refusal::Malformed)?;
        let (head, state) = body.split_at_checked(size_of::<Head>()).ok_or(Refusal::Malformed)?;
        let head: Head = pod_read_unaligned(head);
        if header.run != now.run {
            return Err(Refusal::Run);
        }
        if header.incarnation != now.incarnation || now.incarnation == 0 {
            return Err(Refusal::Incarnation);
        }
        if !now.is_entitled {
            return Err(Refusal::Epoch);
        }
        if head.phase >= MAX_PHASES || state.is_empty() {
            return Err(Refusal::Malformed);
        }
        if head.tick > now.tick.saturating_add(FUTURE_TICKS) {
            return Err(Refusal::Future);
        }
        let position = Position { tick: head.tick, phase: head.phase as usize };
        match self.last {
            Some(last) if position == last => return Err(Refusal::Repeated),
            Some(last) if position < last => return Err(Refusal::Overtaken),
            _ => {}
        }
        if digest(state) != head.digest {
            return Err(Refusal::Malformed);
        }
        self.last = Some(position);
        Ok(Checkpoint { position, schema: head.schema, state: state.to_vec() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Now = Now { run: 11, incarnation: 5, is_entitled: true, tick: 100 };

    fn at(tick: u64) -> Checkpoint {
        Checkpoint { position: Position { tick, phase: 1 }, schema: 3, state: vec![tick as u8; 100] }
    }

    fn sent(checkpoint: &Checkpoint) -> Vec<u8> {
        message(&Header::new(11, 5, 0), checkpoint)
    }

    #[test]
    fn what_a_service_keeps_comes_as_it_is_once_and_never_an_older_one() {
        let mut judge = Judge::default();
        assert_eq!(judge.judge(&sent(&at(100)), NOW), Ok(at(100)));
        assert_eq!(judge.judge(&sent(&at(100)), NOW), Err(Refusal::Repeated));
        assert_eq!(judge.judge(&sent(&at(99)), NOW), Err(Refusal::Overtaken));
        assert_eq!(judge.judge(&sent(&at(101)), NOW), Ok(at(101)));
        let mut held = Judge { last: Some(Position { tick: 101, phase: 1 }) };
        assert_eq!(held.judge(&sent(&at(100)), NOW), Err(Refusal::Overtaken), "it was held before");
    }

    #[test]
    fn what_is_wrong_with_it_is_said_and_leaves_no_trace() {
        let mut judge = Judge::default();
        let good = sent(&at(100));
        let flipped = |byte: usize| {
            let mut message = good.clone();
            message[byte] ^= 1;
            message
        };
        let of = |change: fn(&mut Now)| {
            let mut now = NOW;
            change(&mut now);
            now
        };
        let large = Checkpoint { state: vec![0; MAX_CHECKPOINT_BYTES], ..at(100) };
        let empty = Checkpoint { state: vec![], ..at(100) };
        let phase = Checkpoint { position: Position { tick: 100, phase: 16 }, ..at(100) };
        for (message, now, expected) in [
            (vec![], NOW, Refusal::Malformed),
            (good[..40].to_vec(), NOW, Refusal::Malformed),
            (flipped(0), NOW, Refusal::Malformed),
            (flipped(good.len() - 1), NOW, Refusal::Malformed),
            (good[..good.len() - 1].to_vec(), NOW, Refusal::Malformed),
            (sent(&large), NOW, Refusal::Malformed),
            (sent(&empty), NOW, Refusal::Malformed),
            (sent(&phase), NOW, Refusal::Malformed),
            (good.clone(), of(|now| now.run += 1), Refusal::Run),
            (good.clone(), of(|now| now.incarnation += 1), Refusal::Incarnation),
            (message(&Header::new(11, 0, 0), &at(100)), of(|now| now.incarnation = 0), Refusal::Incarnation),
            (good.clone(), of(|now| now.is_entitled = false), Refusal::Epoch),
            (sent(&at(165)), NOW, Refusal::Future),
            (sent(&at(u64::MAX)), NOW, Refusal::Future),
        ] {
            assert_eq!(judge.judge(&message, now), Err(expected));
        }
        assert_eq!(judge.judge(&good, NOW), Ok(at(100)), "nothing of it was taken note of");
    }
}
