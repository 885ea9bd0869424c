//! A process's place on the board: it waits there for others, and is woken there.

use crate::allocations::allocations;
use crate::board::{Board, BoardError, Role, Slot, State};
use crate::pace::{Pace, now_ns, sleep_until, trimmed_origin_ns, yield_until};
use crate::process::{ProcessIdentity, ProcessWatch};
use crate::pulse;
use crate::suspicion::{LEAST_LOOK_NS, Suspicion};
use crate::wait::{Bed, Meanwhile, WaitPolicy, Woken};
use crate::{FaultCode, Position, TickError};
use core::cell::{Cell, RefCell};
use mikoshi_ipc_types::ServiceId;
use std::io;
use std::path::Path;

/// Ticks that the run may be ahead of a tap that records without loss: half of what its queues hold.
pub const TAP_LEAD_TICKS: u64 = crate::transport::OBSERVER_DEPTH as u64 / 2;

/// Ticks after which a service looks around even if it never had to sleep: less than a second in real
/// time, and a few microseconds for each.
const LOOK_AROUND_TICKS: u64 = 128;

/// Why a process can't take its place.
#[derive(Debug, thiserror::Error)]
pub enum JoinError {
    /// There is no board.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// The run has no such role.
    #[error("this run has no {0}")]
    NoSuchRole(Role),
    /// A living process has it.
    #[error("{role} is process {owner} already")]
    Occupied {
        /// The role.
        role: Role,
        /// Who has it.
        owner: ProcessIdentity,
    },
    /// `/proc` is not to be read.
    #[error("/proc: {0}")]
    Proc(#[from] io::Error),
}

/// A process of a run. When it is dropped before [`Member::conclude`], all others learn that it failed.
pub struct Member {
    board: Board,
    role: Role,
    slot: usize,
    policy: WaitPolicy,
    /// Whose place it came for.
    entry: Entry,
    /// Whether nobody had the place before.
    is_first: bool,
    /// Its incarnation; 0 until it is in charge.
    epoch: Cell<u64>,
    /// Of the board, since it is in charge.
    charge_generation: Cell<u32>,
    /// By slot; renewed when a successor takes the slot.
    watches: RefCell<Vec<Option<ProcessWatch>>>,
    /// Of the board, when it was last looked at.
    generation: Cell<u32>,
    /// What is to be done when a process has taken another one's place.
    on_successor: RefCell<Option<Box<dyn Fn()>>>,
}

/// Whose place a process comes for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// Nobody's, or that of one who has died.
    Vacant,
    /// Also that of one who lives: it is asked to make room.
    Replace,
    /// That of one who lives, once it is lost or falls behind.
    Standby,
    /// Nobody's if there is one such, else as [`Entry::Standby`]: of two who come so, one is in charge.
    Enlist,
}

impl Member {
    /// Takes this role in the run of this directory. Whoever is the first in it is in charge at once; a
    /// successor is when it [takes charge](Self::take_charge).
    ///
    /// # Errors
    /// There is no board, no such role, or a living process has it.
    pub fn join(run: &Path, role: Role, policy: WaitPolicy, entry: Entry) -> Result<Self, JoinError> {
        let board = Board::open(run)?;
        let index = board.index_of(role).ok_or(JoinError::NoSuchRole(role))?;
        let slot = &board.slots()[index];
        let owner = slot.living_owner();
        if let Some(owner) = owner.filter(|_| entry == Entry::Vacant) {
            return Err(JoinError::Occupied { role, owner });
        }
        let is_enlisted = entry == Entry::Enlist;
        let is_second = owner.is_some() || slot.is_reserved();
        let entry = if is_enlisted && is_second { Entry::Standby } else { entry };
        // Of observers and supervisors there is no state to go on from.
        let is_first = entry != Entry::Standby && slot.epoch() == 0 || !matches!(role, Role::Service(_));
        let mut member = Self {
            role,
            slot: index,
            policy,
            entry,
            is_first,
            epoch: Cell::new(0),
            charge_generation: Cell::new(0),
            watches: RefCell::new(board.slots().iter().map(|_| None).collect()),
            generation: Cell::new(board.generation()),
            on_successor: RefCell::default(),
            board,
        };
        if is_first {
            match member.take_charge(Position::default(), None) {
                Err(JoinError::Occupied { .. }) if is_enlisted => {
                    (member.is_first, member.entry) = (false, Entry::Standby);
                }
                taken => taken?,
            }
        }
        Ok(member)
    }

