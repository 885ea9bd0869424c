//! What hosts say of themselves, and what is known of the others: whose link is which, how far their services are, how
//! long the way there is, and what their clocks show. The latter two are for people: control goes by ticks alone.

use crate::gate::{Counters, Refusal};
use crate::message::{Header, Heard, Hello, MAX_PLACES, Progress};
use bytemuck::{Zeroable, bytes_of};
use core::sync::atomic::{AtomicU64, Ordering};
use core::time::Duration;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{Board, Role, State, now_ns};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Exchanges of which the shortest tells what the clock shows: it waited least.
const EXCHANGES: usize = 64;

/// The others, as they are known at the moment. Shared by the threads of a link.
pub struct Peers {
    own: usize,
    run: [u8; 32],
    incarnation: u64,
    /// In canonical order.
    services: Vec<Place>,
    peers: Vec<Peer>,
    /// One past the tick that the clock is in; 0 before the first.
    next_tick: AtomicU64,
    /// How often others were heard to say "stop".
    stops: AtomicU64,
}

/// Where a service lives.
struct Place {
    service: ServiceId,
    /// Its hosts, its own first: it moves from one to the next.
    hosts: Vec<usize>,
    /// How often it has: so of two who say that it is with them, everybody knows who is right.
    moves: AtomicU64,
}

impl Place {
    fn host_after(&self, moves: u64) -> Option<usize> {
        let index = moves.checked_rem(self.hosts.len() as u64)?;
        self.hosts.get(index as usize).copied()
    }

    fn moves(&self) -> u64 {
        self.moves.load(Ordering::Acquire)
    }
}

/// No service moves more often.
const MOST_MOVES: u64 = 1 << 32;
/// Of whom so long nothing was heard, by most hosts, is lost: another host takes over.
const LOST: Duration = Duration::from_secs(1);
/// What was heard of a host so long ago is no testimony.
const TESTIMONY: Duration = Duration::from_millis(250);

/// One other host.
struct Peer {
    name: String,
    counters: Counters,
    incarnation: AtomicU64,
    /// Whether it carries out the same run.
    is_foreign: AtomicU64,
    known: Mutex<Known>,
}

#[derive(Default)]
struct Known {
    services: Vec<Progress>,
    stops: u64,
    heard: Heard,
    /// For how long it had not heard of each host when it said so; none of whom it never has.
    silences_ns: Vec<Option<u64>>,
    /// When anything was heard of it, by our clock.
    exchanges: Vec<Exchange>,
    next: usize,
}

/// One way there and back.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Exchange {
    round_trip_ns: u64,
    /// What its clock is ahead of ours.
    offset_ns: i64,
}

impl Exchange {
    /// Of a message that was sent at `sent`, came there at `came`; the answer left at `left` and came here at `now`.
    fn of(sent: u64, came: u64, left: u64, now: u64) -> Option<Self> {
        let there_ns = left.checked_sub(came)?;
        let round_trip_ns = now.checked_sub(sent)?.checked_sub(there_ns)?;
        let (out, back) = (came as i128 - sent as i128, left as i128 - now as i128);
        Some(Self { round_trip_ns, offset_ns: ((out + back) / 2).try_into().ok()? })
    }
}

/// What is shown of another host.
#[derive(Debug, Serialize)]
pub struct PeerReport<'a> {
    host: &'a str,
    heard_s_ago: Option<f64>,
    is_of_another_run: bool,
    round_trip_s: Option<f64>,
    clock_ahead_s: Option<f64>,
    hello: BTreeMap<&'static str, u64>,
}

impl Peers {
    /// Of host `own` of this run, whose link has this number.
    pub fn new(run: &RunSpec, hash: [u8; 32], own: usize, incarnation: u64) -> Self {
        let place_of = |service| {
            let hosts: Vec<usize> = run.scenario.places_of(service).collect();
            (!hosts.is_empty()).then(|| Place { service, hosts, moves: AtomicU64::new(0) })
        };
        let peer = |name: &str| Peer {
            name: name.to_owned(),
            counters: Counters::default(),
            incarnation: AtomicU64::new(0),
            is_foreign: AtomicU64::new(0),
            known: Mutex::default(),
        };
        Self {
            own,
            run: hash,
            incarnation,
            services: ServiceId::of_team(run.robots.len()).filter_map(place_of).collect(),
            peers: run.scenario.hosts.iter().map(|host| peer(&host.name)).collect(),
            next_tick: AtomicU64::new(0),
            stops: AtomicU64::new(0),
        }
    }

