//! A link with its ports here, its keys there, and the loop in which it carries frames from one to the other.

use crate::gate::{Counters, Now, Refusal};
use crate::keys::Keys;
use crate::message::{HEADER_BYTES, Header};
use crate::peers::Peers;
use crate::ports;
use crate::session::SessionError;
use crate::standby::{Kept, Standby};
use crate::task::Task;
use crate::traffic::{Destination, Incoming, Outgoing, Source, Traffic, Turn, services_of};
use core::sync::atomic::{AtomicU64, Ordering};
use mikoshi_ipc_types::{Payload, RobotState, Sensors, ServiceId, TeamCommand};
use mikoshi_resolution::Crossing;
use mikoshi_runtime::{IceoryxLink, LinkBell, StandIn, State, TickError, Topic, WaitPolicy, now_ns};
use std::collections::VecDeque;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority, Reliability};
use zenoh::sample::{Locality, Sample};
use zenoh::{Session, Wait as _};

/// Frames of a topic that may wait to be published here. Whoever takes part in ticks takes them at once.
const QUEUE: usize = 64;

/// Frames between this host and the others.
pub struct Carrier<'a> {
    link: IceoryxLink,
    traffic: Traffic<'a>,
    _subscribers: Vec<Subscriber<()>>,
}

impl<'a> Carrier<'a> {
    /// With all its ports; nothing is waited for.
    ///
    /// # Errors
    /// A place is taken, a port can't be made, or a key not be used.
    pub fn open(
        task: Task<'a>,
        policy: WaitPolicy,
        session: &Session,
        keys: &Keys,
        peers: Arc<Peers>,
    ) -> Result<Self, SessionError> {
        let link = IceoryxLink::open(task.directory, policy, task.schedule)
            .map_err(|error| SessionError::of("link", error))?;
        let mut stand_ins = vec![];
        for (service, _) in services_of(link.board()) {
            peers.recall_moves(service, link.board().moves_of(service));
            let may_be_here = task.may_be_here(service);
            let has_two_places = task.run.scenario.places_of(service).count() > 1;
            let stand_in = match peers.is_here(service) {
                // Nobody comes for it, or its place may be that of another one day.
                true if !has_two_places => continue,
                true => StandIn::prepare(task.directory, service, policy, task.schedule),
                false if may_be_here && !link.board().is_reserved(service) => {
                    StandIn::prepare(task.directory, service, policy, task.schedule)
                }
                false => StandIn::take_place(task.directory, service, policy, task.schedule),
            };
            let stand_in =
                stand_in.map_err(|error| SessionError::of(format!("place of {service}"), error))?;
            stand_ins.push((service, stand_in));
        }
        let traffic = Traffic {
            stand_ins,
            outgoing: vec![],
            incoming: vec![],
            standbys: vec![],
            again: VecDeque::new(),
            beats: None,
            begun: None,
            is_pacing: false,
            origin_ns: None,
            stops: 0,
            peers,
            sources: vec![],
            sent: Arc::default(),
            is_connected: false,
            since_done_ns: None,
            task,
        };
        let mut carrier = Self { link, traffic, _subscribers: vec![] };
        carrier.declare(session, keys)?;
        Ok(carrier)
    }

    fn declare(&mut self, session: &Session, keys: &Keys) -> Result<(), SessionError> {
        let own = self.traffic.task.host;
        let clock = self.traffic.task.clock();
        let crossings = self.traffic.task.crossings;
        let hosts = &self.traffic.task.run.scenario.hosts;
        let name = |host: usize| &*hosts[host].name;
        if clock == own && self.traffic.task.run.scenario.host_of(ServiceId::Bridge) == Some(own) {
            // By what it publishes its tick is known, whether or not that goes anywhere.
            self.outgoing_of(Topic::of::<Sensors>(0))?;
        }
        for crossing in crossings {
            let topic = crossing.output.topic;
            let key = keys.of_topic(crossing.from, crossing.from_host, topic, name(crossing.to_host));
            if crossing.from_host == own {
                let publisher = self.publisher(session, &key, crossing.is_awaited)?;
                let (host, is_awaited) = (crossing.to_host, crossing.is_awaited);
                let outgoing = self.outgoing_of(topic)?;
                self.traffic.outgoing[outgoing].destinations.push(Destination {
                    host,
                    publisher,
                    is_awaited,
                });
            } else if crossing.to_host == own {
                self.listen(session, crossing, &key)?;
            }
        }
        if clock == own {
            self.traffic.is_pacing = self.traffic.task.run.scenario.host_of(ServiceId::Bridge) != Some(own);
            self.traffic.beats = Some(self.publisher(session, &keys.beat(name(own)), true)?);
        } else {
            let (peers, bell) = (Arc::clone(&self.traffic.peers), self.bell()?);
            let beat = move |sample: Sample| {
                let message = sample.payload().to_bytes();
                if let Some(tick) = tick_of_beat(&message, &peers, clock)
                    && peers.reach(tick)
                {
                    bell.ring();
                }
            };
            self._subscribers.push(subscribe(session, &keys.beat(name(clock)), beat)?);
        }
        for service in ServiceId::of_team(self.traffic.task.run.robots.len()) {
            self.stand_by(session, keys, service)?;
        }
        for host in self.traffic.task.hosts_of_others() {
            let (peers, bell) = (Arc::clone(&self.traffic.peers), self.bell()?);
            let hear = move |sample: Sample| {
                if peers.hear(host, &sample.payload().to_bytes()) {
                    bell.ring();
                }
            };
            self._subscribers.push(subscribe(session, &keys.hello(name(host)), hear)?);
        }
        Ok(())
    }

