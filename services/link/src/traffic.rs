//! What goes to and fro between this host and the others, turn by turn.

use crate::gate::Counters;
use crate::latency::{Latencies, SentTimes};
use crate::peers::Peers;
use crate::ports::{Inlet, Outlet};
use crate::standby::Standby;
use crate::task::Task;
use core::sync::atomic::AtomicU64;
use core::time::Duration;
use mikoshi_ipc_types::{ServiceId, operator};
use mikoshi_runtime::{Board, Clock, IceoryxLink, Position, Role, StandIn, State, TickError, Topic, now_ns};
use std::collections::VecDeque;
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex};
use zenoh::Wait as _;
use zenoh::pubsub::Publisher;

/// By the clock: how often frames of the first tick are sent again. Nobody has anything to go on with before.
const FIRST_REPEATS: u8 = 20;
/// For how long those elsewhere are waited for in the end.
const LAST_WORDS: Duration = Duration::from_secs(2);
/// By the clock, to a host of which so long nothing was heard nothing is sent: it would come late, before what comes in
/// time.
const CUT: Duration = Duration::from_millis(250);
/// In lockstep, a host that says nothing for so long is lost.
const LOST: Duration = Duration::from_secs(10);

/// What goes out.
pub(crate) struct Outgoing {
    pub(crate) topic: Topic,
    /// Whose it is.
    pub(crate) service: ServiceId,
    pub(crate) outlet: Box<dyn Outlet>,
    pub(crate) destinations: Vec<Destination>,
    /// Whether its frames are the tick of the clock.
    pub(crate) is_beat: bool,
    /// Whether the coordinator answers it.
    pub(crate) is_answered: bool,
}

/// Where it goes.
pub(crate) struct Destination {
    pub(crate) host: usize,
    pub(crate) publisher: Publisher<'static>,
    /// Whether a service there waits for it, and not only an observer.
    pub(crate) is_awaited: bool,
}

/// What comes in.
pub(crate) struct Incoming {
    pub(crate) inlet: Box<dyn Inlet>,
    /// Whose place it is said in.
    pub(crate) stand_in: usize,
    pub(crate) phase: usize,
    pub(crate) arrived: Receiver<(u64, Vec<u8>)>,
}

/// What is counted of what comes from one service elsewhere.
pub struct Source {
    /// Which topic.
    pub topic: Topic,
    /// From which host.
    pub host: usize,
    /// What became of it.
    pub counters: Counters,
    /// The tick after that of the newest frame that was let through; 0 before. It is told before the frame is counted.
    pub next_tick: AtomicU64,
    /// How long it was on its way.
    pub latencies: Mutex<Latencies>,
    /// How long after what it answers was sent it came.
    pub round_trips: Mutex<Latencies>,
}

/// What was sent, and is to be sent again.
pub(crate) struct Again {
    pub(crate) due_ns: u64,
    /// By index: what, and where to.
    pub(crate) to: (usize, usize),
    pub(crate) message: Vec<u8>,
    pub(crate) left: u8,
}

/// All that a turn of its loop deals with.
pub(crate) struct Traffic<'a> {
    pub(crate) task: Task<'a>,
    pub(crate) stand_ins: Vec<(ServiceId, StandIn)>,
    pub(crate) outgoing: Vec<Outgoing>,
    pub(crate) incoming: Vec<Incoming>,
    /// Services for which this host or another stands by.
    pub(crate) standbys: Vec<Standby>,
    pub(crate) again: VecDeque<Again>,
    /// Where this host has the clock.
    pub(crate) beats: Option<Publisher<'static>>,
    /// The tick that is known here to have begun.
    pub(crate) begun: Option<u64>,
    /// Whether this host has the clock, and another one the bridge.
    pub(crate) is_pacing: bool,
    /// When tick 0 began, if so.
    pub(crate) origin_ns: Option<u64>,
    /// How often others have said "stop" that was said again here.
    pub(crate) stops: u64,
    pub(crate) peers: Arc<Peers>,
    pub(crate) sources: Vec<Arc<Source>>,
    pub(crate) sent: Arc<SentTimes>,
    pub(crate) is_connected: bool,
    pub(crate) since_done_ns: Option<u64>,
}

/// What came of a turn that did something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Turn {
    More,
    Last,
}

