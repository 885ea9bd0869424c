//! Frames in the memory of one thread.
//!
//! Nothing waits here: phases run in the schedule's order, so that an input is either there or will
//! never come. Set-up allocates; loaning, sending and receiving do not.

use super::accept::{Verdict, judge};
use super::{
    ConnectError, Loan, OBSERVER_DEPTH, Observer, OperatorPort, Publisher, Subscriber, Tap, Transport,
    consumer_depth,
};
use crate::board::Charge;
use crate::{Position, TickError, TickSchedule, Topic};
use core::any::Any;
use core::cell::{Cell, RefCell};
use mikoshi_ipc_types::{Envelope, Frame, OperatorInput, Payload, ServiceId, ServicePayload};
use std::collections::BTreeMap;
use std::rc::Rc;

/// In one thread nobody is replaced: one speaks from the first tick on.
const CHARGE: Charge = Charge { epoch: 1, since: Position { tick: 0, phase: 0 } };

/// Where the services of one thread meet.
#[derive(Clone)]
pub struct InMemoryHub {
    shared: Rc<Shared>,
}

struct Shared {
    schedule: TickSchedule,
    channels: RefCell<BTreeMap<Topic, Rc<dyn Any>>>,
    operator: Cell<OperatorInput>,
}

impl InMemoryHub {
    /// A hub for the services of this schedule.
    pub fn new(schedule: TickSchedule) -> Self {
        Self { shared: Rc::new(Shared { schedule, channels: RefCell::default(), operator: Cell::default() }) }
    }

    /// The ports of this service.
    pub fn transport(&self, service: ServiceId) -> InMemoryTransport {
        InMemoryTransport { hub: self.clone(), service }
    }

    /// Makes this what the operator says.
    pub fn set_operator(&self, input: OperatorInput) {
        self.shared.operator.set(input);
    }

    /// The ports of an observer.
    pub fn tap(&self) -> InMemoryTap {
        InMemoryTap { hub: self.clone() }
    }

    fn channel<P: Payload>(&self, topic: Topic) -> Rc<Channel<P>> {
        let mut channels = self.shared.channels.borrow_mut();
        let channel = channels.entry(topic).or_insert_with(|| Rc::new(Channel::<P>::default()));
        Rc::clone(channel).downcast().expect("a topic's name determines its payload")
    }

    fn queue<P: Payload>(&self, topic: Topic, depth: usize) -> SharedQueue<P> {
        let queue = Rc::new(RefCell::new(Queue::new(depth)));
        let channel = self.channel::<P>(topic);
        let mut queues = channel.queues.borrow_mut();
        queues.retain(|queue| Rc::strong_count(queue) > 1);
        queues.push(Rc::clone(&queue));
        queue
    }
}

/// All receivers of a topic.
struct Channel<P: Payload> {
    queues: RefCell<Vec<SharedQueue<P>>>,
}

impl<P: Payload> Default for Channel<P> {
    fn default() -> Self {
        Self { queues: RefCell::default() }
    }
}

type SharedQueue<P> = Rc<RefCell<Queue<P>>>;

/// A ring of frames that overwrites its oldest, as iceoryx2's safe overflow does.
struct Queue<P: Payload> {
    frames: Box<[Frame<P>]>,
    first: usize,
    length: usize,
}

impl<P: Payload> Queue<P> {
    fn new(depth: usize) -> Self {
        Self { frames: vec![Frame::zeroed(); depth].into_boxed_slice(), first: 0, length: 0 }
    }

    fn push(&mut self, frame: &Frame<P>) {
        let depth = self.frames.len();
        if self.length == depth {
            self.first = (self.first + 1) % depth;
            self.length -= 1;
        }
        self.frames[(self.first + self.length) % depth] = *frame;
        self.length += 1;
    }

    fn pop(&mut self) -> Option<&Frame<P>> {
        if self.length == 0 {
            return None;
        }
        let frame = &self.frames[self.first];
        self.first = (self.first + 1) % self.frames.len();
        self.length -= 1;
        Some(frame)
    }
}

/// The ports of one service of an [`InMemoryHub`].
#[derive(Clone)]
pub struct InMemoryTransport {
    hub: InMemoryHub,
    service: ServiceId,
}

impl Transport for InMemoryTransport {
    type Publisher<P: Payload> = InMemoryPublisher<P>;
    type Subscriber<P: ServicePayload> = InMemorySubscriber<P>;

