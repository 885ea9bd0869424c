//! `mikoshi-link measure`: messages as large and as many as a robot's, to another host and back, over what frames
//! travel over. What comes of it says which delay a team can live with, before anything walks.

use crate::latency::{Latencies, fitting_delay_ticks};
use crate::session::{Carrier, Certificates, Parts, open};
use clap::{Args, Subcommand};
use core::sync::atomic::{AtomicU64, Ordering};
use core::time::Duration;
use mikoshi_ipc_types::{Frame, RobotState, TeamCommand};
use mikoshi_process::ServeError;
use mikoshi_runtime::{now_ns, sleep_until};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use zenoh::qos::{CongestionControl, Priority, Reliability};
use zenoh::sample::Locality;
use zenoh::{Session, Wait as _};

/// `mikoshi-link measure`.
#[derive(Args)]
pub struct MeasureArguments {
    #[command(subcommand)]
    side: Side,
}

#[derive(Subcommand)]
enum Side {
    /// Answer whoever measures
    Answer {
        #[command(flatten)]
        common: Common,
        /// Where to listen, as ADDRESS:PORT
        #[arg(long, value_name = "ADDRESS")]
        listen: String,
    },
    /// Ask, and print what came of it as JSON
    Ask {
        #[command(flatten)]
        common: Common,
        /// Who answers, as ADDRESS:PORT
        #[arg(long, value_name = "ADDRESS")]
        connect: String,
        /// How many messages
        #[arg(long, value_name = "N", default_value_t = 4000)]
        count: u64,
        /// A tick
        #[arg(long, value_name = "S", default_value_t = 0.005)]
        period_s: f64,
        /// How often each is sent again
        #[arg(long, value_name = "N", default_value_t = 0)]
        repeats: u8,
        /// How long after \[µs\]
        #[arg(long, value_name = "US", default_value_t = 1000)]
        repeat_after_us: u64,
    },
}

#[derive(Args)]
struct Common {
    /// Where certificates are
    #[arg(long, value_name = "DIR")]
    certificates: PathBuf,
    /// Whose
    #[arg(long, value_name = "NAME")]
    host: String,
    /// Over what
    #[arg(long, value_enum, default_value = "quic")]
    over: Carrier,
    /// All messages arrive, however late
    #[arg(long)]
    reliable: bool,
}

const QUESTION: &str = "mikoshi/measure/question";
const ANSWER: &str = "mikoshi/measure/answer";
/// How long the last answers are waited for.
const PATIENCE: Duration = Duration::from_secs(2);

/// Measures, or answers.
///
/// # Errors
/// There is no session, or nobody answers.
pub fn measure(arguments: &MeasureArguments) -> Result<(), ServeError> {
    match &arguments.side {
        Side::Answer { common, listen } => answer(common, listen),
        Side::Ask { common, connect, count, period_s, repeats, repeat_after_us } => {
            ask(common, connect, *count, *period_s, (*repeats, *repeat_after_us))
        }
    }
}

fn session(common: &Common, listen: Option<&str>, connect: Option<&str>) -> Result<Session, ServeError> {
    let certificates =
        Certificates::of(&common.certificates, &common.host).map_err(ServeError::configuration)?;
    let endpoint =
        |address: Option<&str>| address.map(|address| common.over.endpoint(address)).into_iter().collect();
    let parts = Parts { listen: endpoint(listen), connect: endpoint(connect), access: None };
    open(&parts, &certificates).map_err(ServeError::fault)
}

fn publisher(
    session: &Session,
    key: &'static str,
    is_reliable: bool,
) -> Result<zenoh::pubsub::Publisher<'static>, ServeError> {
    let (congestion, reliability) = match is_reliable {
        true => (CongestionControl::Block, Reliability::Reliable),
        false => (CongestionControl::Drop, Reliability::BestEffort),
    };
    let publisher =
        session.declare_publisher(key).priority(Priority::RealTime).congestion_control(congestion);
    let publisher = publisher.reliability(reliability).express(true).allowed_destination(Locality::Remote);
    publisher.wait().map_err(ServeError::fault)
}

/// As long as somebody lets it.
fn answer(common: &Common, listen: &str) -> Result<(), ServeError> {
    let session = session(common, Some(listen), None)?;
    let answers = publisher(&session, ANSWER, common.reliable)?;
    let body = vec![0_u8; size_of::<Frame<TeamCommand>>()];
    let reply = move |sample: zenoh::sample::Sample| {
        let question = sample.payload().to_bytes();
        let mut message = body.clone();
        if let Some(number) = question.get(..8) {
            message[..8].copy_from_slice(number);
            let _ = answers.put(message).wait();
        }
    };
    let _subscriber =
        session.declare_subscriber(QUESTION).callback(reply).wait().map_err(ServeError::fault)?;
    loop {
        std::thread::park();
    }
}

fn ask(
    common: &Common,
    connect: &str,
    count: u64,
    period_s: f64,
    (repeats, repeat_after_us): (u8, u64),
) -> Result<(), ServeError> {
    let session = session(common, None, Some(connect))?;
    let questions = publisher(&session, QUESTION, common.reliable)?;
    let sent: Arc<Vec<AtomicU64>> = Arc::new((0..count).map(|_| AtomicU64::new(0)).collect());
    let latencies = Arc::new(Mutex::new(Latencies::default()));
    let (sent_there, noted) = (Arc::clone(&sent), Arc::clone(&latencies));
    let hear = move |sample: zenoh::sample::Sample| {
        let answer = sample.payload().to_bytes();
        let number = answer.first_chunk().map(|bytes| u64::from_le_bytes(*bytes));
        let sent = number.and_then(|number| sent_there.get(usize::try_from(number).ok()?));
        // The first answer of each counts.
        let sent_ns = sent.map_or(0, |sent| sent.swap(0, Ordering::AcqRel));
        if sent_ns > 0 {
            noted.lock().unwrap_or_else(PoisonError::into_inner).note(now_ns().saturating_sub(sent_ns));
        }
    };
    let _subscriber = session.declare_subscriber(ANSWER).callback(hear).wait().map_err(ServeError::fault)?;
    let begin_ns = now_ns();
    while !questions.matching_status().wait().map_err(ServeError::fault)?.matching() {
        if u128::from(now_ns() - begin_ns) > 5 * PATIENCE.as_nanos() {
            return Err(ServeError::fault(format!("nobody answers at {connect}")));
        }
        sleep_until(now_ns() + 10_000_000);
    }
    let start_ns = now_ns();
    let period_ns = (period_s * 1e9) as u64;
    for number in 0..count {
        sleep_until(start_ns + number * period_ns);
        let mut message = vec![0_u8; size_of::<Frame<RobotState>>()];
        message[..8].copy_from_slice(&number.to_le_bytes());
        sent[number as usize].store(now_ns(), Ordering::Release);
        for repeat in 0..=u64::from(repeats) {
            if repeat > 0 {
                sleep_until(now_ns() + 1000 * repeat_after_us);
            }
            questions.put(message.clone()).wait().map_err(ServeError::fault)?;
        }
    }
    sleep_until(now_ns() + PATIENCE.as_nanos() as u64);
    let found = latencies.lock().unwrap_or_else(PoisonError::into_inner).quantiles();
    let found = found.ok_or_else(|| ServeError::fault("no answer came"))?;
    let text = serde_json::json!({
        "sent": count,
        "lost": count - found.count,
        "round_trip": found,
        "fitting_delay_ticks": fitting_delay_ticks(&found, period_s),
    });
    println!("{text:#}");
    Ok(())
}
