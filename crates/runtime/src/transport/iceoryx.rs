//! Frames over iceoryx2, between the processes of a run.
//!
//! Data travels in iceoryx2's shared memory; waiting and waking happen on the run's board, since a
//! publisher that finds nobody asleep then makes no system call.

mod calls;
mod link;
mod outbox;

pub use link::{IceoryxLink, LinkBell, LinkError, Outlet, StandIn};

use super::accept::{Verdict, judge};
use super::{
    ConnectError, Loan, OBSERVER_DEPTH, Observer, OperatorPort, Publisher, Subscriber, Tap, Transport,
    consumer_depth,
};
use crate::board::{Doorbell, Role, State};
use crate::checkpoint::{self, Checkpoint, CheckpointWriter};
use crate::member::{Member, TAP_LEAD_TICKS};
use crate::pace::{Pace, now_ns};
use crate::shared_memory::populate;
use crate::wait::Meanwhile;
use crate::{
    Clock, Domain, DomainError, Phase, Position, Replaceable, Session, TickError, TickSchedule, Topic,
};
use calls::{Awaited, Source, is_gathering};
use core::cell::{Cell, RefCell};
use iceoryx2::port::LoanError;
use iceoryx2::port::subscriber::Subscriber as IceoryxSubscriberPort;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{LogLevel, Node, NodeBuilder, SignalHandlingMode, ipc, set_log_level};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use mikoshi_ipc_types::{Envelope, Frame, Payload, ServiceId, ServicePayload};
use outbox::{Blank, Outbox, Restock};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Processes that may publish a topic at a time: the one in charge, a standby, one that is to be swapped in, and
/// two predecessors that are frozen and still hold their places.
const MAX_PUBLISHERS: usize = 5;
/// Processes that may wait for a topic at a time, for the same reasons. By the schedule a topic has at
/// most one service that waits for it.
const MAX_CONSUMERS: usize = MAX_PUBLISHERS;
/// The tap, and its successor if it is frozen.
const MAX_TAPS: usize = 2;
/// Whoever has a port, and somebody who looks.
const MAX_NODES: usize = MAX_PUBLISHERS + MAX_CONSUMERS + MAX_TAPS + 2;
/// Who speaks of a later tick is not believed.
const FURTHEST_TICKS: u64 = 100_000;
/// Frames are copied out of shared memory at once.
const MAX_BORROWED: usize = 1;
/// A frame is filled and sent before the next is loaned.
const MAX_LOANED: usize = 1;

/// Frames that one publisher needs room for: what all queues hold, what receivers borrow, what is kept
/// for successors, and what is being filled.
fn frames_of_publisher(schedule: &TickSchedule, topic: Topic) -> usize {
    let depth = consumer_depth(schedule, topic);
    MAX_CONSUMERS * (depth + MAX_BORROWED) + MAX_TAPS * (OBSERVER_DEPTH + MAX_BORROWED) + depth + MAX_LOANED
}

/// Shared memory that a run of this schedule needs: its frames, and room for what iceoryx2 keeps of
/// every port and connection.
pub fn required_bytes(schedule: &TickSchedule) -> u64 {
    /// A topic with one consumer and one tap keeps four files beside its frames, a page each; successors
    /// and nodes add to them.
    const OVERHEAD_BYTES: usize = 64 << 10;
    /// Of a sample: iceoryx2's header and alignment.
    const HEADER_BYTES: usize = 64;
    let publishers = match schedule.clock() {
        Clock::Lockstep => 1,
        // With a standby.
        Clock::Wall { .. } => 2,
    };
    schedule
        .outputs()
        .map(|(_, output)| {
            let frame = output.size_bytes + size_of::<Envelope>() + HEADER_BYTES;
            (publishers * (frames_of_publisher(schedule, output.topic) * frame + OVERHEAD_BYTES)) as u64
        })
        .sum()
}