    /// The beginning of the run's hash.
    pub fn run(&self) -> u64 {
        u64::from_le_bytes(*self.run.first_chunk().unwrap_or(&[0; 8]))
    }

    /// The number of our link.
    pub fn incarnation(&self) -> u64 {
        self.incarnation
    }

    /// A header of ours.
    pub fn header(&self) -> Header {
        Header::new(self.run(), self.incarnation, now_ns())
    }

    /// What we say of ourselves.
    pub fn hello(&self, board: &Board) -> Vec<u8> {
        let mut hello = Hello { run: self.run, stops: board.stops(), ..Hello::zeroed() };
        let knows_all = self.knows_all(board);
        for (place, known) in hello.services.iter_mut().zip(&self.services) {
            let (service, moves) = (&known.service, known.moves());
            if known.host_after(moves) == Some(self.own) {
                place.moves = moves;
                let state = board
                    .states()
                    .find_map(|(role, state)| (role == Role::Service(*service)).then_some(state));
                place.state = said_of(state.unwrap_or(State::Absent), knows_all) as u64;
                place.tick = board.last_position(*service).unwrap_or_default().tick;
            }
        }
        for (heard, peer) in hello.heard.iter_mut().zip(&self.peers) {
            *heard = peer.known().heard;
        }
        self.header().with(&[bytes_of(&hello)])
    }

    /// Whether all hosts have introduced themselves that services on this board exchange frames with.
    fn knows_all(&self, board: &Board) -> bool {
        let mut hosts = board.states().filter_map(|(role, _)| match role {
            Role::Service(service) => self.host_of(service),
            _ => None,
        });
        hosts.all(|host| host == self.own || self.incarnation_of(host) > 0)
    }

    /// Hears what another host says of itself; whether it says anything new.
    pub fn hear(&self, host: usize, message: &[u8]) -> bool {
        let peer = &self.peers[host];
        let heard = self.try_hear(host, message);
        peer.counters.count(&heard);
        heard.unwrap_or(false)
    }

    fn try_hear(&self, host: usize, message: &[u8]) -> Result<bool, Refusal> {
        let peer = &self.peers[host];
        let came_ns = now_ns();
        let (header, body) = Header::split(message).ok_or(Refusal::Malformed)?;
        let hello: Hello = bytemuck::try_pod_read_unaligned(body).map_err(|_| Refusal::Malformed)?;
        if hello.run != self.run || header.run != self.run() {
            peer.is_foreign.store(1, Ordering::Relaxed);
            return Err(Refusal::Run);
        }
        if hello.services.iter().any(|service| service.moves > MOST_MOVES) {
            return Err(Refusal::Malformed);
        }
        if header.incarnation < peer.incarnation.load(Ordering::Acquire) {
            return Err(Refusal::Incarnation);
        }
        // A service is where the host says that it has moved to, and nobody else. This is known before anything else
        // is heard of that host.
        let mut has_moved = false;
        for (place, said) in self.services.iter().zip(&hello.services) {
            if place.host_after(said.moves) == Some(host) {
                has_moved |= place.moves.fetch_max(said.moves, Ordering::AcqRel) < said.moves;
            }
        }
        // A link that was started anew has a larger number than its predecessor.
        let last = peer.incarnation.fetch_max(header.incarnation, Ordering::AcqRel);
        if header.incarnation < last {
            return Err(Refusal::Incarnation);
        }
        peer.is_foreign.store(0, Ordering::Relaxed);
        let mut known = peer.known();
        let is_new_link = header.incarnation > last;
        if !is_new_link && header.sent_ns <= known.heard.sent_ns {
            return Err(Refusal::Overtaken);
        }
        if is_new_link {
            known.exchanges.clear();
            known.next = 0;
        }
        known.heard = Heard { sent_ns: header.sent_ns, came_ns };
        let silence_ns = |heard: &Heard| {
            let has_heard = heard.came_ns > 0;
            has_heard.then(|| header.sent_ns.saturating_sub(heard.came_ns))
        };
        known.silences_ns = hello.heard.iter().map(silence_ns).collect();
        let ours = hello.heard.get(self.own).copied().unwrap_or_default();
        if let Some(exchange) =
            Exchange::of(ours.sent_ns, ours.came_ns, header.sent_ns, came_ns).filter(|_| ours.sent_ns > 0)
        {
            let next = known.next % EXCHANGES;
            match known.exchanges.get_mut(next) {
                Some(place) => *place = exchange,
                None => known.exchanges.push(exchange),
            }
            known.next += 1;
        }
        let is_new =
            known.services.iter().map(|service| service.state).ne(hello.services.iter().map(|s| s.state));
        known.services = hello.services.to_vec();
        // Of a link that was started anew it is not known how often it was said before.
        let is_to_stop = !is_new_link && hello.stops != known.stops;
        known.stops = hello.stops;
        if is_to_stop {
            self.stops.fetch_add(1, Ordering::AcqRel);
        }
        Ok(is_new || is_new_link || is_to_stop || has_moved)
    }