    /// The board.
    pub fn board(&self) -> &Board {
        &self.board
    }

    /// Its role.
    pub fn role(&self) -> Role {
        self.role
    }

    /// Its incarnation: 1 for the first process in this role, 0 until it is in charge.
    pub fn epoch(&self) -> u64 {
        self.epoch.get()
    }

    /// Whether somebody else was in charge before.
    pub(crate) fn is_successor(&self) -> bool {
        !self.is_first
    }

    /// From this phase on it speaks for its role; whoever is `frozen` in it does no more.
    pub(crate) fn take_charge(
        &self,
        since: Position,
        frozen: Option<ProcessIdentity>,
    ) -> Result<(), JoinError> {
        let (slot, own) = (self.slot(), ProcessIdentity::own()?);
        let claimed = match frozen {
            Some(frozen) => slot.seize(frozen, own, since),
            None => slot.claim(own, since),
        };
        let epoch = claimed.map_err(|owner| JoinError::Occupied { role: self.role, owner })?;
        self.epoch.set(epoch);
        self.charge_generation.set(self.board.announce_successor());
        Ok(())
    }

    /// Waits until the tap, if one is attached, is connected to this successor: what that publishes would be
    /// lost with it if it died before.
    pub(crate) fn wait_for_welcome(&self) -> Result<(), TickError> {
        let Some(tap) = self.slot_of(Role::Tap).filter(|_| !self.board.is_paced()) else { return Ok(()) };
        let generation = self.charge_generation.get();
        self.wait_for(|| {
            let is_connected = (State::Wired..=State::Running).contains(&tap.state());
            Ok((!is_connected || tap.has_welcomed(generation)).then_some(()))
        })
    }

    /// Waits until its time has come: a standby, until whoever is in charge is lost or behind; any other asks
    /// for room and waits until there is nobody. Returns the process that is to be fenced.
    pub(crate) fn wait_for_vacancy(&self, pace: Option<&Pace>) -> Result<Option<ProcessIdentity>, TickError> {
        let slot = self.slot();
        // While it was set up another may have come first.
        let is_second = self.entry == Entry::Enlist && (slot.living_owner().is_some() || slot.is_reserved());
        if self.entry == Entry::Standby || is_second {
            return self.stand_by(pace);
        }
        if slot.living_owner().is_some() {
            slot.ask_to_retire();
        }
        self.wait_at_porch(|| slot.living_owner().is_none())?;
        Ok(None)
    }

    fn stand_by(&self, pace: Option<&Pace>) -> Result<Option<ProcessIdentity>, TickError> {
        let slot = self.slot();
        let mut suspicion = pace.map(|pace| Suspicion::new(pace.period_ns, pace.lag_ticks()));
        let world = self.slot_of(Role::Service(ServiceId::Bridge));
        slot.set_standby(ProcessIdentity::own().map_err(|_| TickError::Aborted)?);
        loop {
            let look_in_ns = suspicion.as_ref().map_or(LEAST_LOOK_NS, Suspicion::next_look_ns);
            let look_ns = now_ns().saturating_add(look_in_ns);
            // Whoever makes room does so for another, who is ready; unless that is lost, too.
            let is_vacant =
                || !slot.is_reserved() && (slot.process().is_none() || self.has_exited(self.slot));
            let gone = || is_vacant().then_some(());
            let is_gone = self.wait_beside(Some(look_ns), || Ok(gone()))?.is_some();
            if slot.state() == State::Done || self.board.stop_is_requested() {
                return Err(TickError::Stopped);
            }
            if is_gone {
                return Ok(None);
            }
            let is_to_work = matches!(slot.state(), State::Running | State::Retired) && !slot.is_reserved();
            let at = slot.position();
            let world_at = if is_to_work { world.map_or(at, Slot::position) } else { at };
            if suspicion.as_mut().is_some_and(|suspicion| suspicion.is_confirmed(at, world_at)) {
                return Ok(slot.process());
            }
        }
    }

    /// Leaves its place to whoever of this host stands by for it.
    pub(crate) fn vacate(&self) {
        let slot = self.slot();
        if self.is_in_charge() && slot.process() == ProcessIdentity::own().ok() {
            slot.vacate();
        }
        slot.set_reserved(false);
        self.board.wake_all();
    }

    /// Takes the place from whoever of this host has it: it is fenced, and ends.
    pub(crate) fn seize(&self) -> Result<(), JoinError> {
        let slot = self.slot();
        slot.set_reserved(true);
        self.take_charge(slot.position(), slot.process())
    }

