//! Frames of all kinds as bytes: what services of this host publish, and what those elsewhere have said.

use crate::gate::Gate;
use bytemuck::{bytes_of, pod_read_unaligned};
use mikoshi_ipc_types::{
    Envelope, Frame, JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Sensors, TeamCommand,
    TeamState,
};
use mikoshi_runtime::{ConnectError, IceoryxLink, IceoryxTransport, Publisher, TickError, Topic, Transport};

/// What a service of this host publishes.
pub trait Outlet {
    /// Hands the next frame to `send`, as its tick and the bytes of envelope and payload; whether there was one.
    ///
    /// # Errors
    /// It can't be received.
    fn take(&mut self, send: &mut dyn FnMut(u64, &[&[u8]])) -> Result<bool, TickError>;
}

impl<P: Payload> Outlet for mikoshi_runtime::Outlet<P> {
    fn take(&mut self, send: &mut dyn FnMut(u64, &[&[u8]])) -> Result<bool, TickError> {
        let Some(frame) = mikoshi_runtime::Outlet::take(self)? else { return Ok(false) };
        send(frame.envelope.tick, &[bytes_of(&frame.envelope), bytes_of(&frame.payload)]);
        Ok(true)
    }
}

/// Where the words of a service elsewhere are published on this host.
pub trait Inlet {
    /// Publishes a frame that the gate has let through.
    ///
    /// # Errors
    /// It can't be sent.
    fn publish(&mut self, tick: u64, frame: &[u8]) -> Result<(), TickError>;
}

struct PublisherOf<P: Payload>(<IceoryxTransport as Transport>::Publisher<P>);

impl<P: Payload> Inlet for PublisherOf<P> {
    fn publish(&mut self, tick: u64, frame: &[u8]) -> Result<(), TickError> {
        let payload = frame.get(size_of::<Envelope>()..size_of::<Frame<P>>());
        let payload = payload.ok_or(TickError::Service("a frame of another size"))?;
        self.0.send(tick, &pod_read_unaligned(payload))
    }
}

/// Does for a topic's payload what is said for `P`.
macro_rules! for_payload_of {
    ($topic:expr, $P:ident => $does:expr) => {{
        for_payload_of!(@ $topic, $P => $does; Sensors RobotState TeamCommand JointCommand TeamState ObjectTruth RobotTruth)
    }};
    (@ $topic:expr, $P:ident => $does:expr; $($payload:ident)*) => {
        match $topic.payload {
            $(<$payload as Payload>::NAME => {
                type $P = $payload;
                Ok($does)
            })*
            _ => Err(ConnectError::NotPublished { topic: $topic }),
        }
    };
}

/// What a service of this host publishes of this topic.
///
/// # Errors
/// Nobody does, or there is no room.
pub fn outlet(link: &IceoryxLink, topic: Topic) -> Result<Box<dyn Outlet>, ConnectError> {
    for_payload_of!(topic, P => Box::new(link.outlet::<P>(topic.robot)?) as Box<dyn Outlet>)
}

/// Where this topic is published by the one who stands in for its service.
///
/// # Errors
/// As [`outlet`].
pub fn inlet(ports: &IceoryxTransport, topic: Topic) -> Result<Box<dyn Inlet>, ConnectError> {
    for_payload_of!(topic, P => Box::new(PublisherOf::<P>(ports.publisher::<P>(topic.robot)?)) as Box<dyn Inlet>)
}

/// The gate for this topic.
///
/// # Errors
/// There is no such topic.
pub fn gate(run: u64, topic: Topic, age_ticks: u64) -> Result<Gate, ConnectError> {
    for_payload_of!(topic, P => Gate::of::<P>(run, topic.robot, age_ticks))
}