    /// Where this host is one of two for a service: has what is kept go to the other, and come from there.
    fn stand_by(&mut self, session: &Session, keys: &Keys, service: ServiceId) -> Result<(), SessionError> {
        let task = &self.traffic.task;
        let Some(other) = task.other_host_of(service) else { return Ok(()) };
        let publisher = self.publisher(session, &keys.of_checkpoint(service, task.host, other), false)?;
        let peers = &self.traffic.peers;
        let opened = Standby::open(task, service, session, keys, publisher, peers, self.bell()?)?;
        if let Some((standby, subscriber)) = opened {
            self.traffic.standbys.push(standby);
            self._subscribers.push(subscriber);
        }
        Ok(())
    }

    /// What is counted of what is kept here for others, by service.
    pub fn kept(&self) -> Vec<Arc<Kept>> {
        self.traffic.standbys.iter().map(|standby| Arc::clone(standby.kept())).collect()
    }

    /// Where this topic, of this host, goes out.
    fn outgoing_of(&mut self, topic: Topic) -> Result<usize, SessionError> {
        let outgoing = &mut self.traffic.outgoing;
        if let Some(index) = outgoing.iter().position(|outgoing| outgoing.topic == topic) {
            return Ok(index);
        }
        let outlet = ports::outlet(&self.link, topic);
        let outlet = outlet.map_err(|error| SessionError::of(topic.to_string(), error))?;
        let is_answered = topic.payload == RobotState::NAME;
        let is_beat = topic == Topic::of::<Sensors>(0) && self.traffic.task.host == self.traffic.task.clock();
        let service = self.traffic.task.schedule.producer_of(topic);
        let service = service.ok_or_else(|| SessionError::of(topic.to_string(), "nobody says it"))?;
        outgoing.push(Outgoing { topic, service, outlet, destinations: vec![], is_beat, is_answered });
        Ok(outgoing.len() - 1)
    }

    fn bell(&self) -> Result<LinkBell, SessionError> {
        LinkBell::open(self.traffic.task.directory).map_err(|error| SessionError::of("board", error))
    }