    /// Waits beside the bed that whoever is in charge sleeps in.
    fn wait_at_porch(&self, is_over: impl Fn() -> bool) -> Result<(), TickError> {
        self.wait_beside(None, || Ok(is_over().then_some(()))).map(|_| ())
    }

    fn wait_beside(
        &self,
        due_ns: Option<u64>,
        poll: impl Fn() -> Result<Option<()>, TickError>,
    ) -> Result<Option<()>, TickError> {
        pulse::beat();
        let check = |_| {
            pulse::beat();
            if self.board.stop_is_requested() { Err(TickError::Stopped) } else { Ok(()) }
        };
        self.slot().porch.wait(self.policy, due_ns, poll, Meanwhile::NOTHING, check)
    }

    pub(crate) fn is_in_charge(&self) -> bool {
        self.slot().epoch() == self.epoch()
    }

    /// Makes room for its successor, and stays until that is in charge: what it has published may still be
    /// on its way.
    pub(crate) fn retire(&self) -> Result<(), TickError> {
        self.enter(State::Retired);
        self.wait_at_porch(|| !self.is_in_charge())
    }

    /// What is to be done, at the latest in its next wait, when a process has taken another one's place.
    pub(crate) fn on_successor(&self, action: impl Fn() + 'static) {
        *self.on_successor.borrow_mut() = Some(Box::new(action));
    }

    /// Says that it has ended as it should.
    pub fn conclude(&self) {
        self.enter(State::Done);
    }

    /// Says why it ends early, and ends the waits of all others; unless another process is in charge, whose
    /// business that is.
    pub fn fail(&self, error: &TickError) {
        if !self.is_in_charge() {
            return;
        }
        self.slot().set_fault(error);
        self.enter(State::Failed);
        // What becomes of the tap is nobody's concern.
        if self.role != Role::Tap {
            self.board.raise_alarm();
        }
    }

    pub(crate) fn slot(&self) -> &Slot {
        &self.board.slots()[self.slot]
    }

    pub(crate) fn slot_of(&self, role: Role) -> Option<&Slot> {
        self.board.index_of(role).map(|index| &self.board.slots()[index])
    }

    pub(crate) fn enter(&self, state: State) {
        self.slot().set_state(state);
        self.board.wake_all();
    }

    /// Enters a phase. At the start of a tick it looks whether the run goes on, and with whom.
    pub(crate) fn begin_phase(&self, at: Position) -> Result<(), TickError> {
        pulse::beat();
        if self.is_in_charge() {
            self.slot().set_position(at);
            self.slot().set_allocations(allocations());
        }
        let Position { tick, phase } = at;
        if phase > 0 {
            return Ok(());
        }
        if !self.is_in_charge() {
            return Err(TickError::Fenced);
        }
        if self.slot().is_asked_to_retire() {
            return Err(TickError::Retired);
        }
        if self.board.alarm_is_raised() || tick % LOOK_AROUND_TICKS == LOOK_AROUND_TICKS - 1 {
            return self.look_around();
        }
        Ok(())
    }

    /// Enters a state and waits until all services, and the tap if there is one, have come as far.
    pub(crate) fn meet(&self, state: State) -> Result<(), TickError> {
        self.enter(state);
        let goes_on_without = |index| self.board.is_paced() && self.has_exited(index);
        self.wait_for(|| {
            let mut slots = self.board.slots().iter().enumerate();
            let all_met = slots.all(|(index, slot)| match (slot.role(), slot.state()) {
                (Some(Role::Service(_)), State::Failed) => self.board.is_paced(),
                (Some(Role::Service(_)), other) if other < state && goes_on_without(index) => true,
                (Some(Role::Service(_)), other) => other >= state,
                // It may stay when all services have gone: what they sent is still to be read.
                (Some(Role::Tap), other) => state == State::Done || other == State::Absent || other >= state,
                _ => true,
            });
            Ok(all_met.then_some(()))
        })
    }

    /// Waits while the tap is attached and has consumed less than this many ticks.
    pub(crate) fn wait_for_tap(&self, ticks: u64) -> Result<(), TickError> {
        let Some(tap) = self.slot_of(Role::Tap) else { return Ok(()) };
        self.wait_for(|| {
            let attached = (State::Starting..=State::Running).contains(&tap.state());
            Ok((!attached || tap.position().tick >= ticks).then_some(()))
        })
    }