    /// Which link speaks for a host; 0 if none has introduced itself.
    pub fn incarnation_of(&self, host: usize) -> u64 {
        self.peers[host].incarnation.load(Ordering::Acquire)
    }

    /// How far a service elsewhere says it is, if its host has been heard.
    pub fn state_of(&self, service: ServiceId) -> Option<State> {
        let index = self.services.iter().position(|place| place.service == service)?;
        let peer = &self.peers[self.host_of(service)?];
        let code = peer.known().services.get(index)?.state;
        let states =
            [State::Absent, State::Retired, State::Starting, State::Wired, State::Ready, State::Running];
        let states = states.into_iter().chain([State::Done, State::Failed]);
        states.into_iter().find(|state| *state as u64 == code)
    }

    fn place_of(&self, service: ServiceId) -> Option<&Place> {
        self.services.iter().find(|place| place.service == service)
    }

    /// The host on which a service is in charge.
    pub fn host_of(&self, service: ServiceId) -> Option<usize> {
        let place = self.place_of(service)?;
        place.host_after(place.moves())
    }

    /// Whether a service is in charge on this host.
    pub fn is_here(&self, service: ServiceId) -> bool {
        self.host_of(service) == Some(self.own)
    }

    /// How often a service has moved.
    pub fn moves_of(&self, service: ServiceId) -> u64 {
        self.place_of(service).map_or(0, Place::moves)
    }

    /// It has moved so often, as is known from before.
    pub fn recall_moves(&self, service: ServiceId, moves: u64) {
        if let Some(place) = self.place_of(service) {
            place.moves.fetch_max(moves, Ordering::AcqRel);
        }
    }

    /// Has a service be in charge on this host, which is its next: from now on others are told so.
    pub fn take_over(&self, service: ServiceId) {
        if let Some(place) = self.place_of(service)
            && let moves = place.moves() + 1
            && place.host_after(moves) == Some(self.own)
        {
            place.moves.fetch_max(moves, Ordering::AcqRel);
        }
    }

    /// Whether a host is lost: neither this one nor most of all have heard of it for long. Of a team that is cut in two
    /// one part is the greater.
    pub fn is_lost(&self, host: usize) -> bool {
        let is_long = |silence: Duration| silence > LOST;
        let testifies = |(other, peer): (usize, &Peer)| {
            let is_fresh = self.silence_of(other).is_some_and(|silence| silence < TESTIMONY);
            let silence_ns = peer.known().silences_ns.get(host).copied().flatten();
            other != host && is_fresh && silence_ns.map(Duration::from_nanos).is_some_and(is_long)
        };
        let others = self.peers.iter().enumerate().filter(|(other, _)| *other != self.own);
        let witnesses = 1 + others.filter(|other| testifies(*other)).count();
        self.silence_of(host).is_some_and(is_long) && 2 * witnesses > self.peers.len()
    }

    /// For how long nothing has been heard of this host, if it ever was.
    pub fn silence_of(&self, host: usize) -> Option<Duration> {
        let came_ns = self.peers[host].known().heard.came_ns;
        (came_ns > 0).then(|| Duration::from_nanos(now_ns().saturating_sub(came_ns)))
    }

