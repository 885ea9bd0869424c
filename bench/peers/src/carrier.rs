//! What is compared.

use clap::ValueEnum;
use core::fmt;
use serde::Serialize;

/// What carries the frames of a team.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Carrier {
    /// Raw shared memory: the floor.
    Raw,
    /// Mikoshi as it ships: checked frames, checkpoints, a board, and an observer of every frame.
    Mikoshi,
    /// The same without the observer.
    MikoshiUnobserved,
    /// iceoryx2, with its events where one sleeps.
    Iceoryx2,
    /// Unix domain sockets.
    Sockets,
    /// Zenoh, over Unix domain sockets.
    #[cfg(feature = "zenoh")]
    Zenoh,
    /// CycloneDDS, over the loopback interface.
    #[cfg(feature = "dds")]
    Cyclonedds,
}

impl Carrier {
    /// Whether it is what people would use instead.
    pub fn is_peer(self) -> bool {
        !matches!(self, Self::Raw | Self::Mikoshi | Self::MikoshiUnobserved)
    }
}

impl fmt::Display for Carrier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.to_possible_value().as_ref().map_or("", |value| value.get_name()))
    }
}
