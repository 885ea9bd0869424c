//! One file for each of what is compared. Mikoshi itself has none: it is the runtime's own transport.

#[cfg(feature = "dds")]
pub mod dds;
pub mod iceoryx;
pub mod raw;
pub mod sockets;
#[cfg(feature = "zenoh")]
pub mod zenoh;