    /// What a host's clock is ahead of ours, by the exchange that waited least.
    pub fn offset_ns(&self, host: usize) -> Option<i64> {
        self.peers[host].known().shortest().map(|exchange| exchange.offset_ns)
    }

    /// The tick that the clock is in, once it has begun.
    pub fn tick(&self) -> Option<u64> {
        self.next_tick.load(Ordering::Acquire).checked_sub(1)
    }

    /// How often others were heard to say "stop".
    pub fn stops(&self) -> u64 {
        self.stops.load(Ordering::Acquire)
    }

    /// It has reached this tick; whether that is new.
    pub fn reach(&self, tick: u64) -> bool {
        let next_tick = tick.saturating_add(1);
        self.next_tick.fetch_max(next_tick, Ordering::AcqRel) < next_tick
    }

    /// What is shown of the others.
    pub fn report(&self) -> Vec<PeerReport<'_>> {
        let others = self.peers.iter().enumerate().filter(|(host, _)| *host != self.own);
        let report = |(_, peer): (usize, &'_ Peer)| {
            let known = peer.known();
            let shortest = known.shortest();
            let seconds = |ns: u64| ns as f64 / 1e9;
            (
                (known.heard.came_ns > 0).then(|| seconds(now_ns().saturating_sub(known.heard.came_ns))),
                shortest.map(|exchange| seconds(exchange.round_trip_ns)),
                shortest.map(|exchange| exchange.offset_ns as f64 / 1e9),
            )
        };
        others
            .map(|(host, peer)| {
                let (heard_s_ago, round_trip_s, clock_ahead_s) = report((host, peer));
                PeerReport {
                    host: &peer.name,
                    heard_s_ago,
                    is_of_another_run: peer.is_foreign.load(Ordering::Relaxed) != 0,
                    round_trip_s,
                    clock_ahead_s,
                    hello: peer.counters.snapshot(),
                }
            })
            .collect()
    }
}

