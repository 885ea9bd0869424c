//! What an observer makes of successors: every tick once, and in order.

use super::Observer;
use crate::TickError;
use core::marker::PhantomData;
use mikoshi_ipc_types::{Frame, Payload};
use std::collections::BTreeMap;

/// The frames of one topic from tick 0 on, each tick once. A successor publishes again what its predecessor
/// may have published, and an observer that lags behind may see its first frames before the last ones of
/// the other.
pub struct InOrder<O, P: Payload> {
    observer: O,
    next_tick: u64,
    /// What came before its turn.
    early: BTreeMap<u64, Box<Frame<P>>>,
    payload: PhantomData<P>,
}

impl<O: Observer<P>, P: Payload> InOrder<O, P> {
    /// Of the frames that this observer sees.
    pub fn new(observer: O) -> Self {
        Self { observer, next_tick: 0, early: BTreeMap::new(), payload: PhantomData }
    }

    /// The frame of the next tick, if it is there.
    ///
    /// # Errors
    /// As [`Observer::try_receive`].
    pub fn try_receive(&mut self, frame: &mut Frame<P>) -> Result<bool, TickError> {
        if let Some(found) = self.early.remove(&self.next_tick) {
            *frame = *found;
            self.next_tick += 1;
            return Ok(true);
        }
        while self.observer.try_receive(frame)? {
            if self.is_next(frame) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Waits for the frame of the next tick; there is none once all services have ended.
    ///
    /// # Errors
    /// As [`Observer::receive`].
    pub fn receive(&mut self, frame: &mut Frame<P>) -> Result<bool, TickError> {
        if self.try_receive(frame)? {
            return Ok(true);
        }
        while self.observer.receive(frame)? {
            if self.is_next(frame) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Takes in all that has come, and returns the latest tick of it, if there is any.
    ///
    /// # Errors
    /// As [`Observer::try_receive`].
    pub fn gather(&mut self) -> Result<Option<u64>, TickError> {
        let mut frame = Frame::zeroed();
        while self.observer.try_receive(&mut frame)? {
            let tick = frame.envelope.tick;
            if tick >= self.next_tick {
                self.early.entry(tick).or_insert_with(|| Box::new(frame));
            }
        }
        Ok(self.early.last_key_value().map(|(tick, _)| *tick))
    }

    /// Whether the frame of this tick has been gathered.
    pub fn has(&self, tick: u64) -> bool {
        self.early.contains_key(&tick)
    }

    /// Hands out the gathered frame of this tick, if there is one; those before it are given up.
    pub fn take(&mut self, tick: u64, frame: &mut Frame<P>) -> bool {
        self.next_tick = self.next_tick.max(tick + 1);
        let later = self.early.split_off(&self.next_tick);
        let earlier = core::mem::replace(&mut self.early, later);
        let found = earlier.get(&tick);
        if let Some(found) = found {
            *frame = **found;
        }
        found.is_some()
    }

    fn is_next(&mut self, frame: &Frame<P>) -> bool {
        let tick = frame.envelope.tick;
        if tick > self.next_tick {
            self.early.insert(tick, Box::new(*frame));
        }
        let is_next = tick == self.next_tick;
        self.next_tick += u64::from(is_next);
        is_next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_ipc_types::ObjectTruth;
    use std::collections::VecDeque;

    struct Script(VecDeque<u64>);

    impl Observer<ObjectTruth> for Script {
        fn try_receive(&mut self, frame: &mut Frame<ObjectTruth>) -> Result<bool, TickError> {
            let Some(tick) = self.0.pop_front() else { return Ok(false) };
            frame.envelope.tick = tick;
            Ok(true)
        }

        fn receive(&mut self, frame: &mut Frame<ObjectTruth>) -> Result<bool, TickError> {
            self.try_receive(frame)
        }
    }

    #[test]
    fn what_was_lost_is_given_up_and_what_follows_comes_in_its_turn() {
        let mut frames = InOrder::new(Script(vec![0, 3, 2, 3, 5].into()));
        assert_eq!(frames.gather(), Ok(Some(5)));
        let mut frame = Frame::zeroed();
        let mut take = |tick| frames.take(tick, &mut frame).then_some(frame.envelope.tick);
        assert_eq!([0, 1, 2, 3, 4, 5].map(&mut take), [Some(0), None, Some(2), Some(3), None, Some(5)]);
        assert_eq!(take(3), None, "its turn is over");
        assert_eq!(frames.gather(), Ok(None));
    }

    #[test]
    fn whatever_order_frames_come_in_each_tick_is_seen_once_and_in_its_turn() {
        for script in [vec![0, 1, 2, 3], vec![0, 1, 1, 2, 3], vec![3, 0, 2, 1, 2, 3], vec![1, 0, 0, 2, 1, 3]]
        {
            for waits in [false, true] {
                let mut frames = InOrder::new(Script(script.clone().into()));
                let mut frame = Frame::zeroed();
                for tick in 0..4 {
                    let is_found =
                        if waits { frames.receive(&mut frame) } else { frames.try_receive(&mut frame) };
                    assert_eq!((is_found, frame.envelope.tick), (Ok(true), tick), "{script:?}");
                }
                assert_eq!(frames.receive(&mut frame), Ok(false));
            }
        }
    }
}