    fn publisher<P: Payload>(&self, robot: usize) -> Result<InMemoryPublisher<P>, ConnectError> {
        let (topic, service) = (Topic::of::<P>(robot), self.service);
        if self.hub.shared.schedule.producer_of(topic) != Some(service) {
            return Err(ConnectError::NotAnOutput { service, topic });
        }
        Ok(InMemoryPublisher { topic, channel: self.hub.channel(topic), frame: Frame::zeroed() })
    }

    fn subscriber<P: ServicePayload>(&self, robot: usize) -> Result<InMemorySubscriber<P>, ConnectError> {
        let (topic, service) = (Topic::of::<P>(robot), self.service);
        if self.hub.shared.schedule.input_of(service, topic).is_none() {
            return Err(ConnectError::NotAnInput { service, topic });
        }
        let depth = consumer_depth(&self.hub.shared.schedule, topic);
        Ok(InMemorySubscriber { topic, queue: self.hub.queue(topic, depth) })
    }

    fn operator(&self) -> OperatorPort {
        let shared = Rc::clone(&self.hub.shared);
        OperatorPort(Box::new(move |_| shared.operator.get()))
    }
}

/// The ports of an observer of an [`InMemoryHub`].
#[derive(Clone)]
pub struct InMemoryTap {
    hub: InMemoryHub,
}

impl Tap for InMemoryTap {
    type Observer<P: Payload> = InMemoryObserver<P>;

    fn observer<P: Payload>(&self, robot: usize) -> Result<InMemoryObserver<P>, ConnectError> {
        let topic = Topic::of::<P>(robot);
        if self.hub.shared.schedule.producer_of(topic).is_none() {
            return Err(ConnectError::NotPublished { topic });
        }
        Ok(InMemoryObserver { topic, queue: self.hub.queue(topic, OBSERVER_DEPTH) })
    }
}

/// Publishes to all receivers of a topic.
pub struct InMemoryPublisher<P: Payload> {
    topic: Topic,
    channel: Rc<Channel<P>>,
    pub(super) frame: Frame<P>,
}

impl<P: Payload> Publisher<P> for InMemoryPublisher<P> {
    type Loan<'a> = InMemoryLoan<'a, P>;

    fn loan(&mut self, tick: u64) -> Result<InMemoryLoan<'_, P>, TickError> {
        self.frame.payload = P::zeroed();
        self.frame.envelope = Envelope {
            schema_hash: P::SCHEMA_HASH,
            epoch: CHARGE.epoch,
            tick,
            robot: self.topic.robot as u64,
            ..Envelope::default()
        };
        Ok(InMemoryLoan { publisher: self })
    }
}

/// A frame that is being filled.
pub struct InMemoryLoan<'a, P: Payload> {
    pub(super) publisher: &'a mut InMemoryPublisher<P>,
}

impl<P: Payload> Loan<P> for InMemoryLoan<'_, P> {
    fn payload_mut(&mut self) -> &mut P {
        &mut self.publisher.frame.payload
    }

    fn send(self) -> Result<(), TickError> {
        for queue in self.publisher.channel.queues.borrow().iter() {
            queue.borrow_mut().push(&self.publisher.frame);
        }
        Ok(())
    }
}

/// Receives the frames of one topic.
pub struct InMemorySubscriber<P: Payload> {
    topic: Topic,
    queue: SharedQueue<P>,
}

impl<P: Payload> Subscriber<P> for InMemorySubscriber<P> {
    fn receive(&mut self, tick: u64, frame: &mut Frame<P>) -> Result<(), TickError> {
        let mut queue = self.queue.borrow_mut();
        while let Some(next) = queue.pop() {
            if judge(next, self.topic, 0, CHARGE, tick)? == Verdict::Use {
                *frame = *next;
                return Ok(());
            }
        }
        Err(TickError::InputMissing { topic: self.topic, tick })
    }
}

/// Sees all frames of one topic.
pub struct InMemoryObserver<P: Payload> {
    topic: Topic,
    queue: SharedQueue<P>,
}

impl<P: Payload> Observer<P> for InMemoryObserver<P> {
    fn try_receive(&mut self, frame: &mut Frame<P>) -> Result<bool, TickError> {
        let mut queue = self.queue.borrow_mut();
        let Some(next) = queue.pop() else { return Ok(false) };
        if next.envelope.schema_hash != P::SCHEMA_HASH {
            return Err(TickError::WrongSchema { topic: self.topic });
        }
        *frame = *next;
        Ok(true)
    }

    fn receive(&mut self, frame: &mut Frame<P>) -> Result<bool, TickError> {
        self.try_receive(frame)
    }
}
