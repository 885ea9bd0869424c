//! The ports of a process that carries frames to other hosts, and of the places that it holds for services there.

use super::calls::Source;
use super::{IceoryxTransport, OpenError, Process};
use crate::board::{Board, Doorbell, Role, State};
use crate::checkpoint;
use crate::member::{Entry, JoinError, Member};
use crate::pace::now_ns;
use crate::pulse;
use crate::transport::accept::{Verdict, judge};
use crate::transport::{ConnectError, consumer_depth};
use crate::wait::{Meanwhile, WaitPolicy};
use crate::{Clock, Position, TickError, TickSchedule, Topic};
use core::cell::Cell;
use iceoryx2::port::subscriber::Subscriber as IceoryxSubscriberPort;
use iceoryx2::prelude::ipc;
use mikoshi_ipc_types::{Frame, Payload, ServiceId};
use std::path::Path;
use std::rc::Rc;

/// Why a link has no ports, or holds no places.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// It has no place in the run.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// The run's domain or iceoryx2 can't be used.
    #[error(transparent)]
    Open(#[from] OpenError),
}

/// The ports of a run's link.
pub struct IceoryxLink {
    process: Rc<Process>,
}

impl IceoryxLink {
    /// Takes the link's place in the run of this directory.
    ///
    /// # Errors
    /// There is no such place, or a living process has it; iceoryx2 can't be used.
    pub fn open(run: &Path, policy: WaitPolicy, schedule: &TickSchedule) -> Result<Self, LinkError> {
        let member = Member::join(run, Role::Link, policy, Entry::Vacant)?;
        Ok(Self { process: Process::open(run, member, schedule)? })
    }

    /// The board of the run.
    pub fn board(&self) -> &Board {
        self.process.member.board()
    }

    /// What a service of this host publishes of `P`.
    ///
    /// # Errors
    /// Nobody publishes it; the transport has no room for it.
    pub fn outlet<P: Payload>(&self, robot: usize) -> Result<Outlet<P>, ConnectError> {
        let (topic, process) = (Topic::of::<P>(robot), &self.process);
        let source = process.source_of(topic).ok_or(ConnectError::NotPublished { topic })?;
        let depth = consumer_depth(&process.schedule, topic);
        let port = process.subscribe(topic, depth, depth)?;
        Ok(Outlet {
            process: Rc::clone(process),
            port,
            topic,
            source,
            bell: Doorbell::default(),
            arrived: Box::new(Frame::zeroed()),
        })
    }

    /// Connects all its ports to those of others, once these are there, and touches their memory.
    ///
    /// # Errors
    /// Shared memory is full.
    pub fn connect(&self) -> Result<(), TickError> {
        self.process.connect();
        self.process.touch()
    }

    /// Polls until it returns something, and sleeps in between; with nothing, at `due_ns`.
    ///
    /// # Errors
    /// Those of `poll`; the run is to stop, or has lost a process that it can't do without.
    pub fn wait<T>(
        &self,
        due_ns: Option<u64>,
        poll: impl FnMut() -> Result<Option<T>, TickError>,
    ) -> Result<Option<T>, TickError> {
        // There may be something to do in every turn: then it never waits.
        pulse::beat();
        let member = &self.process.member;
        member.wait_until(&member.slot().bed, due_ns, poll, Meanwhile::NOTHING)
    }

    /// Says how far it is.
    pub fn enter(&self, state: State) {
        self.process.member.enter(state);
    }

    /// Says which tick the world is in.
    pub fn set_tick(&self, tick: u64) {
        self.process.member.slot().set_position(Position { tick, phase: 0 });
    }

    /// Says that by the clock of the team, which is on another host, this tick begins now: the bridge of this host
    /// comes nearer to it.
    pub fn trim_to(&self, tick: u64) {
        if let Clock::Wall { period_ns } = self.process.schedule.clock() {
            let since_ns = tick.saturating_mul(period_ns);
            self.board().set_master_origin_ns(now_ns().saturating_sub(since_ns).max(1));
        }
    }

    /// Ends the run of this host early.
    pub fn fail(&self, error: &TickError) {
        self.process.member.fail(error);
    }

    /// Says that it has ended as it should.
    pub fn conclude(&self) {
        self.process.member.conclude();
    }
}

/// Wakes a link that waits, from any thread of its process.
pub struct LinkBell {
    board: Board,
    slot: usize,
}

impl LinkBell {
    /// Of the link of the run in this directory.
    ///
    /// # Errors
    /// There is no board, or no place for a link on it.
    pub fn open(run: &Path) -> Result<Self, JoinError> {
        let board = Board::open(run)?;
        let slot = board.index_of(Role::Link).ok_or(JoinError::NoSuchRole(Role::Link))?;
        Ok(Self { board, slot })
    }

    /// The board of the run.
    pub fn board(&self) -> &Board {
        &self.board
    }

    /// Wakes it.
    pub fn ring(&self) {
        if let Some(slot) = self.board.slots().get(self.slot) {
            slot.bed.call_after_fence();
        }
    }
}

/// What a service of this host publishes, in order, by whoever is in charge of it.
pub struct Outlet<P: Payload> {
    process: Rc<Process>,
    port: Rc<IceoryxSubscriberPort<ipc::Service, Frame<P>, ()>>,
    topic: Topic,
    source: Source,
    bell: Doorbell,
    arrived: Box<Frame<P>>,
}

