//! Says hello to the others, and writes down what is counted, beside the frames.

use crate::expiry::Expiry;
use crate::keys::Keys;
use crate::latency::{Quantiles, fitting_delay_ticks};
use crate::peers::{PeerReport, Peers};
use crate::session::SessionError;
use crate::standby::Kept;
use crate::traffic::Source;
use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use mikoshi_config::RunSpec;
use mikoshi_process::journal::{About, Severity, say};
use mikoshi_runtime::Board;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError};
use std::thread::{self, JoinHandle};
use time::OffsetDateTime;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Locality;
use zenoh::{Session, Wait as _};

/// How often others hear of us.
const HELLO: Duration = Duration::from_millis(50);
/// How many hellos lie between two reports.
const HELLOS_A_REPORT: u64 = 20;
/// And between two looks at when certificates end: a day.
const HELLOS_A_DAY: u64 = 86_400_000 / HELLO.as_millis() as u64;
/// The report, in the run's directory.
const REPORT: &str = "link.json";

/// What there is to tell, beside frames.
pub struct Told<'a> {
    /// Who the others are, and who this host is.
    pub peers: Arc<Peers>,
    /// Where frames come from.
    pub sources: &'a [Arc<Source>],
    /// What is kept here for successors of others' services.
    pub kept: Vec<Arc<Kept>>,
    /// When certificates end.
    pub expiry: Expiry,
}

/// A thread beside the carrier.
pub struct Reporter {
    state: Arc<Reported>,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

struct Reported {
    host: String,
    names: Vec<String>,
    period_s: f64,
    peers: Arc<Peers>,
    sources: Vec<Arc<Source>>,
    kept: Vec<Arc<Kept>>,
    path: PathBuf,
    session: Session,
    expiry: Expiry,
}

#[derive(Serialize)]
struct Report<'a> {
    host: &'a str,
    incarnation: u64,
    tick: Option<u64>,
    /// The day on which this host's certificate ends, or its authority's if that is sooner.
    certificate_ends: String,
    hosts: Vec<PeerReport<'a>>,
    /// What hosts have put under keys that are not theirs.
    refused_by_access_control: Option<u64>,
    /// Services for which another host stands by, or this one.
    standbys: Vec<StandbyReport<'a>>,
    topics: Vec<TopicReport<'a>>,
    /// Of the coordinator's commands to robots of this host.
    fitting_delay_ticks: Option<u64>,
}

#[derive(Serialize)]
struct StandbyReport<'a> {
    service: String,
    /// On which host it is in charge, as far as is known here.
    in_charge: Option<&'a str>,
    moves: u64,
    /// Of the checkpoint that came from the other host.
    kept_tick: Option<u64>,
    checkpoints: BTreeMap<&'static str, u64>,
}

#[derive(Serialize)]
struct TopicReport<'a> {
    topic: String,
    from: &'a str,
    frames: BTreeMap<&'static str, u64>,
    /// Of the newest frame that was let through.
    newest_tick: Option<u64>,
    one_way: Option<Quantiles>,
    round_trip: Option<Quantiles>,
}

impl Reported {
    fn report(&self) -> Report<'_> {
        let quantiles = |latencies: &std::sync::Mutex<crate::latency::Latencies>| {
            latencies.lock().unwrap_or_else(PoisonError::into_inner).quantiles()
        };
        let topics: Vec<_> = self
            .sources
            .iter()
            .map(|source| TopicReport {
                topic: source.topic.to_string(),
                from: &self.names[source.host],
                // In this order: no more frames than ticks were let through.
                frames: source.counters.snapshot(),
                newest_tick: source.next_tick.load(Ordering::Acquire).checked_sub(1),
                one_way: quantiles(&source.latencies),
                round_trip: quantiles(&source.round_trips),
            })
            .collect();
        let round_trips = topics.iter().filter_map(|topic| topic.round_trip);
        let fitting_delay_ticks = round_trips.map(|found| fitting_delay_ticks(&found, self.period_s)).max();
        let of_standby = |kept: &Arc<Kept>| StandbyReport {
            service: kept.service.to_string(),
            in_charge: self.peers.host_of(kept.service).map(|host| &*self.names[host]),
            moves: self.peers.moves_of(kept.service),
            kept_tick: kept.next_tick.load(Ordering::Acquire).checked_sub(1),
            checkpoints: kept.counters.snapshot(),
        };
        Report {
            standbys: self.kept.iter().map(of_standby).collect(),
            host: &self.host,
            incarnation: self.peers.incarnation(),
            tick: self.peers.tick(),
            certificate_ends: self.expiry.day(),
            hosts: self.peers.report(),
            refused_by_access_control: refused_by_access_control(&self.session),
            topics,
            fitting_delay_ticks,
        }
    }

    /// What can't be written is not worth a run.
    fn write(&self) {
        let text = serde_json::to_string_pretty(&self.report()).unwrap_or_default();
        let unfinished = self.path.with_extension("unfinished");
        let _ = fs::write(&unfinished, text).and_then(|()| fs::rename(&unfinished, &self.path));
    }
}