    /// By the clock nothing waits for what is lost or for who is slow, and what observers see is not in the way of what
    /// services wait for: it goes by streams, which come after datagrams. In lockstep everything arrives.
    fn publisher(
        &self,
        session: &Session,
        key: &str,
        is_awaited: bool,
    ) -> Result<Publisher<'static>, SessionError> {
        let (congestion, reliability) = match (self.traffic.task.is_by_the_clock(), is_awaited) {
            (true, true) => (CongestionControl::Drop, Reliability::BestEffort),
            (true, false) => (CongestionControl::Drop, Reliability::Reliable),
            (false, _) => (CongestionControl::Block, Reliability::Reliable),
        };
        session
            .declare_publisher(key.to_owned())
            .priority(if is_awaited { Priority::RealTime } else { Priority::Data })
            .congestion_control(congestion)
            .reliability(reliability)
            .express(true)
            .allowed_destination(Locality::Remote)
            .wait()
            .map_err(|error| SessionError::of(key, error))
    }

    fn listen(&mut self, session: &Session, crossing: &Crossing, key: &str) -> Result<(), SessionError> {
        let topic = crossing.output.topic;
        let failed = |error: &dyn core::fmt::Display| SessionError::of(key, error);
        let Some(stand_in) = self.traffic.stand_ins.iter().position(|(service, _)| *service == crossing.from)
        else {
            return Ok(());
        };
        let schedule = self.traffic.task.schedule;
        let inlet = ports::inlet(self.traffic.stand_ins[stand_in].1.ports(), topic)
            .map_err(|error| failed(&error))?;
        let is_here = |service: &ServiceId| self.traffic.task.may_be_here(*service);
        let consumer = schedule.consumers_of(topic).find(|(service, _)| is_here(service));
        let age_ticks = consumer.map_or(0, |(_, input)| input.age_ticks);
        let consumer = consumer.map(|(service, _)| service);
        let mut gate =
            ports::gate(self.traffic.peers.run(), topic, age_ticks).map_err(|error| failed(&error))?;
        let source = Arc::new(Source {
            topic,
            host: crossing.from_host,
            counters: Counters::default(),
            next_tick: AtomicU64::new(0),
            latencies: Mutex::default(),
            round_trips: Mutex::default(),
        });
        self.traffic.sources.push(Arc::clone(&source));
        let (sender, arrived): (SyncSender<(u64, Vec<u8>)>, _) = sync_channel(QUEUE);
        let (peers, bell) = (Arc::clone(&self.traffic.peers), self.bell()?);
        let sent = (topic.payload == TeamCommand::NAME).then(|| Arc::clone(&self.traffic.sent));
        let (host, from) = (crossing.from_host, crossing.from);
        // Zenoh calls it from one thread at a time.
        let gate = Mutex::new(move |message: &[u8]| {
            let now = Now {
                incarnation: peers.incarnation_of(host),
                tick: peers.tick().unwrap_or_default(),
                consumer_tick: consumer
                    .and_then(|service| bell.board().last_position(service))
                    .map(|at| at.tick),
            };
            // Of two hosts that say it, one is in charge.
            let entitled = if peers.host_of(from) == Some(host) { Ok(()) } else { Err(Refusal::Epoch) };
            let judged = entitled.and_then(|()| gate.judge(message, now)).and_then(
                |(header, tick, frame)| match sender.try_send((tick, frame.to_vec())) {
                    Ok(()) => Ok((header, tick)),
                    Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => Err(Refusal::Flood),
                },
            );
            if let Ok((_, tick)) = judged {
                source.next_tick.store(tick.saturating_add(1), Ordering::Release);
            }
            source.counters.count(&judged);
            if let Ok((header, tick)) = judged {
                bell.ring();
                if let Some(round_trip_ns) = sent.as_ref().and_then(|sent| sent.since(tick, now_ns())) {
                    source.round_trips.lock().unwrap_or_else(PoisonError::into_inner).note(round_trip_ns);
                }
                if let Some(offset_ns) = peers.offset_ns(host) {
                    let sent_ns = header.sent_ns as i128 - i128::from(offset_ns);
                    let way_ns = (now_ns() as i128 - sent_ns).clamp(0, i128::from(u64::MAX)) as u64;
                    source.latencies.lock().unwrap_or_else(PoisonError::into_inner).note(way_ns);
                }
            }
        });
        let hear = move |sample: Sample| {
            let message = sample.payload().to_bytes();
            (gate.lock().unwrap_or_else(PoisonError::into_inner))(&message);
        };
        self._subscribers.push(subscribe(session, key, hear)?);
        let phase = schedule.phase_of(topic).unwrap_or_default();
        self.traffic.incoming.push(Incoming { inlet, stand_in, phase, arrived });
        Ok(())
    }

    /// What is counted, by topic.
    pub fn sources(&self) -> &[Arc<Source>] {
        &self.traffic.sources
    }

    /// Carries frames until the run has ended.
    ///
    /// # Errors
    /// The run ends early.
    pub fn carry(&mut self) -> Result<(), TickError> {
        let Self { link, traffic, .. } = self;
        link.enter(State::Running);
        for (_, stand_in) in traffic.in_place() {
            stand_in.enter(State::Wired);
        }
        let mut carry = || {
            loop {
                let due_ns = traffic.due_ns();
                if link.wait(due_ns, || traffic.turn(link))? == Some(Turn::Last) {
                    return Ok(());
                }
            }
        };
        let carried = carry();
        match &carried {
            Ok(()) => {
                traffic.in_place().for_each(|(_, stand_in)| stand_in.conclude());
                link.conclude();
            }
            Err(error) => {
                traffic.in_place().for_each(|(_, stand_in)| stand_in.fail(error));
                link.fail(error);
            }
        }
        carried
    }
}

pub(crate) fn subscribe(
    session: &Session,
    key: &str,
    callback: impl Fn(Sample) + Send + Sync + 'static,
) -> Result<Subscriber<()>, SessionError> {
    let subscriber = session.declare_subscriber(key.to_owned()).allowed_origin(Locality::Remote);
    subscriber.callback(callback).wait().map_err(|error| SessionError::of(key, error))
}

/// The tick that a beat tells, if the clock's link has sent it.
fn tick_of_beat(message: &[u8], peers: &Peers, clock: usize) -> Option<u64> {
    let (header, body) = Header::split(message)?;
    let tick = u64::from_le_bytes(body.try_into().ok()?);
    let is_known = header.run == peers.run() && header.incarnation == peers.incarnation_of(clock);
    (is_known && message.len() == HEADER_BYTES + size_of::<u64>()).then_some(tick)
}
