//! Services for which another host stands by: what a successor there needs is sent to it, and who is in charge is
//! settled.
//!
//! ```text
//!            its own host                              the host that stands by
//! begins     reserved, until the run is known          reserved
//!            to be new, or a checkpoint has come
//! goes on    in charge: sends what it keeps       ──▶  keeps it
//! is lost    nobody                                    the coordinator: most hosts have lost the other: takes over
//! comes back the coordinator: its process is fenced,   in charge: sends what it keeps
//!            and it stands by from now on
//! is new     a robot: waits for the checkpoint    ◀──  gives back what it has kept
//! ```

use crate::carry::subscribe;
use crate::checkpoint::{Judge, Now, message};
use crate::gate::{Counters, Refusal};
use crate::keys::Keys;
use crate::peers::Peers;
use crate::session::SessionError;
use crate::task::Task;
use core::sync::atomic::{AtomicU64, Ordering};
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{
    Board, Checkpoint, CheckpointCopy, LinkBell, StandIn, State, TickError, kept_by, now_ns,
};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::{Session, Wait as _};

/// Checkpoints that may wait to be kept.
const QUEUE: usize = 4;
/// How often what a robot's servo keeps is sent: nobody takes over from it at once, and it shares its way with frames.
const SERVO_AGAIN_NS: u64 = 100_000_000;
/// How often what was kept is given back to a host that waits for it.
const GIVE_AGAIN_NS: u64 = 100_000_000;

/// A service that has a standby, on one of its two hosts.
pub(crate) struct Standby {
    pub(crate) service: ServiceId,
    /// The other of them.
    other: usize,
    /// Whether it may be in charge on either.
    has_two_places: bool,
    run: PathBuf,
    publisher: Publisher<'static>,
    copy: CheckpointCopy,
    arrived: Receiver<Checkpoint>,
    kept: Arc<Kept>,
    /// One past the tick of what was sent last.
    next_tick: u64,
    sent_ns: u64,
}

/// What is counted of what comes.
pub struct Kept {
    /// Whose.
    pub service: ServiceId,
    /// From which host.
    pub host: usize,
    /// What became of it.
    pub counters: Counters,
    /// One past the tick of what is held; 0 if nothing is.
    pub next_tick: AtomicU64,
}

impl Standby {
    /// For this service on one of its hosts, and who listens to the other one.
    pub(crate) fn open(
        task: &Task<'_>,
        service: ServiceId,
        session: &Session,
        keys: &Keys,
        publisher: Publisher<'static>,
        peers: &Arc<Peers>,
        bell: LinkBell,
    ) -> Result<Option<(Self, Subscriber<()>)>, SessionError> {
        let Some(other) = task.other_host_of(service) else { return Ok(None) };
        let copy = CheckpointCopy::new(task.directory, service);
        let held = copy.latest().map_err(|error| SessionError::of(service.to_string(), error))?;
        let next_tick = held.as_ref().map_or(0, |held| held.position.tick + 1);
        let kept = Arc::new(Kept {
            service,
            host: other,
            counters: Counters::default(),
            next_tick: AtomicU64::new(next_tick),
        });
        let (sender, arrived) = sync_channel(QUEUE);
        let judge = Mutex::new(Judge { last: held.map(|held| held.position) });
        let (peers, counted) = (Arc::clone(peers), Arc::clone(&kept));
        let hear = move |sample: zenoh::sample::Sample| {
            let waits = peers.is_here(service) && bell.board().is_reserved(service);
            let now = Now {
                run: peers.run(),
                incarnation: peers.incarnation_of(other),
                is_entitled: waits || peers.host_of(service) == Some(other),
                tick: peers.tick().unwrap_or_default(),
            };
            let mut judge = judge.lock().unwrap_or_else(PoisonError::into_inner);
            let judged = judge.judge(&sample.payload().to_bytes(), now).and_then(|checkpoint| {
                sender.try_send(checkpoint).map_err(|error| match error {
                    TrySendError::Full(_) | TrySendError::Disconnected(_) => Refusal::Flood,
                })
            });
            counted.counters.count(&judged);
            if judged.is_ok() {
                bell.ring();
            }
        };
        let subscriber = subscribe(session, &keys.of_checkpoint(service, other, task.host), hear)?;
        let standby = Self {
            service,
            other,
            has_two_places: task.run.scenario.places_of(service).count() > 1,
            run: task.directory.to_path_buf(),
            publisher,
            copy,
            arrived,
            kept,
            next_tick: 0,
            sent_ns: 0,
        };
        Ok(Some((standby, subscriber)))
    }