/// Why a process has no ports.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The run's domain can't be used.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// iceoryx2 can't be used.
    #[error("iceoryx2 can't be used in {path}: {reason}")]
    Node {
        /// The run's directory.
        path: String,
        /// What it says.
        reason: String,
    },
}

/// What all ports of a process share.
pub(super) struct Process {
    node: Node<ipc::Service>,
    member: Member,
    schedule: TickSchedule,
    /// Where ticks are paced by the clock.
    pace: Option<Pace>,
    /// When the current phase is due: it begins then, or has heard its inputs.
    due_ns: Cell<Option<u64>>,
    /// When the last input came, or was given up, and when what came of it was kept.
    heard_ns: Cell<u64>,
    kept_ns: Cell<u64>,
    /// What was sent since sleepers were called, and how many frames that services wait for.
    unsaid: Cell<Option<Source>>,
    sent: Cell<usize>,
    run: PathBuf,
    domain: Domain,
    ports: Ports,
    /// What sends the frames that services wait for: they are restocked while it waits itself.
    outboxes: RefCell<Vec<Rc<dyn Restock>>>,
    /// Where the link sleeps, if there is one.
    link: Option<usize>,
}

/// All ports of a process, to be connected before the first tick and whenever a process has taken another
/// one's place: what a publisher has kept for latecomers they get when it looks who is there.
#[derive(Clone, Default)]
struct Ports(Rc<RefCell<Vec<Rc<dyn UpdateConnections>>>>);

impl Ports {
    fn connect(&self) {
        for port in self.0.borrow().iter() {
            // A port that can't be connected now tries again at its next frame, and fails there.
            let _ = port.update_connections();
        }
    }
}

impl Process {
    fn open(run: &Path, member: Member, schedule: &TickSchedule) -> Result<Rc<Self>, OpenError> {
        // Nothing but our own words on standard output; what iceoryx2 reports comes back as errors.
        set_log_level(LogLevel::Fatal);
        let domain = Domain::of(run);
        let mut config = domain.config()?;
        // A successor makes room for its ports.
        config.global.node.cleanup_dead_nodes_on_creation = member.is_successor() || member.epoch() > 1;
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|error| OpenError::Node {
                path: run.display().to_string(),
                reason: error.to_string(),
            })?;
        domain.close_to_others().map_err(DomainError::NoSharedMemory)?;
        let ports = Ports::default();
        let to_connect = ports.clone();
        member.on_successor(move || to_connect.connect());
        let run = run.to_path_buf();
        let pace = match member.role() {
            Role::Service(service) => Pace::of(schedule, service),
            Role::Supervisor | Role::Tap | Role::Link => None,
        };
        let link = member.board().index_of(Role::Link);
        Ok(Rc::new(Self {
            node,
            link,
            member,
            schedule: schedule.clone(),
            pace,
            due_ns: Cell::new(None),
            heard_ns: Cell::default(),
            kept_ns: Cell::default(),
            unsaid: Cell::new(None),
            sent: Cell::default(),
            run,
            domain,
            ports,
            outboxes: RefCell::default(),
        }))
    }

    fn service<P: Payload>(&self, topic: Topic) -> Result<Factory<P>, ConnectError> {
        let failed = |reason: String| ConnectError::Failed { topic, reason };
        let name = format!("{}/{}", topic.payload, topic.robot);
        let name = name.as_str().try_into().map_err(|error| failed(format!("{error:?}")))?;
        self.node
            .service_builder(&name)
            .publish_subscribe::<Frame<P>>()
            .max_publishers(MAX_PUBLISHERS)
            .max_subscribers(MAX_CONSUMERS + MAX_TAPS)
            .max_nodes(MAX_NODES)
            .subscriber_max_buffer_size(OBSERVER_DEPTH)
            .subscriber_max_borrowed_samples(MAX_BORROWED)
            // For a successor: the frames that its predecessor would still have used.
            .history_size(consumer_depth(&self.schedule, topic))
            // A receiver that stalls loses frames and notices; a publisher never waits for one. Where a
            // tick depends on a frame nothing is lost: a queue holds more than can be on its way.
            .enable_safe_overflow(true)
            .open_or_create()
            .map_err(|error| failed(error.to_string()))
    }

    fn subscribe<P: Payload>(
        &self,
        topic: Topic,
        depth: usize,
        history: usize,
    ) -> Result<Rc<IceoryxSubscriberPort<ipc::Service, Frame<P>, ()>>, ConnectError> {
        let port = self
            .service::<P>(topic)?
            .subscriber_builder()
            .buffer_size(depth)
            .history_request(history)
            .create()
            .map_err(|error| ConnectError::Failed { topic, reason: error.to_string() })?;
        Ok(self.keep(port))
    }

    fn keep<T: UpdateConnections + 'static>(&self, port: T) -> Rc<T> {
        let port = Rc::new(port);
        self.ports.0.borrow_mut().push(Rc::clone(&port) as Rc<dyn UpdateConnections>);
        port
    }

    /// Has room for all that is said next.
    fn restock(&self) {
        self.outboxes.borrow().iter().for_each(|outbox| outbox.restock());
    }

    fn slot_of(&self, role: Role) -> Option<usize> {
        self.member.board().index_of(role)
    }

    /// Connects all ports to those that others have.
    pub(super) fn connect(&self) {
        self.ports.connect();
        // They were given what was kept for them.
        self.member.slot().ring_all();
    }

    /// Meets all others once they have their ports, connects to them, and touches all memory.
    fn prepare(&self) -> Result<(), TickError> {
        self.member.meet(State::Wired)?;
        self.member.watch_all();
        self.connect();
        self.touch()
    }

    /// Touches all memory that its ports share with those of others.
    fn touch(&self) -> Result<(), TickError> {
        let files = self.domain.shared_memory_files().unwrap_or_default();
        populate(&files).map_err(|_| TickError::SharedMemoryFull)
    }
}