impl Peer {
    fn known(&self) -> std::sync::MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Known {
    fn shortest(&self) -> Option<Exchange> {
        self.exchanges.iter().copied().min_by_key(|exchange| exchange.round_trip_ns)
    }
}

const _: () = assert!(MAX_PLACES >= 3);

/// What others are told of a service in this state. Who hears that it is ready begins to send, and frames of a host that
/// has not introduced itself are refused: so it is not before its own host knows all.
fn said_of(state: State, knows_all: bool) -> State {
    if state == State::Ready && !knows_all { State::Wired } else { state }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_config::load_scenario;
    use mikoshi_resolution::resolve;
    use std::path::Path;

    #[test]
    fn an_exchange_tells_the_way_and_the_clock() {
        // Its clock is ahead by 1000; 10 there, 5 in between, 20 back.
        let exchange = Exchange::of(100, 1110, 1115, 135).expect("it is one");
        assert_eq!(exchange, Exchange { round_trip_ns: 30, offset_ns: 995 });
        // Behind by more than we have counted.
        let exchange = Exchange::of(5000, 10, 20, 5020).expect("it is one");
        assert_eq!(exchange, Exchange { round_trip_ns: 10, offset_ns: -4995 });
    }

    #[test]
    fn what_can_not_have_been_is_no_exchange() {
        for (sent, came, left, now) in
            [(100, 20, 10, 200), (200, 1, 2, 100), (100, 0, 1000, 200), (0, u64::MAX, u64::MAX, u64::MAX)]
        {
            let found = Exchange::of(sent, came, left, now);
            assert!(found.is_none() || sent == 0, "{found:?}");
        }
    }

    const HASH: [u8; 32] = [7; 32];

    fn run() -> RunSpec {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
        let host = |name: &str, services: &str| {
            format!("{{ name = \"{name}\", services = [{services}], listen = \"{name}:7447\" }}")
        };
        let hosts = [host("stage", r#""bridge", "coordinator""#), host("robots", r#""A", "B""#)].join(", ");
        let set = [("team", "two".to_owned()), ("hosts", format!("[{hosts}]"))];
        let set = set.map(|(key, value)| (key.to_owned(), value));
        resolve(&load_scenario(&file, &set, None).expect("it is right")).expect("it can be run")
    }

    fn board(folder: &Path) -> Board {
        Board::create_for_host(folder, &ServiceId::of_team(2).collect::<Vec<_>>(), &[]).expect("a board")
    }

    #[test]
    fn nobody_is_ready_for_hosts_that_are_not_known() {
        let (run, folder) = (run(), tempfile::tempdir().expect("a folder"));
        let board = board(folder.path());
        let (stage, robots) = (Peers::new(&run, HASH, 0, 5), Peers::new(&run, HASH, 1, 20));
        assert!(!stage.knows_all(&board));
        stage.hear(1, &robots.hello(&board));
        assert!(stage.knows_all(&board) && !robots.knows_all(&board));
        assert_eq!(said_of(State::Ready, false), State::Wired);
        for (state, knows_all) in [(State::Ready, true), (State::Running, false), (State::Starting, false)] {
            assert_eq!(said_of(state, knows_all), state);
        }
    }

    #[test]
    fn who_introduces_himself_is_known_and_his_successor_after_him() {
        let (run, folder) = (run(), tempfile::tempdir().expect("a folder"));
        let board = board(folder.path());
        let stage = Peers::new(&run, HASH, 0, 5);
        assert_eq!((stage.incarnation_of(1), stage.silence_of(1)), (0, None));
        let robots = |incarnation| Peers::new(&run, HASH, 1, incarnation);
        assert!(stage.hear(1, &robots(20).hello(&board)));
        assert_eq!((stage.incarnation_of(1), stage.state_of(ServiceId::Servo(0))), (20, Some(State::Absent)));
        assert!(!stage.hear(1, &robots(20).hello(&board)), "nothing new");
        assert!(!stage.hear(1, &robots(19).hello(&board)), "it has a successor");
        assert!(stage.hear(1, &robots(21).hello(&board)));
        assert_eq!(stage.incarnation_of(1), 21);
        let refused: Vec<_> = stage.peers[1].counters.refused().collect();
        assert_eq!(refused, [("incarnation", 1)]);
    }

    #[test]
    fn another_run_bytes_and_what_was_said_before_are_refused() {
        let (run, folder) = (run(), tempfile::tempdir().expect("a folder"));
        let board = board(folder.path());
        let stage = Peers::new(&run, HASH, 0, 5);
        assert!(!stage.hear(1, &Peers::new(&run, [8; 32], 1, 20).hello(&board)));
        assert!(stage.report()[0].is_of_another_run && stage.incarnation_of(1) == 0);
        let robots = Peers::new(&run, HASH, 1, 20);
        let (first, second) = (robots.hello(&board), robots.hello(&board));
        assert!(stage.hear(1, &second));
        assert!(!stage.report()[0].is_of_another_run);
        for message in [&first[..], &second, &[], &second[1..], &[&second[..], &[0]].concat()] {
            assert!(!stage.hear(1, message));
        }
        let refused: Vec<_> = stage.peers[1].counters.refused().collect();
        assert_eq!(refused, [("malformed", 3), ("run", 1), ("overtaken", 2)]);
    }

    #[test]
    fn a_stop_is_heard_once_wherever_it_is_said() {
        let (run, folder) = (run(), tempfile::tempdir().expect("a folder"));
        let board = board(folder.path());
        let (stage, robots) = (Peers::new(&run, HASH, 0, 5), Peers::new(&run, HASH, 1, 20));
        board.say(mikoshi_ipc_types::operator::STOP);
        stage.hear(1, &robots.hello(&board));
        assert_eq!(stage.stops(), 0, "that was before it was known");
        board.say(mikoshi_ipc_types::operator::RESUME);
        stage.hear(1, &robots.hello(&board));
        assert_eq!(stage.stops(), 0, "whoever holds a robot's key lets no team go on");
        board.say(mikoshi_ipc_types::operator::STOP);
        assert!(stage.hear(1, &robots.hello(&board)));
        assert!(!stage.hear(1, &robots.hello(&board)));
        assert_eq!(stage.stops(), 1);
    }

    /// Stage, head, and a host for each of two robots, of which that of A stands by for the coordinator.
    fn run_of_four() -> RunSpec {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
        let host = |name: &str, service: &str, standbys: &str| {
            format!(
                "{{ name = \"{name}\", services = [\"{service}\"], listen = \"{name}:7447\", standbys = [{standbys}] }}"
            )
        };
        let hosts = [
            host("stage", "bridge", ""),
            host("head", "coordinator", "\"B\""),
            host("a", "A", "\"coordinator\""),
            host("b", "B", ""),
        ];
        let set = [("team", "two".to_owned()), ("hosts", format!("[{}]", hosts.join(", ")))];
        let set = set.map(|(key, value)| (key.to_owned(), value));
        resolve(&load_scenario(&file, &set, None).expect("it is right")).expect("it can be run")
    }

    #[test]
    fn a_service_is_where_the_host_says_that_the_number_names_and_the_greatest_number_counts() {
        const HEAD: usize = 1;
        const A: usize = 2;
        const B: usize = 3;
        let (run, folder) = (run_of_four(), tempfile::tempdir().expect("a folder"));
        let board = board(folder.path());
        let of = |host: usize| Peers::new(&run, HASH, host, 10 + host as u64);
        let (stage, head, a, b) = (of(0), of(HEAD), of(A), of(B));
        let coordinator = ServiceId::Coordinator;
        stage.hear(HEAD, &head.hello(&board));
        assert_eq!(stage.host_of(coordinator), Some(HEAD));
        // Its own host can't take it over from itself, nor one that does not stand by for it.
        head.take_over(coordinator);
        b.take_over(coordinator);
        assert_eq!((head.moves_of(coordinator), b.moves_of(coordinator)), (0, 0));
        a.take_over(coordinator);
        let moved = a.hello(&board);
        stage.hear(B, &moved);
        assert_eq!(stage.host_of(coordinator), Some(HEAD), "that is not its to say");
        assert!(stage.hear(A, &moved) && head.hear(A, &moved));
        assert_eq!((stage.host_of(coordinator), head.is_here(coordinator)), (Some(A), false));
        // The old one, as a new machine that knows nothing of it, is not believed.
        let anew = Peers::new(&run, HASH, HEAD, 99);
        stage.hear(HEAD, &anew.hello(&board));
        assert_eq!((stage.host_of(coordinator), stage.moves_of(coordinator)), (Some(A), 1));
        anew.hear(A, &a.hello(&board));
        anew.take_over(coordinator);
        stage.hear(HEAD, &anew.hello(&board));
        assert_eq!(
            (stage.host_of(coordinator), stage.moves_of(coordinator)),
            (Some(HEAD), 2),
            "in its turn it is"
        );
        anew.recall_moves(coordinator, MOST_MOVES + 2);
        assert!(!stage.hear(HEAD, &anew.hello(&board)));
        assert_eq!(stage.moves_of(coordinator), 2);
    }

    #[test]
    fn a_host_is_lost_when_most_have_lost_it() {
        const HEAD: usize = 1;
        let ms = |ms: u64| ms * 1_000_000;
        // For how long A has heard nothing of the head, of the stage and B, and what those say of the head.
        let is_lost = |own_ms: u64, others: [(u64, Option<u64>); 2]| {
            let a = Peers::new(&run_of_four(), HASH, 2, 5);
            let heard = |host: usize, silent_ms: u64, said_ms: Option<u64>| {
                let mut known = a.peers[host].known();
                known.heard.came_ns = now_ns() - ms(silent_ms);
                known.silences_ns = vec![None, said_ms.map(ms), None, None];
            };
            heard(HEAD, own_ms, None);
            heard(0, others[0].0, others[0].1);
            heard(3, others[1].0, others[1].1);
            a.is_lost(HEAD)
        };
        let gone = (20, Some(2000));
        assert!(is_lost(2000, [gone, gone]));
        assert!(!is_lost(500, [gone, gone]), "it has heard of it");
        assert!(!is_lost(2000, [gone, (20, Some(30))]), "two of four are not most");
        assert!(!is_lost(2000, [gone, (20, None)]), "who never heard of it can't say");
        assert!(!is_lost(2000, [gone, (2000, Some(2000))]), "who is silent says nothing");
        assert!(!is_lost(2000, [(2000, Some(30)), (2000, Some(30))]), "it is alone");
    }
}
