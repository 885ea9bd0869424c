//! Sockets in a run's directory.

use std::fs;
use std::io;
use std::os::unix::net::UnixListener;
use std::path::Path;

/// Listens at `path`, without ever waiting there. What a supervisor that was killed has left is in nobody's way: who
/// asks has the run.
pub fn listen(path: &Path) -> io::Result<UnixListener> {
    let _ = fs::remove_file(path);
    let listener = UnixListener::bind(path)?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}