type Factory<P> = PortFactory<ipc::Service, Frame<P>, ()>;

/// The ports of a service that has a process of its own.
#[derive(Clone)]
pub struct IceoryxTransport {
    pub(super) process: Rc<Process>,
    service: ServiceId,
    /// Whether its phase opens the tick: then it also keeps the run within the tap's reach.
    opens_tick: bool,
    /// Once the session has started.
    checkpoint: Rc<RefCell<Option<CheckpointWriter>>>,
}

impl IceoryxTransport {
    /// The ports of the service whose place `member` is, in the run of this directory.
    ///
    /// # Errors
    /// The domain or iceoryx2 can't be used.
    ///
    /// # Panics
    /// `member` is not a service.
    pub fn open(run: &Path, member: Member, schedule: &TickSchedule) -> Result<Self, OpenError> {
        let Role::Service(service) = member.role() else { panic!("{} has no ports", member.role()) };
        let opens_tick = schedule.phases().first().is_some_and(|phase| phase.service == service);
        let process = Process::open(run, member, schedule)?;
        Ok(Self { process, service, opens_tick, checkpoint: Rc::default() })
    }

    /// Its place on the board.
    pub fn member(&self) -> &Member {
        &self.process.member
    }
}

impl IceoryxTransport {
    /// Takes the place of a predecessor, once that has made room. Whatever a successor can do before is
    /// done while the other is in charge; what it can't load it refuses to replace.
    fn succeed(&self, participant: &mut impl Replaceable) -> Result<Option<Position>, TickError> {
        let Process { member, pace, .. } = &*self.process;
        self.process.connect();
        self.process.touch()?;
        self.load_latest(participant)?;
        let frozen = member.wait_for_vacancy(pace.as_ref())?;
        let mut kept = self.load_latest(participant)?;
        member.take_charge(kept.unwrap_or_default(), frozen).map_err(|_| TickError::Fenced)?;
        if frozen.is_some() {
            // It may have thawed, and kept and published another phase before it was fenced.
            kept = self.load_latest(participant)?;
            member.slot().set_since(kept.unwrap_or_default());
        }
        member.wait_for_welcome()?;
        Ok(kept)
    }