    /// Begins a tick at its time. If that is more than a period ago, all that follows is later by as much: a
    /// world that stood still does not hurry afterwards.
    /// Returns that time.
    pub(crate) fn begin_tick(&self, pace: &Pace, tick: u64) -> u64 {
        let now_ns = now_ns();
        match self.board.origin_ns() {
            Some(origin_ns) => {
                let origin_ns = match self.board.master_origin_ns() {
                    Some(master_ns) => {
                        let trimmed_ns = trimmed_origin_ns(origin_ns, master_ns, pace.period_ns);
                        self.board.set_origin_ns(trimmed_ns);
                        trimmed_ns
                    }
                    None => origin_ns,
                };
                let start_ns = pace.start_ns(origin_ns, tick);
                if now_ns > start_ns.saturating_add(pace.period_ns) {
                    self.board.set_origin_ns(origin_ns.saturating_add(now_ns - start_ns));
                } else {
                    sleep_until(start_ns.saturating_sub(self.policy.up_early.as_nanos() as u64));
                    yield_until(start_ns);
                }
                start_ns
            }
            None => {
                self.board.set_origin_ns(now_ns.saturating_sub(pace.start_ns(0, tick)).max(1));
                now_ns
            }
        }
    }

    /// Polls until it returns something, and sleeps in between.
    ///
    /// # Errors
    /// Those of `poll`; a service or the supervisor is gone; the run is to stop.
    pub(crate) fn wait_for<T>(
        &self,
        mut poll: impl FnMut() -> Result<Option<T>, TickError>,
    ) -> Result<T, TickError> {
        loop {
            if let Some(found) = self.wait_until(&self.slot().bed, None, &mut poll, Meanwhile::NOTHING)? {
                return Ok(found);
            }
        }
    }

    /// As [`Member::wait_for`], in this bed; at `due_ns`, if there is such a time, the wait ends with nothing. What
    /// can be done `meanwhile` is, once, if it has to wait at all.
    pub(crate) fn wait_until<T>(
        &self,
        bed: &Bed,
        due_ns: Option<u64>,
        mut poll: impl FnMut() -> Result<Option<T>, TickError>,
        meanwhile: Meanwhile<impl FnOnce()>,
    ) -> Result<Option<T>, TickError> {
        let poll = || {
            self.welcome_successors();
            poll()
        };
        bed.wait(self.policy, due_ns, poll, meanwhile, |woken| {
            pulse::beat();
            if !self.is_in_charge() {
                return Err(TickError::Fenced);
            }
            if woken == Woken::TimedOut || self.board.alarm_is_raised() { self.look_around() } else { Ok(()) }
        })
    }

    /// Connects to those who have taken charge since it last looked, and tells them.
    pub(crate) fn welcome_successors(&self) {
        let generation = self.board.generation();
        if self.generation.replace(generation) != generation
            && let Some(action) = &*self.on_successor.borrow()
        {
            action();
            // They were given what was kept for them.
            self.slot().ring_all();
            self.slot().welcome(generation);
            self.board.wake_all();
        }
    }

    /// Whether all services that live are connected to it since it is in charge.
    pub(crate) fn is_welcome(&self) -> bool {
        let generation = self.charge_generation.get();
        self.board.slots().iter().enumerate().all(|(index, slot)| match slot.role() {
            Some(Role::Service(_)) => {
                slot.has_welcomed(generation) || slot.state().has_ended() || self.has_exited(index)
            }
            _ => true,
        })
    }

    /// Whether all services have said that they have ended.
    pub(crate) fn all_services_have_ended(&self) -> bool {
        self.board.slots().iter().all(|slot| match slot.role() {
            Some(Role::Service(_)) => slot.state().has_ended(),
            _ => true,
        })
    }

