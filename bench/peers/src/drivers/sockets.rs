//! Unix domain sockets: datagrams, one socket for each topic.

use crate::driver::{Driver, DriverError, End, Receiver, Sender, Wait};
use mikoshi_ipc_types::ServiceId;
use std::io::ErrorKind;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};

/// Unix domain sockets.
pub struct Sockets {
    place: PathBuf,
    wait: Wait,
}

/// Sends to the topic's socket.
pub struct ToSocket {
    socket: UnixDatagram,
    /// Where the receiver is, until it is connected.
    to_connect: Option<PathBuf>,
    has_reader: bool,
}

/// Has the topic's socket.
pub struct FromSocket {
    socket: UnixDatagram,
    wait: Wait,
}

impl Driver for Sockets {
    type Sender = ToSocket;
    type Receiver = FromSocket;

    fn open(place: &Path, _: ServiceId, wait: Wait) -> Result<Self, DriverError> {
        Ok(Self { place: place.to_owned(), wait })
    }

    fn sender(&self, end: End) -> Result<ToSocket, DriverError> {
        let socket = UnixDatagram::unbound().map_err(DriverError::of)?;
        Ok(ToSocket { socket, to_connect: Some(self.place.join(end.name())), has_reader: end.has_reader })
    }

    fn receiver(&self, end: End) -> Result<FromSocket, DriverError> {
        let socket = UnixDatagram::bind(self.place.join(end.name())).map_err(DriverError::of)?;
        socket.set_nonblocking(self.wait == Wait::Yielding).map_err(DriverError::of)?;
        Ok(FromSocket { socket, wait: self.wait })
    }
}

impl Sender for ToSocket {
    fn send(&mut self, frame: &[u8]) -> Result<(), DriverError> {
        // A socket can't send to nobody: what only observers would see costs it nothing.
        if !self.has_reader {
            return Ok(());
        }
        if let Some(path) = self.to_connect.take() {
            Wait::yield_until(|| match self.socket.connect(&path) {
                Ok(()) => Ok(Some(())),
                Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::ConnectionRefused) => {
                    Ok(None)
                }
                Err(error) => Err(DriverError::of(error)),
            })?;
        }
        self.socket.send(frame).map(|_| ()).map_err(DriverError::of)
    }
}

impl Receiver for FromSocket {
    fn receive(&mut self, frame: &mut [u8]) -> Result<(), DriverError> {
        let received = match self.wait {
            Wait::Blocking => self.socket.recv(frame).map_err(DriverError::of),
            Wait::Yielding => Wait::yield_until(|| match self.socket.recv(frame) {
                Ok(bytes) => Ok(Some(bytes)),
                Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(None),
                Err(error) => Err(DriverError::of(error)),
            }),
        };
        match received? {
            bytes if bytes == frame.len() => Ok(()),
            bytes => Err(DriverError(format!("{bytes} bytes, not {}", frame.len()))),
        }
    }
}