    fn load_latest(&self, participant: &mut impl Replaceable) -> Result<Option<Position>, TickError> {
        let latest = checkpoint::latest(&self.process.run, self.service);
        let latest = latest.map_err(|_| TickError::Checkpoint("the predecessor's can't be read"))?;
        let Some(Checkpoint { position, schema, state }) = latest else { return Ok(None) };
        if schema != participant.state_schema() {
            return Err(TickError::Checkpoint("the predecessor's state has another layout"));
        }
        participant.load(&state)?;
        Ok(Some(position))
    }
}

impl Session for IceoryxTransport {
    fn start(&self, participant: &mut impl Replaceable) -> Result<Option<Position>, TickError> {
        let Process { member, run, .. } = &*self.process;
        let kept = if member.is_successor() { self.succeed(participant)? } else { None };
        let (schema, bytes) = (participant.state_schema(), participant.state_bytes());
        let writer = CheckpointWriter::create(run, self.service, member.epoch(), schema, bytes);
        let writer = writer.map_err(|_| TickError::SharedMemoryFull)?;
        self.checkpoint.replace(Some(writer));
        self.process.prepare()?;
        member.meet(State::Ready)?;
        member.enter(State::Running);
        Ok(kept)
    }

    fn begin_phase(&self, at: Position) -> Result<(), TickError> {
        let Process { member, pace, due_ns, .. } = &*self.process;
        // Observers, who wait for what is said last.
        self.process.call_sleepers();
        member.begin_phase(at)?;
        let opens_tick = self.opens_tick && at.phase == 0;
        match pace {
            Some(pace) if opens_tick => due_ns.set(Some(member.begin_tick(pace, at.tick))),
            Some(pace) => {
                due_ns.set(member.board().origin_ns().and_then(|origin_ns| pace.due_ns(origin_ns, at)));
            }
            None if opens_tick => member.wait_for_tap((at.tick + 1).saturating_sub(TAP_LEAD_TICKS))?,
            None => {}
        }
        Ok(())
    }

    fn keep(&self, at: Position, participant: &mut impl Replaceable) -> Result<(), TickError> {
        let kept = match &mut *self.checkpoint.borrow_mut() {
            Some(writer) => writer.write(at, |state| participant.save(state)),
            None => Err(TickError::Checkpoint("the session has not started")),
        };
        self.process.kept_ns.set(now_ns());
        kept
    }

    fn finish(&self, outcome: Result<(), TickError>) -> Result<(), TickError> {
        let member = &self.process.member;
        self.process.call_sleepers();
        // Nobody takes its ports away while others may still read from them. Observers are not waited
        // for: what they are connected to stays until they have read it.
        let met = outcome.and_then(|()| member.meet(State::Done));
        match &met {
            Err(TickError::Retired) => member.retire()?,
            Err(error) => member.fail(error),
            Ok(()) => {}
        }
        met
    }
}

impl Transport for IceoryxTransport {
    type Publisher<P: Payload> = IceoryxPublisher<P>;
    type Subscriber<P: ServicePayload> = IceoryxSubscriber<P>;

    fn publisher<P: Payload>(&self, robot: usize) -> Result<IceoryxPublisher<P>, ConnectError> {
        let (topic, service, process) = (Topic::of::<P>(robot), self.service, &self.process);
        let schedule = &process.schedule;
        let source = process.source_of(topic).filter(|_| schedule.producer_of(topic) == Some(service));
        let source = source.ok_or(ConnectError::NotAnOutput { service, topic })?;
        let awaited = process.awaited(topic, source);
        let frames = frames_of_publisher(schedule, topic);
        let port = process
            .service::<P>(topic)?
            .publisher_builder()
            .max_loaned_samples(MAX_LOANED)
            // iceoryx2 would reserve the deepest queue for each receiver.
            .override_sample_preallocation(move |_| frames)
            .create()
            .map_err(|error| ConnectError::Failed { topic, reason: error.to_string() })?;
        let outbox = Rc::new(Outbox::new(process.keep(port)));
        if awaited.is_some() {
            process.outboxes.borrow_mut().push(Rc::clone(&outbox) as Rc<dyn Restock>);
        }
        Ok(IceoryxPublisher { process: Rc::clone(process), outbox, topic, source, awaited })
    }