impl<P: Payload> Outlet<P> {
    /// The next frame, if there is one.
    ///
    /// # Errors
    /// It is of another schema or robot, or the transport fails. What is not finite goes on: who uses it counts it.
    pub fn take(&mut self) -> Result<Option<&Frame<P>>, TickError> {
        let Self { process, port, topic, source, bell, arrived } = self;
        let topic = *topic;
        let slot = process.slot_at(*source).ok_or(TickError::TransportFailed { topic })?;
        let receive = || port.receive().map_err(|_| TickError::TransportFailed { topic });
        while let Some(sample) = bell.answer(slot.bell(source.place), None, receive)? {
            **arrived = *sample.payload();
            drop(sample);
            let tick = arrived.envelope.tick;
            match judge(arrived, topic, source.phase, slot.charge(), tick) {
                Ok(Verdict::Use) | Err(TickError::NotFinite { .. }) => return Ok(Some(arrived)),
                Ok(Verdict::PassOver) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(None)
    }
}

/// The place of a service that lives on another host. Its words come over the network.
pub struct StandIn {
    transport: IceoryxTransport,
    /// Whether it has made room for a process of this host.
    has_left: Cell<bool>,
}

impl StandIn {
    /// Takes the place of this service in the run of this directory.
    ///
    /// # Errors
    /// A living process has it; iceoryx2 can't be used.
    pub fn take_place(
        run: &Path,
        service: ServiceId,
        policy: WaitPolicy,
        schedule: &TickSchedule,
    ) -> Result<Self, LinkError> {
        let member = Member::join(run, Role::Service(service), policy, Entry::Vacant)?;
        if member.is_successor() {
            member.take_charge(member.slot().position(), None)?;
        }
        Ok(Self { transport: IceoryxTransport::open(run, member, schedule)?, has_left: Cell::new(false) })
    }

    /// Makes ready to take the place of this service, which may come to live on another host: another has it.
    ///
    /// # Errors
    /// iceoryx2 can't be used.
    pub fn prepare(
        run: &Path,
        service: ServiceId,
        policy: WaitPolicy,
        schedule: &TickSchedule,
    ) -> Result<Self, LinkError> {
        let member = Member::join(run, Role::Service(service), policy, Entry::Standby)?;
        Ok(Self { transport: IceoryxTransport::open(run, member, schedule)?, has_left: Cell::new(false) })
    }

    /// Whether it has the place.
    pub fn is_in_place(&self) -> bool {
        let member = &self.transport.process.member;
        !self.has_left.get() && member.epoch() > 0 && member.is_in_charge()
    }

    /// Takes the place from whoever of this host has it, since the service is on another one now: a process that
    /// comes too late finds itself fenced, and what it kept is nobody's.
    ///
    /// # Errors
    /// Another process was first.
    pub fn seize(&self) -> Result<(), LinkError> {
        let process = &self.transport.process;
        process.member.seize()?;
        checkpoint::discard(&process.run, self.transport.service).map_err(JoinError::Proc)?;
        self.has_left.set(false);
        self.enter(State::Wired);
        Ok(())
    }

    /// Leaves the place to the process of this host that stands by for it.
    pub fn make_room(&self) {
        self.has_left.set(true);
        self.transport.process.member.vacate();
    }

    /// By which it publishes what came.
    pub fn ports(&self) -> &IceoryxTransport {
        &self.transport
    }

    /// Connects all its ports to those of others, once these are there, and touches their memory.
    ///
    /// # Errors
    /// Shared memory is full.
    pub fn connect(&self) -> Result<(), TickError> {
        self.transport.process.connect();
        self.transport.process.touch()
    }

    /// Says how far the service is.
    pub fn enter(&self, state: State) {
        self.transport.process.member.enter(state);
    }

    /// How far it was said to be.
    pub fn state(&self) -> State {
        self.transport.process.member.slot().state()
    }

    /// Says where the service is, and wakes those who sleep for what it has said.
    pub fn reach(&self, at: Position) {
        let process = &self.transport.process;
        process.call_sleepers();
        let slot = process.member.slot();
        if at > slot.position() {
            slot.set_position(at);
        }
    }

    /// Where it was said to be.
    pub fn position(&self) -> Position {
        self.transport.process.member.slot().position()
    }

    /// Connects to those who have taken charge on this host since it last looked.
    pub fn attend(&self) {
        self.transport.process.member.welcome_successors();
    }

    /// Says that this tick begins now: what is due in it is due by that. In lockstep nothing is.
    pub fn begin_tick(&self, tick: u64) {
        let process = &self.transport.process;
        if let Clock::Wall { period_ns } = process.schedule.clock() {
            let since_ns = tick.saturating_mul(period_ns);
            process.member.board().set_origin_ns(now_ns().saturating_sub(since_ns).max(1));
        }
    }

    /// Says why the service is lost.
    pub fn fail(&self, error: &TickError) {
        self.transport.process.member.fail(error);
    }

    /// Says that it has ended as it should.
    pub fn conclude(&self) {
        self.transport.process.member.conclude();
    }
}
