//! Who is told that frames were sent, and woken for them.

use super::Process;
use crate::board::{Role, Slot};
use crate::wait::Bed;
use crate::{Clock, Phase, Topic};

/// Whether a phase waits for several publishers.
pub(super) fn is_gathering(phase: &Phase) -> bool {
    phase.inputs.windows(2).any(|pair| pair[0].from != pair[1].from)
}

/// Where on the board a topic's publisher says that it has sent a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    slot: usize,
    /// Of the publisher.
    pub(super) phase: usize,
    /// Among all outputs of the publisher.
    pub(super) place: usize,
}

/// What a service waits for.
pub(super) struct Awaited {
    /// Frames of the publisher's phase that services wait for.
    frames: usize,
    /// Whether to give way after the last of them, to those who wait, before what only observers see.
    gives_way: bool,
    /// Who waits for more than this publisher.
    gatherings: Vec<Gathering>,
}

/// A phase that waits for several publishers. Its service is woken when the last frame is there: it would only sleep
/// again. By the clock it is woken by each, since it goes on without those that don't come.
struct Gathering {
    /// The service's slot.
    slot: usize,
    /// How old a frame of this topic it uses.
    age_ticks: u64,
    /// All that it waits for, and how old.
    inputs: Vec<(Source, u64)>,
}

impl Process {
    pub(super) fn source_of(&self, topic: Topic) -> Option<Source> {
        let schedule = &self.schedule;
        Some(Source {
            slot: self.slot_of(Role::Service(schedule.producer_of(topic)?))?,
            phase: schedule.phase_of(topic)?,
            place: schedule.place_among_outputs(topic)?,
        })
    }

    pub(super) fn slot_at(&self, source: Source) -> Option<&Slot> {
        self.member.board().slots().get(source.slot)
    }

    /// Says that a frame was sent. Those who sleep for what a phase says are woken by one call, after the last frame
    /// that a service waits for: each call is a system call, and the next ones would hold up those already awake.
    /// In lockstep what only observers see can wait until those had their turn.
    pub(super) fn say(&self, source: Source, tick: u64, awaited: Option<&Awaited>) {
        let Some(slot) = self.slot_at(source) else { return };
        slot.bell(source.place).ring_for(tick);
        self.unsaid.set(Some(source));
        if let Some(awaited) = awaited {
            for gathering in &awaited.gatherings {
                self.call_if_complete(gathering, tick);
            }
            self.sent.set(self.sent.get() + 1);
            if self.sent.get() >= awaited.frames {
                self.call_sleepers();
                if awaited.gives_way {
                    rustix::thread::sched_yield();
                }
            }
        }
    }

    /// Whoever sleeps there has noted that before it looked for the last time, so that it has seen all that was rung for
    /// before nobody was found asleep. Only then do the bells of others matter, which they have written last.
    fn call_if_complete(&self, gathering: &Gathering, tick: u64) {
        let bed = self.member.board().slots().get(gathering.slot).map(|slot| &slot.bed);
        if !bed.is_some_and(Bed::has_guests) {
            return;
        }
        let is_there = |(source, age_ticks): &(Source, u64)| {
            let tick = (tick + gathering.age_ticks).checked_sub(*age_ticks);
            let slot = self.slot_at(*source);
            tick.zip(slot).is_none_or(|(tick, slot)| slot.bell(source.place).has_rung_for(tick))
        };
        if gathering.inputs.iter().all(is_there) {
            self.member.board().call(gathering.slot, |slot| &slot.bed);
        }
    }

    /// What services wait for of this topic, if they do.
    pub(super) fn awaited(&self, topic: Topic, source: Source) -> Option<Awaited> {
        let is_awaited = |topic: Topic| self.schedule.consumers_of(topic).next().is_some();
        let mut phases = self.schedule.phases_of(self.schedule.producer_of(topic)?);
        let outputs = &phases.nth(source.phase)?.outputs;
        let frames = outputs.iter().filter(|output| is_awaited(output.topic)).count();
        // By the clock there is time, and whoever gives way may come back late.
        let gives_way = frames < outputs.len() && self.schedule.clock() == Clock::Lockstep;
        is_awaited(topic).then(|| Awaited { frames, gives_way, gatherings: self.gatherings_of(topic) })
    }

    /// The phases that wait for this topic and for other publishers.
    fn gatherings_of(&self, topic: Topic) -> Vec<Gathering> {
        let gathering = |phase: &Phase| {
            let age_ticks = phase.inputs.iter().find(|input| input.topic == topic)?.age_ticks;
            let slot = self.slot_of(Role::Service(phase.service)).filter(|_| is_gathering(phase))?;
            let inputs = match self.schedule.clock() {
                Clock::Lockstep => phase.inputs.as_slice(),
                Clock::Wall { .. } => &[],
            };
            let inputs =
                inputs.iter().filter_map(|input| Some((self.source_of(input.topic)?, input.age_ticks)));
            Some(Gathering { slot, age_ticks, inputs: inputs.collect() })
        };
        self.schedule.phases().iter().filter_map(gathering).collect()
    }

    /// Wakes those who sleep for what was sent, if they have not been.
    pub(super) fn call_sleepers(&self) {
        self.sent.set(0);
        if let Some(source) = self.unsaid.take() {
            let board = self.member.board();
            board.call(source.slot, |slot| slot.lobby(source.phase));
            if let Some(link) = self.link {
                board.call(link, |slot| &slot.bed);
            }
        }
    }
}