    /// Looks whether the run goes on. A death that nobody announced is named first: it is the cause of
    /// what others announce.
    fn look_around(&self) -> Result<(), TickError> {
        if self.board.is_paced() {
            return self.look_at_world();
        }
        let mut failed: Option<(bool, ServiceId)> = None;
        let mut supervisor_is_lost = false;
        for (index, slot) in self.board.slots().iter().enumerate() {
            if index == self.slot {
                continue;
            }
            // Whether it has exited is asked before its state: one that is done says so before it exits.
            let has_exited = self.has_exited(index);
            match (slot.role(), slot.state()) {
                (_, State::Absent | State::Retired | State::Done) | (None, _) => {}
                (Some(Role::Service(service)), State::Failed) => {
                    let is_consequence = slot.fault_code() == Some(FaultCode::PeerLost);
                    failed = failed.into_iter().chain([(is_consequence, service)]).min();
                }
                // Its successor is on the way, unless nobody is there who sends it: the supervisor comes first.
                (Some(Role::Service(_)), _)
                    if has_exited && self.board.succession_is_promised() && !supervisor_is_lost => {}
                (Some(Role::Service(service)), _) if has_exited => return Err(TickError::PeerLost(service)),
                // The run goes on: another may adopt it.
                (Some(Role::Supervisor), state) => supervisor_is_lost = has_exited || state == State::Failed,
                (Some(Role::Tap), state) if has_exited && state < State::Done => {
                    slot.set_state(State::Failed)
                }
                _ => {}
            }
        }
        match failed {
            _ if supervisor_is_lost && !self.has_begun() => Err(TickError::SupervisorLost),
            _ if self.board.stop_is_requested() => Err(TickError::Stopped),
            Some((_, service)) => Err(TickError::PeerLost(service)),
            None => Ok(()),
        }
    }

    /// Where ticks are paced by the clock the run goes on without anybody but the world.
    fn look_at_world(&self) -> Result<(), TickError> {
        if self.board.stop_is_requested() {
            return Err(TickError::Stopped);
        }
        let supervisor = self.board.index_of(Role::Supervisor);
        if !self.has_begun() && supervisor.is_some_and(|index| self.has_exited(index)) {
            return Err(TickError::SupervisorLost);
        }
        let world = ServiceId::Bridge;
        let Some(index) = self.board.index_of(Role::Service(world)).filter(|index| *index != self.slot)
        else {
            return Ok(());
        };
        // Whether it has exited is asked before its state: one that is done says so before it exits.
        let has_exited = self.has_exited(index) && !self.board.succession_is_promised();
        match self.board.slots()[index].state() {
            State::Failed => Err(TickError::PeerLost(world)),
            State::Absent | State::Retired | State::Done => Ok(()),
            _ if has_exited => Err(TickError::PeerLost(world)),
            _ => Ok(()),
        }
    }

    /// Whether there is something to go on with: before its first tick a run without a supervisor, who may not have
    /// started all others, comes to nothing.
    fn has_begun(&self) -> bool {
        !self.is_first || self.slot().state() >= State::Running
    }

    /// Whether a process had this slot and is gone.
    fn has_exited(&self, index: usize) -> bool {
        let Some(process) = self.board.slots()[index].process() else { return false };
        let mut watches = self.watches.borrow_mut();
        let watch = &mut watches[index];
        if watch.as_ref().map(ProcessWatch::identity) != Some(process) {
            *watch = Some(ProcessWatch::new(process));
        }
        watch.as_ref().is_some_and(ProcessWatch::has_exited)
    }

    /// Opens what is needed to see others die, so that no wait has to.
    pub(crate) fn watch_all(&self) {
        for index in 0..self.board.slots().len() {
            self.has_exited(index);
        }
    }
}

impl Drop for Member {
    fn drop(&mut self) {
        let state = self.slot().state();
        if !state.has_ended() && state != State::Retired {
            self.fail(&TickError::Aborted);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_who_enlist_one_is_in_charge_and_both_are_heard_to_live() {
        let run = tempfile::tempdir().expect("a directory");
        Board::create(run.path(), &[ServiceId::Bridge], false).expect("a board");
        let enlist = || {
            let role = Role::Service(ServiceId::Bridge);
            Member::join(run.path(), role, WaitPolicy::default(), Entry::Enlist).expect("a place")
        };
        let (first, second) = (enlist(), enlist());
        assert_eq!((first.epoch(), first.is_successor()), (1, false));
        assert_eq!((second.epoch(), second.is_successor()), (0, true));
        let before = pulse::beats();
        first.begin_phase(Position { tick: 7, phase: 0 }).expect("it is in charge");
        assert!(pulse::beats() > before);
        assert_eq!(second.begin_phase(Position { tick: 7, phase: 0 }), Err(TickError::Fenced));
        // Whoever is in charge stops: a wait of the other ends, and each look is a beat.
        let before = pulse::beats();
        second.board.request_stop();
        assert_eq!(second.wait_for_vacancy(None), Err(TickError::Stopped));
        assert!(pulse::beats() > before);
        first.conclude();
    }
}
