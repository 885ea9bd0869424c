//! Drivers as a transport of the runtime: the tick is Mikoshi's own, whatever carries its frames.

use crate::driver::{Driver, End, Receiver, Sender};
use mikoshi_ipc_types::{Frame, Payload, ServiceId, ServicePayload};
use mikoshi_runtime::{
    ConnectError, Loan, OperatorPort, Position, Publisher, Replaceable, Session, Subscriber, TickError,
    TickSchedule, Topic, Transport,
};

/// The ports of one service over a driver.
pub struct Ports<D> {
    driver: D,
    schedule: TickSchedule,
    service: ServiceId,
}

impl<D: Driver> Ports<D> {
    /// Of this service.
    pub fn new(driver: D, schedule: &TickSchedule, service: ServiceId) -> Self {
        Self { driver, schedule: schedule.clone(), service }
    }

    fn end<P: Payload>(&self, topic: Topic) -> End {
        let has_reader = self.schedule.consumers_of(topic).next().is_some();
        End { topic, frame_bytes: size_of::<Frame<P>>(), has_reader }
    }
}

impl<D: Driver> Transport for Ports<D> {
    type Publisher<P: Payload> = Outlet<P, D::Sender>;
    type Subscriber<P: ServicePayload> = Inlet<D::Receiver>;

    fn publisher<P: Payload>(&self, robot: usize) -> Result<Self::Publisher<P>, ConnectError> {
        let (topic, service) = (Topic::of::<P>(robot), self.service);
        if self.schedule.producer_of(topic) != Some(service) {
            return Err(ConnectError::NotAnOutput { service, topic });
        }
        let sender = self.driver.sender(self.end::<P>(topic));
        let sender = sender.map_err(|error| ConnectError::Failed { topic, reason: error.to_string() })?;
        let mut frame = Box::new(Frame::zeroed());
        frame.envelope.robot = robot as u64;
        Ok(Outlet { sender, frame, topic })
    }

    fn subscriber<P: ServicePayload>(&self, robot: usize) -> Result<Self::Subscriber<P>, ConnectError> {
        let (topic, service) = (Topic::of::<P>(robot), self.service);
        if self.schedule.input_of(service, topic).is_none() {
            return Err(ConnectError::NotAnInput { service, topic });
        }
        let receiver = self.driver.receiver(self.end::<P>(topic));
        let receiver = receiver.map_err(|error| ConnectError::Failed { topic, reason: error.to_string() })?;
        Ok(Inlet { receiver, topic })
    }

    fn operator(&self) -> OperatorPort {
        OperatorPort::silent()
    }
}

/// Nothing surrounds the ticks, and nothing is kept.
impl<D> Session for Ports<D> {
    fn start(&self, _: &mut impl Replaceable) -> Result<Option<Position>, TickError> {
        Ok(None)
    }

    fn begin_phase(&self, _: Position) -> Result<(), TickError> {
        Ok(())
    }

    fn keep(&self, _: Position, _: &mut impl Replaceable) -> Result<(), TickError> {
        Ok(())
    }

    fn finish(&self, outcome: Result<(), TickError>) -> Result<(), TickError> {
        outcome
    }
}

/// Publishes one topic.
pub struct Outlet<P: Payload, S> {
    sender: S,
    /// It is handed out as it was sent last, and not zeroed: who has filled it in one tick fills the same in the
    /// next, and what carries it should not be charged with more than carrying.
    frame: Box<Frame<P>>,
    topic: Topic,
}

impl<P: Payload, S: Sender> Publisher<P> for Outlet<P, S> {
    type Loan<'a>
        = Filling<'a, P, S>
    where
        S: 'a;

    fn loan(&mut self, tick: u64) -> Result<Filling<'_, P, S>, TickError> {
        self.frame.envelope.tick = tick;
        Ok(Filling(self))
    }
}

/// A frame that is being filled.
pub struct Filling<'a, P: Payload, S>(&'a mut Outlet<P, S>);

impl<P: Payload, S: Sender> Loan<P> for Filling<'_, P, S> {
    fn payload_mut(&mut self) -> &mut P {
        &mut self.0.frame.payload
    }

    fn send(self) -> Result<(), TickError> {
        let Outlet { sender, frame, topic } = self.0;
        sender.send(bytes_of(frame)).map_err(|error| failed(*topic, &error))
    }
}

/// Receives one topic.
pub struct Inlet<R> {
    receiver: R,
    topic: Topic,
}

impl<P: Payload, R: Receiver> Subscriber<P> for Inlet<R> {
    fn receive(&mut self, _: u64, frame: &mut Frame<P>) -> Result<(), TickError> {
        self.receiver.receive(bytes_of_mut(frame)).map_err(|error| failed(self.topic, &error))
    }
}

fn failed(topic: Topic, error: &impl core::fmt::Display) -> TickError {
    eprintln!("{topic}: {error}");
    TickError::TransportFailed { topic }
}

fn bytes_of<P: Payload>(frame: &Frame<P>) -> &[u8] {
    // SAFETY: a frame is two `Pod` values without padding (a compile-time assertion of the contract).
    unsafe { core::slice::from_raw_parts(core::ptr::from_ref(frame).cast(), size_of::<Frame<P>>()) }
}

fn bytes_of_mut<P: Payload>(frame: &mut Frame<P>) -> &mut [u8] {
    // SAFETY: as above, and any bytes are a valid frame.
    unsafe { core::slice::from_raw_parts_mut(core::ptr::from_mut(frame).cast(), size_of::<Frame<P>>()) }
}