    fn subscriber<P: ServicePayload>(&self, robot: usize) -> Result<IceoryxSubscriber<P>, ConnectError> {
        let (topic, service, process) = (Topic::of::<P>(robot), self.service, &self.process);
        let not_an_input = ConnectError::NotAnInput { service, topic };
        let is_input = |phase: &&Phase| phase.inputs.iter().any(|input| input.topic == topic);
        let Some(phase) = process.schedule.phases_of(service).find(is_input) else {
            return Err(not_an_input);
        };
        let Some(source) = process.source_of(topic) else { return Err(not_an_input) };
        let depth = consumer_depth(&process.schedule, topic);
        let port = process.subscribe(topic, depth, depth)?;
        Ok(IceoryxSubscriber {
            process: Rc::clone(process),
            port,
            topic,
            source,
            is_gathering: is_gathering(phase),
            is_last: phase.inputs.last().is_some_and(|input| input.topic == topic),
            bell: Doorbell::default(),
            arrived: Box::new(Frame::zeroed()),
            early: None,
        })
    }

    fn operator(&self) -> OperatorPort {
        let process = Rc::clone(&self.process);
        OperatorPort(Box::new(move |last| process.member.board().operator_input(last)))
    }
}

/// Publishes one topic, and wakes those who sleep for it.
pub struct IceoryxPublisher<P: Payload> {
    process: Rc<Process>,
    outbox: Rc<Outbox<P>>,
    topic: Topic,
    source: Source,
    /// If a service waits for it.
    awaited: Option<Awaited>,
}

impl<P: Payload> Publisher<P> for IceoryxPublisher<P> {
    type Loan<'a> = IceoryxLoan<'a, P>;

    fn loan(&mut self, tick: u64) -> Result<IceoryxLoan<'_, P>, TickError> {
        let mut sample = self.outbox.take().map_err(|error| match error {
            LoanError::OutOfMemory | LoanError::ExceedsMaxLoans => {
                TickError::PublisherFull { topic: self.topic, tick }
            }
            _ => TickError::TransportFailed { topic: self.topic },
        })?;
        sample.payload_mut().envelope = Envelope {
            schema_hash: P::SCHEMA_HASH,
            epoch: self.process.member.epoch(),
            tick,
            robot: self.topic.robot as u64,
            stamp_ns: 0,
            heard_ns: self.process.heard_ns.get(),
            kept_ns: self.process.kept_ns.get(),
            due_ns: self.process.due_ns.get().unwrap_or_default(),
        };
        Ok(IceoryxLoan { sample, publisher: self })
    }
}

/// A frame that is being filled in shared memory.
pub struct IceoryxLoan<'a, P: Payload> {
    pub(super) sample: Blank<P>,
    publisher: &'a IceoryxPublisher<P>,
}

impl<P: Payload> Loan<P> for IceoryxLoan<'_, P> {
    fn payload_mut(&mut self) -> &mut P {
        &mut self.sample.payload_mut().payload
    }

    fn send(mut self) -> Result<(), TickError> {
        let publisher = self.publisher;
        let envelope = &mut self.sample.payload_mut().envelope;
        envelope.stamp_ns = now_ns();
        let tick = envelope.tick;
        self.sample.send().map_err(|_| TickError::TransportFailed { topic: publisher.topic })?;
        publisher.process.say(publisher.source, tick, publisher.awaited.as_ref());
        Ok(())
    }
}

