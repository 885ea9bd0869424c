//! Whether what arrives is what was sent: every word of every frame that a service leaves zero is filled on its way
//! out with what only this topic, tick and place have, and looked at when it comes in.

use clap::ValueEnum;
use mikoshi_ipc_types::{Frame, Payload, ServicePayload};
use mikoshi_runtime::{ConnectError, Loan, OperatorPort, Publisher, Subscriber, TickError, Topic, Transport};

/// What a faulty service does to a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Fault {
    /// One of its bits is another.
    FlippedBit,
    /// It is that of the tick before.
    StaleFrame,
}

impl Fault {
    /// Late enough that every driver is connected, and carries what it always does.
    pub const TICK: u64 = 50;

    /// As it is asked for.
    pub fn name(self) -> &'static str {
        match self {
            Self::FlippedBit => "flipped-bit",
            Self::StaleFrame => "stale-frame",
        }
    }
}

/// A transport whose frames are filled and looked at.
pub struct Witness<'a, T> {
    inner: &'a T,
    fault: Option<Fault>,
}

impl<'a, T: Transport> Witness<'a, T> {
    /// Of what this transport carries; in one tick the service commits this fault.
    pub fn new(inner: &'a T, fault: Option<Fault>) -> Self {
        Self { inner, fault }
    }
}

impl<T: Transport> Transport for Witness<'_, T> {
    type Publisher<P: Payload> = Filled<T::Publisher<P>>;
    type Subscriber<P: ServicePayload> = Seen<T::Subscriber<P>>;

    fn publisher<P: Payload>(&self, robot: usize) -> Result<Self::Publisher<P>, ConnectError> {
        let (topic, fault) = (Topic::of::<P>(robot), self.fault);
        Ok(Filled { inner: self.inner.publisher(robot)?, topic, fault })
    }

    fn subscriber<P: ServicePayload>(&self, robot: usize) -> Result<Self::Subscriber<P>, ConnectError> {
        Ok(Seen { inner: self.inner.subscriber(robot)?, topic: Topic::of::<P>(robot) })
    }

    fn operator(&self) -> OperatorPort {
        self.inner.operator()
    }
}

/// What stands at this place of a frame: a number from 1 to 2, since transports may refuse what is not finite.
fn word_at(topic: Topic, tick: u64, index: usize) -> u64 {
    let name = topic.payload.bytes().fold(topic.robot as u64, |name, byte| name * 31 + u64::from(byte));
    let mixed = (name << 40 ^ tick << 16 ^ index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    1.0_f64.to_bits() | mixed >> 12
}

/// Fills what is published.
pub struct Filled<P> {
    inner: P,
    topic: Topic,
    fault: Option<Fault>,
}

impl<P: Payload, B: Publisher<P>> Publisher<P> for Filled<B> {
    type Loan<'a>
        = Filling<B::Loan<'a>>
    where
        B: 'a;

    fn loan(&mut self, tick: u64) -> Result<Self::Loan<'_>, TickError> {
        let fault = self.fault.filter(|_| tick == Fault::TICK);
        let mut inner = self.inner.loan(tick)?;
        // Drivers hand out what was sent last.
        *inner.payload_mut() = P::zeroed();
        Ok(Filling { inner, topic: self.topic, tick, fault })
    }
}

/// What is being published.
pub struct Filling<L> {
    inner: L,
    topic: Topic,
    tick: u64,
    fault: Option<Fault>,
}

impl<P: Payload, L: Loan<P>> Loan<P> for Filling<L> {
    fn payload_mut(&mut self) -> &mut P {
        self.inner.payload_mut()
    }

    fn send(mut self) -> Result<(), TickError> {
        let words: &mut [u64] = bytemuck::cast_slice_mut(bytemuck::bytes_of_mut(self.inner.payload_mut()));
        let tick = self.tick - u64::from(self.fault == Some(Fault::StaleFrame));
        for (index, word) in words.iter_mut().enumerate().filter(|(_, word)| **word == 0) {
            *word = word_at(self.topic, tick, index);
        }
        if self.fault == Some(Fault::FlippedBit)
            && let Some(last) = words.last_mut()
        {
            *last ^= 1;
        }
        self.inner.send()
    }
}

/// Looks at what is received, and removes what it was filled with.
pub struct Seen<S> {
    inner: S,
    topic: Topic,
}

impl<P: Payload, S: Subscriber<P>> Subscriber<P> for Seen<S> {
    fn receive(&mut self, tick: u64, frame: &mut Frame<P>) -> Result<(), TickError> {
        self.inner.receive(tick, frame)?;
        let words: &mut [u64] = bytemuck::cast_slice_mut(bytemuck::bytes_of_mut(&mut frame.payload));
        let mut said = 0;
        for (index, word) in words.iter_mut().enumerate() {
            if *word == word_at(self.topic, tick, index) {
                *word = 0;
            } else {
                said += 1;
            }
        }
        // A double says one number, or none where that is zero.
        if said > 1 || frame.envelope.tick != tick {
            eprintln!("{} of tick {tick}: {said} words are not what was sent", self.topic);
            return Err(TickError::TransportFailed { topic: self.topic });
        }
        Ok(())
    }
}