impl Traffic<'_> {
    /// Does all that is to be done; nothing if there was nothing.
    pub(crate) fn turn(&mut self, link: &IceoryxLink) -> Result<Option<Turn>, TickError> {
        for (_, stand_in) in self.in_place() {
            stand_in.attend();
        }
        self.settle(link.board())?;
        let has_sent = self.send_out(link.board())? | self.send_again();
        let has_said = self.begin_tick(link) | self.say()?;
        if self.follow(link)? {
            return Ok(Some(Turn::Last));
        }
        Ok((has_sent || has_said).then_some(Turn::More))
    }

    /// Those who hold the places of services elsewhere. A service that may move has one who waits, too.
    pub(crate) fn in_place(&self) -> impl Iterator<Item = &(ServiceId, StandIn)> {
        self.stand_ins.iter().filter(|(_, stand_in)| stand_in.is_in_place())
    }

    /// Settles who is in charge of what may move.
    fn settle(&mut self, board: &Board) -> Result<(), TickError> {
        let bridge = |(service, state)| (service == ServiceId::Bridge).then_some(state);
        let world = match self.peers.is_here(ServiceId::Bridge) {
            true => services_of(board).find_map(bridge),
            false => self.peers.state_of(ServiceId::Bridge),
        };
        let goes_on = world.map(|state| state >= State::Running);
        let is_by_the_clock = self.task.is_by_the_clock();
        for standby in &mut self.standbys {
            let stand_in = self.stand_ins.iter().find(|(service, _)| *service == standby.service);
            let stand_in = stand_in.map(|(_, stand_in)| stand_in);
            standby.settle(board, &self.peers, stand_in, goes_on, is_by_the_clock)?;
        }
        Ok(())
    }

    /// Sends what services of this host have published.
    fn send_out(&mut self, board: &Board) -> Result<bool, TickError> {
        let link = &self.task.run.scenario.link;
        let repeats = if self.task.is_by_the_clock() { link.repeats } else { 0 };
        let repeats_of = |tick: u64| if tick == 0 && repeats > 0 { FIRST_REPEATS } else { repeats };
        let after_ns = u64::from(link.repeat_after_us) * 1000;
        let Self { outgoing, peers, beats, again, sent, standbys, .. } = self;
        let mut has_sent = false;
        let by_the_clock = self.task.is_by_the_clock();
        for (index, outgoing) in outgoing.iter_mut().enumerate() {
            let Outgoing { service, outlet, destinations, is_beat, is_answered, .. } = outgoing;
            let is_here = peers.is_here(*service);
            let mut has_said = false;
            let mut send = |tick: u64, frame: &[&[u8]]| {
                if !is_here {
                    // It was said on another host, and again in its place.
                    return;
                }
                has_said = true;
                let header = peers.header();
                if *is_beat
                    && peers.reach(tick)
                    && let Some(beats) = beats
                {
                    put(beats, header.with(&[&tick.to_le_bytes()]));
                }
                if *is_answered {
                    sent.note(tick, now_ns());
                }
                let message = header.with(frame);
                for (number, Destination { host, publisher, is_awaited }) in destinations.iter().enumerate() {
                    let is_cut = || peers.silence_of(*host).is_none_or(|silence| silence > CUT);
                    if by_the_clock && is_cut() {
                        continue;
                    }
                    put(publisher, message.clone());
                    if *is_awaited && repeats > 0 {
                        let (due_ns, message) = (now_ns().saturating_add(after_ns), message.clone());
                        let left = repeats_of(tick);
                        again.push_back(Again { due_ns, to: (index, number), message, left });
                    }
                }
            };
            while outlet.take(&mut send)? {
                has_sent = true;
            }
            if has_said {
                let mut standbys = standbys.iter_mut().filter(|standby| standby.service == *service);
                standbys.try_for_each(|standby| standby.send_kept(board, peers))?;
            }
        }
        Ok(has_sent)
    }

    /// Sends again what may have been lost.
    fn send_again(&mut self) -> bool {
        let now_ns = now_ns();
        let mut has_sent = false;
        while self.again.front().is_some_and(|again| again.due_ns <= now_ns)
            && let Some(Again { to, message, left, .. }) = self.again.pop_front()
        {
            has_sent = true;
            if left > 1 {
                let after_ns = u64::from(self.task.run.scenario.link.repeat_after_us) * 1000;
                let (due_ns, message) = (now_ns.saturating_add(after_ns), message.clone());
                self.again.push_back(Again { due_ns, to, message, left: left - 1 });
            }
            put(&self.outgoing[to.0].destinations[to.1].publisher, message);
        }
        has_sent
    }

    /// When there is something to be done though nothing comes.
    pub(crate) fn due_ns(&self) -> Option<u64> {
        let again = self.again.front().map(|again| again.due_ns);
        again.into_iter().chain(self.next_beat().map(|(_, due_ns)| due_ns)).min()
    }

    /// Where this host has the clock, and another one the bridge: which tick is next, and when.
    fn next_beat(&self) -> Option<(u64, u64)> {
        let Clock::Wall { period_ns } = self.task.schedule.clock() else { return None };
        let tick = self.begun? + 1;
        Some((tick, self.origin_ns?.saturating_add(tick.saturating_mul(period_ns))))
    }

    /// Has the tick of the clock begin here, too.
    fn begin_tick(&mut self, link: &IceoryxLink) -> bool {
        if let Some((tick, _)) = self.next_beat().filter(|(_, due_ns)| now_ns() >= *due_ns) {
            self.peers.reach(tick);
            if let Some(beats) = &self.beats {
                put(beats, self.peers.header().with(&[&tick.to_le_bytes()]));
            }
        }
        let Some(tick) = self.peers.tick().filter(|tick| self.begun < Some(*tick)) else { return false };
        self.begun = Some(tick);
        match self.stand_ins.iter().find(|(service, _)| *service == ServiceId::Bridge) {
            Some((_, bridge)) => {
                bridge.begin_tick(tick);
                bridge.reach(Position { tick, phase: 0 });
            }
            None if self.beats.is_none() => link.trim_to(tick),
            None => return false,
        }
        true
    }

    /// Says here what those elsewhere have said.
    fn say(&mut self) -> Result<bool, TickError> {
        let mut has_said = false;
        for Incoming { inlet, stand_in, phase, arrived } in &mut self.incoming {
            let (_, stand_in) = &self.stand_ins[*stand_in];
            while let Ok((tick, frame)) = arrived.try_recv() {
                if !stand_in.is_in_place() {
                    continue;
                }
                inlet.publish(tick, &frame)?;
                if self.is_pacing && self.begun.is_none() {
                    // The clock begins with the world, and goes on by itself.
                    let period_ns = (self.task.run.scenario.wall_period_s() * 1e9) as u64;
                    self.origin_ns = Some(now_ns().saturating_sub(tick.saturating_mul(period_ns)));
                    self.peers.reach(tick);
                }
                stand_in.reach(Position { tick, phase: *phase });
                has_said = true;
            }
        }
        Ok(has_said)
    }

    /// For how long nothing was heard of the host of this service.
    fn silence_of(&self, service: ServiceId) -> Option<Duration> {
        self.peers.silence_of(self.peers.host_of(service)?)
    }

    /// Follows how far all are; whether the run has ended.
    fn follow(&mut self, link: &IceoryxLink) -> Result<bool, TickError> {
        let board = link.board();
        if self.peers.stops() != self.stops {
            self.stops = self.peers.stops();
            // On the coordinator's host alone somebody hears it.
            if self.peers.is_here(ServiceId::Coordinator) {
                board.say(operator::STOP);
            }
        }
        let all_are = |state: State| services_of(board).all(|(_, found)| found >= state);
        if !self.is_connected && all_are(State::Wired) {
            link.connect()?;
            self.stand_ins.iter().try_for_each(|(_, stand_in)| stand_in.connect())?;
            self.is_connected = true;
        }
        let is_by_the_clock = self.task.is_by_the_clock();
        let all_are_ready = all_are(State::Ready);
        for (service, stand_in) in self.in_place() {
            let elsewhere = self.peers.state_of(*service);
            let is_lost = elsewhere == Some(State::Failed)
                || self.silence_of(*service).is_some_and(|silence| silence > LOST);
            match (stand_in.state(), elsewhere) {
                (State::Done, _) => {}
                // By the clock one goes on without: it may come back.
                (_, Some(_)) if is_lost && !is_by_the_clock && self.since_done_ns.is_none() => {
                    return Err(TickError::PeerLost(*service));
                }
                (State::Wired, Some(State::Ready | State::Running | State::Done)) if self.is_connected => {
                    stand_in.enter(State::Ready);
                }
                (State::Ready, _) if all_are_ready => stand_in.enter(State::Running),
                (State::Running, Some(State::Done)) => stand_in.conclude(),
                _ => {}
            }
        }
        let lives_here = |service: ServiceId| self.in_place().all(|(other, _)| *other != service);
        let own: Vec<_> = services_of(board).filter(|(service, _)| lives_here(*service)).collect();
        if own.iter().any(|(_, state)| *state != State::Done) {
            return Ok(false);
        }
        let all_have_ended = self.in_place().all(|(_, stand_in)| stand_in.state() == State::Done);
        if own.is_empty() {
            // Who lived here has moved: nobody but the others says when all is over.
            return Ok(all_have_ended);
        }
        let since_ns = *self.since_done_ns.get_or_insert_with(now_ns);
        Ok(all_have_ended || u128::from(now_ns().saturating_sub(since_ns)) > LAST_WORDS.as_nanos())
    }
}

/// Sends it, or not: nothing that is lost is more than what the network loses.
fn put(publisher: &Publisher<'static>, message: Vec<u8>) {
    let _ = publisher.put(message).wait();
}

/// How far all are who have a place.
pub(crate) fn services_of(board: &Board) -> impl Iterator<Item = (ServiceId, State)> {
    board.states().filter_map(|(role, state)| match role {
        Role::Service(service) => Some((service, state)),
        _ => None,
    })
}
