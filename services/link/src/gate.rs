//! The one place in which what came over the network is judged, before anything of it touches shared memory.
//!
//! Who is on the other side is settled before: sessions are by certificates, and a host is heard under its own keys
//! only. What it says there may still be wrong, late, said twice, or meant to do harm.

use crate::message::Header;
use bytemuck::pod_read_unaligned;
use core::sync::atomic::{AtomicU64, Ordering};
use mikoshi_ipc_types::{Envelope, Frame, Payload};
use std::collections::BTreeMap;

/// Why something was not let through.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(usize)]
pub enum Refusal {
    /// Not a message of ours, or not as long as it must be.
    Malformed,
    /// Of another run.
    Run,
    /// Of a link that has a successor, or of one that has not introduced itself.
    Incarnation,
    /// Of another build.
    Schema,
    /// About another robot than its key.
    Robot,
    /// By a service that has a successor.
    Epoch,
    /// Come already: sent again in case it was lost.
    Repeated,
    /// Older than what has come.
    Overtaken,
    /// Whoever waits for it has gone on.
    Late,
    /// So old that nobody ever waits for it: replayed.
    Stale,
    /// Of a tick that the clock has not reached.
    Future,
    /// It holds what is no number.
    NotFinite,
    /// More comes than is taken.
    Flood,
}

impl Refusal {
    /// All of them.
    pub const ALL: [Self; 13] = [
        Self::Malformed,
        Self::Run,
        Self::Incarnation,
        Self::Schema,
        Self::Robot,
        Self::Epoch,
        Self::Repeated,
        Self::Overtaken,
        Self::Late,
        Self::Stale,
        Self::Future,
        Self::NotFinite,
        Self::Flood,
    ];

    /// What it is called in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Malformed => "malformed",
            Self::Run => "run",
            Self::Incarnation => "incarnation",
            Self::Schema => "schema",
            Self::Robot => "robot",
            Self::Epoch => "epoch",
            Self::Repeated => "repeated",
            Self::Overtaken => "overtaken",
            Self::Late => "late",
            Self::Stale => "stale",
            Self::Future => "future",
            Self::NotFinite => "not-finite",
            Self::Flood => "flood",
        }
    }
}

/// How often what came of it.
#[derive(Debug, Default)]
pub struct Counters {
    accepted: AtomicU64,
    refused: [AtomicU64; Refusal::ALL.len()],
}

impl Counters {
    /// One more.
    pub fn count<T>(&self, judged: &Result<T, Refusal>) {
        let counter = match judged {
            Ok(_) => &self.accepted,
            Err(refusal) => &self.refused[*refusal as usize],
        };
        counter.fetch_add(1, Ordering::Release);
    }

    /// What was let through.
    pub fn accepted(&self) -> u64 {
        self.accepted.load(Ordering::Acquire)
    }

    /// What was not, by reason, where there is any.
    pub fn refused(&self) -> impl Iterator<Item = (&'static str, u64)> {
        let counts = Refusal::ALL.into_iter().zip(&self.refused);
        counts
            .map(|(refusal, count)| (refusal.name(), count.load(Ordering::Relaxed)))
            .filter(|(_, count)| *count > 0)
    }

    /// All of it, at this moment.
    pub fn snapshot(&self) -> BTreeMap<&'static str, u64> {
        [("accepted", self.accepted())].into_iter().chain(self.refused()).collect()
    }
}

/// Ticks that a frame may be ahead of the clock: what tells the tick may itself be on its way.
const FUTURE_TICKS: u64 = 64;
/// Ticks after which what is late is old: nobody goes back as far.
const STALE_TICKS: u64 = 64;

/// What the local host knows at the moment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Now {
    /// The incarnation of the sender's link, as it has introduced itself; 0 before.
    pub incarnation: u64,
    /// The tick that the clock is in.
    pub tick: u64,
    /// The tick of whoever waits for the frame, if somebody does.
    pub consumer_tick: Option<u64>,
}

/// Judges the frames of one topic.
#[derive(Debug)]
pub struct Gate {
    run: u64,
    schema_hash: u64,
    robot: u64,
    frame_bytes: usize,
    is_finite: fn(&[u8]) -> bool,
    /// How old a frame its consumer uses.
    age_ticks: u64,
    /// What came last.
    last_tick: Option<u64>,
    /// Whose words that was.
    incarnation: u64,
    epoch: u64,
}

