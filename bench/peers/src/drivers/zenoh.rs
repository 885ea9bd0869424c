//! Zenoh 1.x: peers that know one another's Unix domain sockets beforehand, and neither scout nor gossip. Each frame is
//! sent at once and none is dropped. Zenoh's shared memory is meant for what is larger than these frames, and not used.
//!
//! Whatever the wait, Zenoh's own threads sleep in the kernel and hand frames on: one that yields only takes them from
//! there without sleeping.

use crate::driver::{Driver, DriverError, End, Receiver, Sender, Wait};
use crate::team;
use mikoshi_ipc_types::ServiceId;
use std::path::Path;
use zenoh::handlers::{FifoChannel, FifoChannelHandler};
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::CongestionControl;
use zenoh::sample::Sample;
use zenoh::{Config, Session, Wait as _};

/// Frames on their way at a time, and some.
const DEPTH: usize = 16;

/// Zenoh.
pub struct Zenoh {
    session: Session,
    wait: Wait,
}

impl Driver for Zenoh {
    type Sender = ToKey;
    type Receiver = FromKey;

    fn open(place: &Path, service: ServiceId, wait: Wait) -> Result<Self, DriverError> {
        let endpoint =
            |service: ServiceId| format!("unixsock-stream/{}", place.join(format!("{service}.z")).display());
        // Every pair has one link: whoever comes first listens.
        let earlier = team::services().take_while(|other| *other != service).map(endpoint);
        let earlier: Vec<String> = earlier.collect();
        let mut config = Config::default();
        for (key, value) in [
            ("mode", "\"peer\"".to_owned()),
            ("listen/endpoints", format!("[{:?}]", endpoint(service))),
            ("connect/endpoints", format!("{earlier:?}")),
            // It tries again until the others are there.
            ("connect/timeout_ms", "30000".to_owned()),
            (
                "connect/retry",
                "{period_init_ms: 20, period_max_ms: 100, period_increase_factor: 1}".to_owned(),
            ),
            ("scouting/multicast/enabled", "false".to_owned()),
            ("scouting/gossip/enabled", "false".to_owned()),
        ] {
            config.insert_json5(key, &value).map_err(DriverError::of)?;
        }
        Ok(Self { session: zenoh::open(config).wait().map_err(DriverError::of)?, wait })
    }

    fn sender(&self, end: End) -> Result<ToKey, DriverError> {
        let publisher = self
            .session
            .declare_publisher(end.name())
            .congestion_control(CongestionControl::Block)
            .express(true)
            .wait();
        Ok(ToKey { publisher: publisher.map_err(DriverError::of)?, is_connected: !end.has_reader })
    }

    fn receiver(&self, end: End) -> Result<FromKey, DriverError> {
        let subscriber = self.session.declare_subscriber(end.name()).with(FifoChannel::new(DEPTH)).wait();
        Ok(FromKey { subscriber: subscriber.map_err(DriverError::of)?, wait: self.wait })
    }
}

/// Publishes to the topic's key.
pub struct ToKey {
    publisher: Publisher<'static>,
    is_connected: bool,
}

impl Sender for ToKey {
    fn send(&mut self, frame: &[u8]) -> Result<(), DriverError> {
        if !self.is_connected {
            Wait::yield_until(|| {
                let status = self.publisher.matching_status().wait().map_err(DriverError::of)?;
                Ok::<_, DriverError>(status.matching().then_some(()))
            })?;
            self.is_connected = true;
        }
        self.publisher.put(frame).wait().map_err(DriverError::of)
    }
}

/// Subscribes to the topic's key.
pub struct FromKey {
    subscriber: Subscriber<FifoChannelHandler<Sample>>,
    wait: Wait,
}

impl Receiver for FromKey {
    fn receive(&mut self, frame: &mut [u8]) -> Result<(), DriverError> {
        let sample = match self.wait {
            Wait::Blocking => self.subscriber.recv().map_err(DriverError::of)?,
            Wait::Yielding => Wait::yield_until(|| self.subscriber.try_recv().map_err(DriverError::of))?,
        };
        let payload = sample.payload().to_bytes();
        if payload.len() != frame.len() {
            return Err(DriverError(format!("{} bytes, not {}", payload.len(), frame.len())));
        }
        frame.copy_from_slice(&payload);
        Ok(())
    }
}