    /// What is counted.
    pub(crate) fn kept(&self) -> &Arc<Kept> {
        &self.kept
    }

    fn send(&mut self, peers: &Peers, checkpoint: &Checkpoint) {
        // What is lost is as if the next one had come: it is droppable.
        let _ = self.publisher.put(message(&peers.header(), checkpoint)).wait();
        self.next_tick = checkpoint.position.tick + 1;
        self.sent_ns = now_ns();
    }

    /// Sends what the service of this host has kept before it said something in this tick.
    pub(crate) fn send_kept(&mut self, board: &Board, peers: &Peers) -> Result<(), TickError> {
        let (epoch, _) = board.charge_of(self.service).unwrap_or_default();
        let at = board.last_position(self.service).unwrap_or_default();
        if at.tick < self.next_tick || !peers.is_here(self.service) || board.is_reserved(self.service) {
            return Ok(());
        }
        if !self.has_two_places && now_ns() < self.sent_ns.saturating_add(SERVO_AGAIN_NS) {
            return Ok(());
        }
        let kept = kept_by(&self.run, self.service, epoch);
        let kept = kept.map_err(|_| TickError::Checkpoint("it can't be read"))?;
        if let Some(kept) = kept.filter(|kept| kept.position.tick >= self.next_tick) {
            self.send(peers, &kept);
        }
        Ok(())
    }

    /// Settles who of this host is in charge; `goes_on` says whether the run has begun, if that is known.
    pub(crate) fn settle(
        &mut self,
        board: &Board,
        peers: &Peers,
        stand_in: Option<&StandIn>,
        goes_on: Option<bool>,
        is_by_the_clock: bool,
    ) -> Result<(), TickError> {
        while let Ok(checkpoint) = self.arrived.try_recv() {
            self.copy.keep(&checkpoint).map_err(|_| TickError::SharedMemoryFull)?;
            self.kept.next_tick.store(checkpoint.position.tick + 1, Ordering::Release);
        }
        board.set_moves(self.service, peers.moves_of(self.service));
        let holds = self.kept.next_tick.load(Ordering::Acquire) > 0;
        match (peers.is_here(self.service), stand_in) {
            (true, _) if board.is_reserved(self.service) => {
                // A run that goes on has no place for one that would begin it anew.
                if goes_on == Some(false) || goes_on == Some(true) && holds {
                    make_room(board, self.service, stand_in);
                }
            }
            (true, _) => {}
            (false, Some(stand_in)) if self.has_two_places && !stand_in.is_in_place() => {
                stand_in.seize().map_err(|_| TickError::Service("the place can't be taken"))?;
                self.kept.next_tick.store(0, Ordering::Release);
                self.next_tick = 0;
            }
            (false, Some(_)) if self.has_two_places => {
                let can_take_over = is_by_the_clock && holds && goes_on == Some(true);
                if can_take_over && board.has_standby(self.service) && peers.is_lost(self.other) {
                    peers.take_over(self.service);
                    board.set_moves(self.service, peers.moves_of(self.service));
                    make_room(board, self.service, stand_in);
                }
            }
            (false, _) => {}
        }
        match peers.is_here(self.service) {
            true => Ok(()),
            false => self.give_back(peers, goes_on),
        }
    }

    /// Gives what is kept here to a host of the service that has to go on from it, and has not got it.
    fn give_back(&mut self, peers: &Peers, goes_on: Option<bool>) -> Result<(), TickError> {
        let waits = peers.state_of(self.service).is_some_and(|state| state < State::Running);
        if goes_on != Some(true) || !waits || now_ns() < self.sent_ns.saturating_add(GIVE_AGAIN_NS) {
            return Ok(());
        }
        let latest = self.copy.latest().map_err(|_| TickError::Checkpoint("the copy can't be read"))?;
        if let Some(latest) = latest {
            self.send(peers, &latest);
        }
        Ok(())
    }
}

fn make_room(board: &Board, service: ServiceId, stand_in: Option<&StandIn>) {
    match stand_in {
        Some(stand_in) => stand_in.make_room(),
        None => board.admit(service),
    }
}