/// What Zenoh itself has refused, if it says so.
fn refused_by_access_control(session: &Session) -> Option<u64> {
    let selector = format!(
        "@/{}/peer/metrics?per_link=false;per_key=false;disconnected=true;descriptors=false;compression=false",
        session.zid()
    );
    let replies = session.get(selector).timeout(HELLO).wait().ok()?;
    let reply = replies.recv().ok()?;
    let text = reply.result().ok()?.payload().to_bytes().into_owned();
    let text = String::from_utf8(text).ok()?;
    let is_meant = |line: &&str| {
        line.contains("rx_network_message_dropped_payload_bytes_count") && line.contains("access-control")
    };
    let counts =
        text.lines().filter(is_meant).filter_map(|line| line.rsplit(' ').next()?.parse::<f64>().ok());
    Some(counts.sum::<f64>() as u64)
}

impl Reporter {
    /// Starts it.
    ///
    /// # Errors
    /// There is no board, or no key to speak under.
    pub fn start(
        directory: &Path,
        run: &RunSpec,
        host: usize,
        session: &Session,
        keys: &Keys,
        told: Told<'_>,
    ) -> Result<Self, SessionError> {
        let names: Vec<_> = run.scenario.hosts.iter().map(|host| host.name.clone()).collect();
        let key = keys.hello(&names[host]);
        let publisher = session
            .declare_publisher(key.clone())
            .priority(Priority::InteractiveHigh)
            .congestion_control(CongestionControl::Drop)
            .express(true)
            .allowed_destination(Locality::Remote)
            .wait()
            .map_err(|error| SessionError::of(key, error))?;
        let board = Board::open(directory).map_err(|error| SessionError::of("board", error))?;
        let state = Arc::new(Reported {
            host: names[host].clone(),
            names,
            period_s: run.scenario.wall_period_s(),
            peers: told.peers,
            sources: told.sources.to_vec(),
            kept: told.kept,
            expiry: told.expiry,
            path: directory.join(REPORT),
            session: session.clone(),
        });
        let is_over = Arc::new(AtomicBool::new(false));
        let (reported, over) = (Arc::clone(&state), Arc::clone(&is_over));
        let thread = thread::spawn(move || {
            for number in 0_u64.. {
                let _ = publisher.put(reported.peers.hello(&board)).wait();
                if number % HELLOS_A_REPORT == 0 {
                    reported.write();
                }
                if number % HELLOS_A_DAY == 0
                    && let Some(warning) = reported.expiry.warning(OffsetDateTime::now_utc())
                {
                    say(Severity::Warning, About::default(), warning);
                }
                if over.load(Ordering::Acquire) {
                    break;
                }
                pause(HELLO);
            }
        });
        Ok(Self { state, is_over, thread: Some(thread) })
    }

    /// Lets it go on for so long, and ends it.
    pub fn end_after(&self, farewell: Duration) {
        pause(farewell);
        self.is_over.store(true, Ordering::Release);
        self.state.write();
    }

    /// What was refused, for people.
    pub fn lines(&self) -> Vec<String> {
        let of_source = |source: &Arc<Source>| {
            let refused: Vec<_> =
                source.counters.refused().map(|(name, count)| format!("{count} {name}")).collect();
            let (topic, host) = (source.topic, &self.state.names[source.host]);
            (!refused.is_empty()).then(|| format!("{topic} of {host}: {}", refused.join(", ")))
        };
        self.state.sources.iter().filter_map(of_source).collect()
    }
}

impl Drop for Reporter {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // One that panicked has said so.
            let _ = thread.join();
        }
    }
}

#[expect(clippy::disallowed_methods, reason = "beside the frames, of which none waits for it")]
fn pause(time: Duration) {
    thread::sleep(time);
}
