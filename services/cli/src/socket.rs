//! Sockets in a run's directory. Only the run's own user, and root, is heard there.

use nix::sys::socket::{getsockopt, sockopt::PeerCredentials};
use rustix::process::{Uid, getuid};
use std::fs;
use std::io;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;

/// Listens at `path`, without ever waiting there. What a supervisor that was killed has left is in nobody's way: who
/// asks has the run.
pub fn listen(path: &Path) -> io::Result<UnixListener> {
    let _ = fs::remove_file(path);
    let listener = UnixListener::bind(path)?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

/// The next who has come, if it may: the system says who it is. It is not waited for.
pub fn accept(listener: &UnixListener) -> Option<UnixStream> {
    let (stream, _) = listener.accept().ok()?;
    let peer = getsockopt(&stream, PeerCredentials).ok()?;
    may_enter(Uid::from_raw(peer.uid()), getuid())
        .then_some(stream)
        .filter(|stream| stream.set_nonblocking(true).is_ok())
}

fn may_enter(peer: Uid, own: Uid) -> bool {
    peer == own || peer.is_root()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_its_own_user_and_root_may_enter() {
        let [own, other] = [1000, 1001].map(Uid::from_raw);
        let may = [own, Uid::ROOT, other].map(|peer| may_enter(peer, own));
        assert_eq!(may, [true, true, false]);
        assert!(!may_enter(other, Uid::ROOT));
    }
}