/// Receives one topic, and sleeps until it comes.
pub struct IceoryxSubscriber<P: Payload> {
    process: Rc<Process>,
    port: Rc<IceoryxSubscriberPort<ipc::Service, Frame<P>, ()>>,
    topic: Topic,
    source: Source,
    /// Whether it sleeps alone.
    is_gathering: bool,
    /// Whether its phase has then heard all inputs: they are received in the schedule's order.
    is_last: bool,
    bell: Doorbell,
    /// Where frames are copied to before they are looked at: shared memory may change under the eyes.
    arrived: Box<Frame<P>>,
    /// The tick of what has arrived, if that came before its time.
    early: Option<u64>,
}

impl<P: Payload> Subscriber<P> for IceoryxSubscriber<P> {
    fn receive(&mut self, tick: u64, frame: &mut Frame<P>) -> Result<(), TickError> {
        let received = self.receive_in_time(tick, frame);
        if self.is_last {
            self.process.heard_ns.set(now_ns());
        }
        received
    }
}

impl<P: Payload> IceoryxSubscriber<P> {
    fn receive_in_time(&mut self, tick: u64, frame: &mut Frame<P>) -> Result<(), TickError> {
        let Self { process, port, topic, source, is_gathering, bell, arrived, early, .. } = self;
        let (topic, due_ns) = (*topic, process.due_ns.get());
        let missing = TickError::InputMissing { topic, tick };
        // By the clock one goes on without what was lost, and uses what follows in its turn.
        if early.is_some_and(|found| found > tick) {
            return Err(missing);
        }
        let Source { phase, place, .. } = *source;
        let slot = process.slot_at(*source).ok_or(TickError::TransportFailed { topic })?;
        if early.take() == Some(tick) && judge(arrived, topic, phase, slot.charge(), tick)? == Verdict::Use {
            *frame = **arrived;
            return Ok(());
        }
        let bed = if *is_gathering { &process.member.slot().bed } else { slot.lobby(phase) };
        let poll = || {
            loop {
                let receive = || port.receive().map_err(|_| TickError::TransportFailed { topic });
                let Some(sample) = bell.answer(slot.bell(place), Some(tick), receive)? else {
                    return Ok(None);
                };
                **arrived = *sample.payload();
                drop(sample);
                match judge(arrived, topic, phase, slot.charge(), tick) {
                    Ok(Verdict::Use) => return Ok(Some(())),
                    Ok(Verdict::PassOver) => {}
                    Err(TickError::FutureTick { found, .. }) if process.pace.is_some() => {
                        // Nobody is so far ahead who counts as we do.
                        if found - tick <= FURTHEST_TICKS {
                            *early = Some(found);
                            return Err(missing);
                        }
                    }
                    Err(error) => return Err(error),
                }
            }
        };
        // Who waits for several has let others go first, or was the last of all.
        let meanwhile = Meanwhile { lets_others_go_first: !*is_gathering, work: || process.restock() };
        let found = process.member.wait_until(bed, due_ns, poll, meanwhile)?;
        found.ok_or(missing)?;
        *frame = **arrived;
        Ok(())
    }
}

/// The ports of the run's tap.
#[derive(Clone)]
pub struct IceoryxTap {
    process: Rc<Process>,
    opener: Option<usize>,
    consumed: Rc<Cell<u64>>,
    /// Whether no tick had begun when it was connected.
    is_early: Cell<bool>,
}

impl IceoryxTap {
    /// The ports of the tap whose place `member` is, in the run of this directory.
    ///
    /// # Errors
    /// The domain or iceoryx2 can't be used.
    pub fn open(run: &Path, member: Member, schedule: &TickSchedule) -> Result<Self, OpenError> {
        // If the run has begun without it, it waits at its next tick.
        member.slot().set_position(Position::default());
        let process = Process::open(run, member, schedule)?;
        let opener =
            schedule.phases().first().and_then(|phase| process.slot_of(Role::Service(phase.service)));
        Ok(Self { process, opener, consumed: Rc::default(), is_early: Cell::default() })
    }

