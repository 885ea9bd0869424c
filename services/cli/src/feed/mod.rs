//! What a supervisor sees of its run, for other processes: all frames of every tick, through a socket in the run's
//! directory. No service knows who listens there.
//!
//! Whoever connects says by one byte how it wants to be served. What it gets is a sequence of messages:
//!
//! ```text
//! kind    u8
//! length  u32, little endian
//! body    1  tick      all frames of a tick, envelopes and payloads, in canonical order
//!         2  revision  tick u64, index of a service u64, the run as that service has it from then on
//!         3  lost      u64: ticks that did not fit since the last of these messages
//!         4  end       nothing: the run has ended
//! ```
//!
//! A listener that is slow loses whole ticks, and is told how many. In lockstep one that wants all of them holds up
//! the run, as its own log does; one that does not move at all is given up.

mod listener;
mod server;

pub use listener::{Heard, Listener, listen_to};
pub use server::Feed;

const SOCKET: &str = "feed";
/// Before a body: its kind and length.
const HEAD_BYTES: usize = 5;

/// How a listener wants to be served.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Wish {
    /// Every tick, if the run can wait.
    All = b'A',
    /// What it can take.
    Some = b'S',
}

impl Wish {
    fn of_byte(byte: u8) -> Option<Self> {
        [Self::All, Self::Some].into_iter().find(|wish| *wish as u8 == byte)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Kind {
    Tick = 1,
    Revision,
    Lost,
    End,
}

impl Kind {
    fn of_byte(byte: u8) -> Option<Self> {
        [Self::Tick, Self::Revision, Self::Lost, Self::End].into_iter().find(|kind| *kind as u8 == byte)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_config::{RunSpec, load_scenario};
    use mikoshi_ipc_types::ServiceId;
    use mikoshi_observation::Observation;
    use std::io::Write;
    use std::os::unix::net::UnixStream;
    use std::path::Path;

    const ROBOTS: usize = 2;

    fn tick(tick: u64) -> Observation {
        let mut observation = Observation::for_team(ROBOTS);
        observation.object_truth.envelope.tick = tick;
        observation
    }

    fn run() -> RunSpec {
        let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
        let overrides = [("team".to_owned(), "two".to_owned())];
        let loaded = load_scenario(&scenario, &overrides, None).expect("a scenario");
        mikoshi_resolution::resolve(&loaded).expect("a run")
    }

    /// What a listener hears of a feed that says this once both are connected.
    fn heard(wish: Wish, says: impl FnOnce(&mut Feed, &Path)) -> Vec<String> {
        let folder = tempfile::tempdir().expect("a folder");
        let mut feed = Feed::open(folder.path(), ROBOTS).expect("a socket");
        let mut listener = Listener::connect(folder.path(), ROBOTS, wish).expect("it listens");
        while !feed.has_listeners() {
            feed.look();
        }
        says(&mut feed, folder.path());
        std::thread::scope(|scope| {
            scope.spawn(move || feed.end());
            let mut all = vec![];
            loop {
                match listener.hear().expect("it is well-formed") {
                    Heard::Tick(observation) => all.push(format!("tick {}", observation.tick())),
                    Heard::Revision { tick, service, .. } => all.push(format!("{service} from {tick}")),
                    Heard::Lost(ticks) => all.push(format!("lost {ticks}")),
                    Heard::End => return [all, vec!["end".to_owned()]].concat(),
                    Heard::Nothing => {}
                    Heard::Silence => return all,
                }
            }
        })
    }

    #[test]
    fn what_is_said_is_heard_in_its_order() {
        let run = run();
        let all = heard(Wish::All, |feed, _| {
            feed.tick(&tick(5));
            feed.revision(6, ServiceId::Servo(1), &run);
            feed.tick(&tick(6));
        });
        assert_eq!(all, ["tick 5", "servo-1 from 6", "tick 6", "end"]);
    }

    #[test]
    fn who_does_not_listen_in_time_loses_ticks_and_is_told_how_many() {
        let all = heard(Wish::Some, |feed, _| {
            for number in 0..20_000 {
                feed.tick(&tick(number));
            }
        });
        let heard = all.iter().filter(|text| text.starts_with("tick")).count();
        assert!(heard > 100 && heard < 20_000, "{heard}");
        assert_eq!(all[heard..], [format!("lost {}", 20_000 - heard), "end".to_owned()]);
    }

    #[test]
    fn the_run_waits_for_who_wants_all_but_not_for_one_that_does_not_move() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut feed = Feed::open(folder.path(), ROBOTS).expect("a socket");
        let some = Listener::connect(folder.path(), ROBOTS, Wish::Some).expect("it listens");
        while !feed.has_listeners() {
            feed.look();
        }
        for number in 0..20_000 {
            feed.tick(&tick(number));
        }
        assert!(!feed.is_behind(), "nobody waits for who takes what comes");
        drop(some);
        let frozen = Listener::connect(folder.path(), ROBOTS, Wish::All).expect("it listens");
        let mut number = 0;
        while !feed.is_behind() {
            feed.look();
            feed.tick(&tick(number));
            number += 1;
        }
        while feed.is_behind() {
            feed.look();
        }
        assert!(!feed.has_listeners(), "it was given up");
        drop(frozen);
    }

    #[test]
    fn whoever_says_nonsense_or_nothing_or_leaves_disturbs_nobody() {
        let all = heard(Wish::All, |feed, folder| {
            let connect = || UnixStream::connect(folder.join(SOCKET)).expect("it listens");
            let _silent = connect();
            let mut nonsense = connect();
            nonsense.write_all(b"?????").expect("it is read");
            drop(connect());
            for number in 0..10 {
                feed.look();
                feed.tick(&tick(number));
            }
        });
        assert_eq!(all.len(), 11, "{all:?}");
    }

    #[test]
    fn what_is_no_feed_is_refused() {
        for bytes in [&b"\x09\0\0\0\0"[..], b"\x01\x02\0\0\0??", b"\x01\xff\xff\xff\xff", b"\x03\x01\0\0\0?"]
        {
            let folder = tempfile::tempdir().expect("a folder");
            let socket =
                std::os::unix::net::UnixListener::bind(folder.path().join(SOCKET)).expect("a socket");
            let mut listener = Listener::connect(folder.path(), ROBOTS, Wish::All).expect("it listens");
            let (mut stream, _) = socket.accept().expect("it has connected");
            stream.write_all(bytes).expect("it is read");
            let heard = listener.hear();
            assert!(heard.is_err(), "{bytes:?}: {heard:?}");
        }
    }
}
