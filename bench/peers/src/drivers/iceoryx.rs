//! iceoryx2 as its documentation has it: frames over publish-subscribe, and beside each such service an event service
//! of the same name, by which whoever sends wakes whoever sleeps. One that yields looks for frames, and needs no events.

use crate::driver::{Driver, DriverError, End, Receiver, Sender, Wait};
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{LogLevel, Node, NodeBuilder, SignalHandlingMode, ipc, set_log_level};
use iceoryx2::service::port_factory::{PortFactory as _, event, publish_subscribe};
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::Domain;
use std::path::Path;

/// Frames on their way at a time: one is used before the next comes.
const DEPTH: usize = 2;

type Frames = publish_subscribe::PortFactory<ipc::Service, [u8], ()>;
type Events = event::PortFactory<ipc::Service>;

/// iceoryx2.
pub struct Iceoryx {
    node: Node<ipc::Service>,
    wait: Wait,
}

impl Iceoryx {
    fn services(&self, end: End) -> Result<(Frames, Events), DriverError> {
        let name = end.name();
        let name = name.as_str().try_into().map_err(|error| DriverError(format!("{error:?}")))?;
        let frames = self.node.service_builder(&name).publish_subscribe::<[u8]>();
        let frames = frames.max_publishers(1).max_subscribers(1).subscriber_max_buffer_size(DEPTH);
        let frames = frames.history_size(0).enable_safe_overflow(false);
        let frames = frames.open_or_create().map_err(DriverError::of)?;
        let events = self.node.service_builder(&name).event().max_notifiers(1).max_listeners(1);
        Ok((frames, events.open_or_create().map_err(DriverError::of)?))
    }
}

impl Driver for Iceoryx {
    type Sender = ToService;
    type Receiver = FromService;

    fn open(place: &Path, _: ServiceId, wait: Wait) -> Result<Self, DriverError> {
        set_log_level(LogLevel::Fatal);
        let config = Domain::of(place).config().map_err(DriverError::of)?;
        let node = NodeBuilder::new().config(&config).signal_handling_mode(SignalHandlingMode::Disabled);
        Ok(Self { node: node.create::<ipc::Service>().map_err(DriverError::of)?, wait })
    }

    fn sender(&self, end: End) -> Result<ToService, DriverError> {
        let (frames, events) = self.services(end)?;
        let publisher =
            frames.publisher_builder().initial_max_slice_len(end.frame_bytes).max_loaned_samples(1);
        let publisher = publisher.create().map_err(DriverError::of)?;
        let notifier = match self.wait {
            Wait::Blocking if end.has_reader => {
                Some(events.notifier_builder().create().map_err(DriverError::of)?)
            }
            _ => None,
        };
        Ok(ToService { publisher, notifier, frames, events, is_connected: !end.has_reader })
    }

    fn receiver(&self, end: End) -> Result<FromService, DriverError> {
        let (frames, events) = self.services(end)?;
        let subscriber = frames.subscriber_builder().buffer_size(DEPTH).create().map_err(DriverError::of)?;
        let listener = match self.wait {
            Wait::Blocking => Some(events.listener_builder().create().map_err(DriverError::of)?),
            Wait::Yielding => None,
        };
        Ok(FromService { subscriber, listener })
    }
}

/// Publishes, and notifies.
pub struct ToService {
    publisher: Publisher<ipc::Service, [u8], ()>,
    notifier: Option<Notifier<ipc::Service>>,
    frames: Frames,
    events: Events,
    is_connected: bool,
}

impl Sender for ToService {
    fn send(&mut self, frame: &[u8]) -> Result<(), DriverError> {
        if !self.is_connected {
            Wait::yield_until(|| {
                let is_there = self.frames.dynamic_config().number_of_subscribers() == 1
                    && (self.notifier.is_none() || self.events.dynamic_config().number_of_listeners() == 1);
                Ok::<_, DriverError>(is_there.then_some(()))
            })?;
            self.publisher.update_connections().map_err(DriverError::of)?;
            self.is_connected = true;
        }
        let sample = self.publisher.loan_slice_uninit(frame.len()).map_err(DriverError::of)?;
        sample.write_from_slice(frame).send().map_err(DriverError::of)?;
        if let Some(notifier) = &self.notifier {
            notifier.notify().map_err(DriverError::of)?;
        }
        Ok(())
    }
}

/// Listens, and takes.
pub struct FromService {
    subscriber: Subscriber<ipc::Service, [u8], ()>,
    listener: Option<Listener<ipc::Service>>,
}

impl Receiver for FromService {
    fn receive(&mut self, frame: &mut [u8]) -> Result<(), DriverError> {
        let Self { subscriber, listener } = self;
        let mut take = || {
            let sample = subscriber.receive().map_err(DriverError::of)?;
            Ok(sample.map(|sample| frame.copy_from_slice(sample.payload())))
        };
        let Some(listener) = listener else { return Wait::yield_until(take) };
        loop {
            if take()?.is_some() {
                return Ok(());
            }
            listener.blocking_wait(|_| {}).map_err(DriverError::of)?;
        }
    }
}