impl Gate {
    /// For `P` about this robot, in a run of which this is the hash's beginning, and whose consumer uses frames of
    /// this age.
    pub fn of<P: Payload>(run: u64, robot: usize, age_ticks: u64) -> Self {
        fn is_finite<P: Payload>(payload: &[u8]) -> bool {
            pod_read_unaligned::<P>(payload).first_non_finite().is_none()
        }
        Self {
            run,
            schema_hash: P::SCHEMA_HASH,
            robot: robot as u64,
            frame_bytes: size_of::<Frame<P>>(),
            is_finite: is_finite::<P>,
            age_ticks,
            last_tick: None,
            incarnation: 0,
            epoch: 0,
        }
    }

    /// The tick of the frame in this message, if it may be used; and what is behind the header.
    ///
    /// # Errors
    /// Why it may not.
    pub fn judge<'m>(&mut self, message: &'m [u8], now: Now) -> Result<(Header, u64, &'m [u8]), Refusal> {
        let (header, body) = Header::split(message).ok_or(Refusal::Malformed)?;
        if body.len() != self.frame_bytes {
            return Err(Refusal::Malformed);
        }
        if header.run != self.run {
            return Err(Refusal::Run);
        }
        if header.incarnation != now.incarnation || now.incarnation == 0 {
            return Err(Refusal::Incarnation);
        }
        let (envelope, payload) = body.split_at(size_of::<Envelope>());
        let envelope: Envelope = pod_read_unaligned(envelope);
        if envelope.schema_hash != self.schema_hash {
            return Err(Refusal::Schema);
        }
        if envelope.robot != self.robot {
            return Err(Refusal::Robot);
        }
        let tick = envelope.tick;
        match self.last_tick {
            Some(last) if tick == last => return Err(Refusal::Repeated),
            Some(last) if tick.saturating_add(STALE_TICKS) < last => return Err(Refusal::Stale),
            Some(last) if tick < last => return Err(Refusal::Overtaken),
            _ => {}
        }
        // On another host, or one that was started anew, epochs begin anew.
        if envelope.epoch < self.epoch && header.incarnation == self.incarnation {
            return Err(Refusal::Epoch);
        }
        if tick > now.tick.saturating_add(FUTURE_TICKS) {
            return Err(Refusal::Future);
        }
        let used_in = tick.saturating_add(self.age_ticks);
        match now.consumer_tick.map(|consumer| consumer.saturating_sub(used_in)) {
            Some(behind) if behind > STALE_TICKS => return Err(Refusal::Stale),
            Some(1..) => return Err(Refusal::Late),
            _ => {}
        }
        if !(self.is_finite)(payload) {
            return Err(Refusal::NotFinite);
        }
        self.last_tick = Some(tick);
        (self.incarnation, self.epoch) = (header.incarnation, envelope.epoch);
        Ok((header, tick, body))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::bytes_of;
    use mikoshi_ipc_types::{RobotState, TeamCommand};

    const RUN: u64 = 11;
    const ROBOT: usize = 1;
    const NOW: Now = Now { incarnation: 5, tick: 100, consumer_tick: Some(101) };

    fn gate() -> Gate {
        Gate::of::<TeamCommand>(RUN, ROBOT, 3)
    }

    /// A frame of tick 100 that may be used, changed a little.
    fn message(change: impl Fn(&mut Header, &mut Frame<TeamCommand>)) -> Vec<u8> {
        let mut header = Header::new(RUN, NOW.incarnation, 0);
        let mut frame = Frame::<TeamCommand>::zeroed();
        frame.envelope = Envelope { tick: 100, robot: ROBOT as u64, epoch: 2, ..frame.envelope };
        change(&mut header, &mut frame);
        header.with(&[bytes_of(&frame.envelope), bytes_of(&frame.payload)])
    }

    fn at(tick: u64) -> Vec<u8> {
        message(|_, frame| frame.envelope.tick = tick)
    }

    #[test]
    fn what_is_as_it_should_be_is_let_through_once() {
        let mut gate = gate();
        let message = at(100);
        let found = gate.judge(&message, NOW).expect("it may be used");
        assert_eq!((found.1, found.2.len()), (100, size_of::<Frame<TeamCommand>>()));
        assert_eq!(gate.judge(&at(100), NOW), Err(Refusal::Repeated));
        assert!(gate.judge(&at(101), NOW).is_ok());
    }

    #[test]
    fn what_differs_in_anything_is_refused_and_leaves_no_trace() {
        let mut gate = gate();
        let short = at(100)[1..].to_vec();
        let cut = at(100)[..at(100).len() - 8].to_vec();
        let long = [at(100), vec![0; 8]].concat();
        let other_payload = {
            let mut frame = Frame::<RobotState>::zeroed();
            frame.envelope = Envelope { tick: 100, robot: ROBOT as u64, epoch: 2, ..frame.envelope };
            Header::new(RUN, NOW.incarnation, 0).with(&[bytes_of(&frame.envelope), bytes_of(&frame.payload)])
        };
        for (message, expected) in [
            (vec![], Refusal::Malformed),
            (short, Refusal::Malformed),
            (cut, Refusal::Malformed),
            (long, Refusal::Malformed),
            (other_payload, Refusal::Malformed),
            (message(|header, _| header.run += 1), Refusal::Run),
            (message(|header, _| header.incarnation -= 1), Refusal::Incarnation),
            (message(|header, _| header.incarnation += 1), Refusal::Incarnation),
            (message(|_, frame| frame.envelope.schema_hash ^= 1), Refusal::Schema),
            (message(|_, frame| frame.envelope.robot = 0), Refusal::Robot),
            (at(100 + FUTURE_TICKS + 1), Refusal::Future),
            (at(u64::MAX), Refusal::Future),
            (at(97), Refusal::Late),
            (at(36), Refusal::Late),
            (at(20), Refusal::Stale),
            (message(|_, frame| frame.payload.hand_pose_ref[0][2] = f64::NAN), Refusal::NotFinite),
            (message(|_, frame| frame.payload.hand_twist_ref[1][0] = f64::INFINITY), Refusal::NotFinite),
        ] {
            assert_eq!(gate.judge(&message, NOW), Err(expected));
        }
        assert!(gate.judge(&at(100), NOW).is_ok(), "nothing of it was taken note of");
    }

    #[test]
    fn who_has_a_successor_and_what_was_overtaken_is_not_heard() {
        let mut gate = gate();
        assert!(gate.judge(&at(100), NOW).is_ok());
        assert_eq!(gate.judge(&at(99), NOW), Err(Refusal::Overtaken));
        assert_eq!(gate.judge(&at(100 - STALE_TICKS - 1), NOW), Err(Refusal::Stale));
        let of_epoch = |tick, epoch| {
            message(move |_, frame| (frame.envelope.tick, frame.envelope.epoch) = (tick, epoch))
        };
        assert_eq!(gate.judge(&of_epoch(101, 1), NOW), Err(Refusal::Epoch));
        assert!(gate.judge(&of_epoch(101, 3), NOW).is_ok());
        assert_eq!(gate.judge(&of_epoch(102, 2), NOW), Err(Refusal::Epoch));
        let anew = |header: &mut Header, frame: &mut Frame<TeamCommand>| {
            header.incarnation += 1;
            (frame.envelope.tick, frame.envelope.epoch) = (102, 1);
        };
        let now = Now { incarnation: NOW.incarnation + 1, ..NOW };
        assert!(gate.judge(&message(anew), now).is_ok(), "a host that was replaced counts from one");
    }

    #[test]
    fn nobody_is_heard_before_he_has_introduced_himself() {
        let unknown = Now { incarnation: 0, ..NOW };
        assert_eq!(gate().judge(&at(100), unknown), Err(Refusal::Incarnation));
        assert_eq!(
            gate().judge(&message(|header, _| header.incarnation = 0), unknown),
            Err(Refusal::Incarnation)
        );
    }

    #[test]
    fn what_nobody_waits_for_here_is_never_late() {
        let for_observers = Now { consumer_tick: None, ..NOW };
        assert!(gate().judge(&at(3), for_observers).is_ok());
    }

    #[test]
    fn refusals_are_counted_by_reason() {
        let counters = Counters::default();
        counters.count(&Ok(()));
        for refusal in [Refusal::Late, Refusal::Stale, Refusal::Late] {
            counters.count::<()>(&Err(refusal));
        }
        assert_eq!(counters.accepted(), 1);
        assert_eq!(counters.refused().collect::<Vec<_>>(), [("late", 2), ("stale", 1)]);
        assert_eq!(
            serde_json::to_string(&counters.snapshot()).expect("it is JSON"),
            r#"{"accepted":1,"late":2,"stale":1}"#
        );
    }
}