    /// Meets all services before the first tick, once all observers have been made. It does not block
    /// once all of them are [`State::Wired`].
    ///
    /// # Errors
    /// A process is lost, the run is to stop, or shared memory is full.
    pub fn start(&self) -> Result<(), TickError> {
        self.process.prepare()?;
        let opener = self.opener.and_then(|index| self.process.member.board().slots().get(index));
        // Those who are not yet to execute ticks have seen it come, and wait for it.
        self.is_early.set(opener.is_some_and(|slot| slot.state() < State::Running));
        // No tick begins before the tap is ready, and it can begin whenever the services do.
        self.process.member.enter(State::Running);
        Ok(())
    }

    /// The first tick of which it misses nothing: the first of all, or for a tap that comes later one that begins
    /// once all services are connected to it; none before they are.
    pub fn first_tick(&self) -> Option<u64> {
        let member = &self.process.member;
        if self.is_early.get() {
            return Some(0);
        }
        let opener = member.board().slots().get(self.opener?)?;
        // In this order: what begins after they were connected is complete.
        member.is_welcome().then(|| opener.position().tick + 1)
    }

    /// Says that every frame of this many ticks has been consumed: the run stays within
    /// [`TAP_LEAD_TICKS`] of it.
    pub fn set_consumed(&self, ticks: u64) {
        self.consumed.set(ticks);
        let member = &self.process.member;
        member.slot().set_position(Position { tick: ticks, phase: 0 });
        if let Some(slot) = self.opener.and_then(|index| member.board().slots().get(index)) {
            slot.bed.call_after_fence();
        }
    }

    /// Says that nothing more will be consumed: the run goes on without.
    pub fn detach(&self) {
        self.process.member.conclude();
    }
}

impl Tap for IceoryxTap {
    type Observer<P: Payload> = IceoryxObserver<P>;

    fn observer<P: Payload>(&self, robot: usize) -> Result<IceoryxObserver<P>, ConnectError> {
        let topic = Topic::of::<P>(robot);
        let process = &self.process;
        let source = process.source_of(topic).ok_or(ConnectError::NotPublished { topic })?;
        // A tap is there from the first tick: what was before is nothing.
        let port = self.process.subscribe(topic, OBSERVER_DEPTH, 0)?;
        Ok(IceoryxObserver { process: Rc::clone(process), port, topic, source, bell: Doorbell::default() })
    }
}

/// Sees all frames of one topic.
pub struct IceoryxObserver<P: Payload> {
    process: Rc<Process>,
    port: Rc<IceoryxSubscriberPort<ipc::Service, Frame<P>, ()>>,
    topic: Topic,
    source: Source,
    bell: Doorbell,
}

impl<P: Payload> Observer<P> for IceoryxObserver<P> {
    fn try_receive(&mut self, frame: &mut Frame<P>) -> Result<bool, TickError> {
        let topic = self.topic;
        // Who only looks now and then has no wait in which to do so.
        self.process.member.welcome_successors();
        let slot = self.process.slot_at(self.source).ok_or(TickError::TransportFailed { topic })?;
        let receive = || self.port.receive().map_err(|_| TickError::TransportFailed { topic });
        let Some(sample) = self.bell.answer(slot.bell(self.source.place), None, receive)? else {
            return Ok(false);
        };
        *frame = *sample.payload();
        if frame.envelope.schema_hash != P::SCHEMA_HASH {
            return Err(TickError::WrongSchema { topic });
        }
        Ok(true)
    }

    fn receive(&mut self, frame: &mut Frame<P>) -> Result<bool, TickError> {
        let (process, source) = (Rc::clone(&self.process), self.source);
        let slot = process.slot_at(source).ok_or(TickError::TransportFailed { topic: self.topic })?;
        let poll = || {
            // Asked first: what was published before the end is found after it.
            let have_ended = process.member.all_services_have_ended();
            let is_found = self.try_receive(frame)?;
            Ok((is_found || have_ended).then_some(is_found))
        };
        let found = process.member.wait_until(slot.lobby(source.phase), None, poll, Meanwhile::NOTHING)?;
        Ok(found.unwrap_or(false))
    }
}
