//! A host that means harm, for the cluster's test: it has the certificates it is given, and says what it likes.
//!
//! `hostile --certificates DIR --host NAME --connect ADDRESS --key KEY --run DIR --kind KIND --seconds N`

use bytemuck::{Zeroable, bytes_of};
use clap::{Parser, ValueEnum};
use mikoshi_ipc_types::{Envelope, Frame, Payload, RobotState};
use mikoshi_link::message::Header;
use mikoshi_link::session::{Carrier, Certificates, Parts, open};
use mikoshi_runtime::{now_ns, sleep_until};
use std::path::PathBuf;
use zenoh::qos::{CongestionControl, Priority, Reliability};
use zenoh::{Config, Wait as _};

#[derive(Parser)]
struct Arguments {
    #[arg(long)]
    certificates: PathBuf,
    #[arg(long)]
    host: String,
    /// It comes without a certificate.
    #[arg(long)]
    without: bool,
    #[arg(long)]
    connect: String,
    #[arg(long)]
    key: String,
    #[arg(long)]
    run: PathBuf,
    #[arg(long, overrides_with = "robot")]
    robot: u64,
    #[arg(long, value_enum)]
    kind: Kind,
    #[arg(long, default_value_t = 1.0)]
    seconds: f64,
    /// What its link is called.
    #[arg(long, default_value_t = 0)]
    incarnation: u64,
    /// Frames in a second.
    #[arg(long, default_value_t = 200.0)]
    rate: f64,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Kind {
    /// A frame of a tick that is long over.
    Replay,
    /// A frame of another build.
    Schema,
    /// A frame of a tick that is to come.
    Future,
    /// Frames of ticks that come, with what is no number.
    NotFinite,
    /// Bytes.
    Noise,
}

fn main() {
    let arguments = Arguments::parse();
    let session = if arguments.without {
        let mut config = Config::default();
        let tls = serde_json::json!({ "root_ca_certificate": arguments.certificates.join("ca.pem") });
        let endpoints = serde_json::json!([Carrier::Quic.endpoint(&arguments.connect)]);
        for (key, value) in [
            ("mode", serde_json::json!("peer")),
            ("connect/endpoints", endpoints),
            ("connect/timeout_ms", serde_json::json!(0)),
            ("connect/exit_on_failure", serde_json::json!(false)),
            ("listen/endpoints", serde_json::json!([])),
            ("scouting/multicast/enabled", serde_json::json!(false)),
            ("transport/link/tls", tls),
        ] {
            config.insert_json5(key, &value.to_string()).expect("it is a setting");
        }
        zenoh::open(config).wait().expect("a session")
    } else {
        let certificates = Certificates::of(&arguments.certificates, &arguments.host).expect("certificates");
        let connect = vec![Carrier::Quic.endpoint(&arguments.connect)];
        open(&Parts { listen: vec![], connect, access: None }, &certificates).expect("a session")
    };
    let publisher = session
        .declare_publisher(arguments.key.clone())
        .priority(Priority::RealTime)
        .congestion_control(CongestionControl::Drop)
        .reliability(Reliability::BestEffort)
        .express(true)
        .wait()
        .expect("a key");
    let run = std::fs::read(arguments.run.join("run.bin")).expect("the run");
    let run = mikoshi_config::RunSpec::decode(&run).expect("the run").encode();
    let run = u64::from_le_bytes(*blake3::hash(&run).as_bytes().first_chunk().expect("it is longer"));
    let begin_ns = now_ns();
    while session.info().peers_zid().wait().next().is_none() && now_ns() - begin_ns < 3_000_000_000 {
        sleep_until(now_ns() + 10_000_000);
    }
    let is_connected = session.info().peers_zid().wait().next().is_some();
    let (period_ns, start_ns, mut sent) = ((1e9 / arguments.rate) as u64, now_ns(), 0_u64);
    while is_connected && (now_ns() - start_ns) as f64 / 1e9 < arguments.seconds {
        let mut frame = Frame::<RobotState>::zeroed();
        let mut header = Header::new(run, arguments.incarnation, now_ns());
        frame.envelope = Envelope { tick: 1, robot: arguments.robot, epoch: 1, ..frame.envelope };
        match arguments.kind {
            Kind::Replay => {}
            Kind::Schema => frame.envelope.schema_hash ^= 1,
            Kind::Future => frame.envelope.tick = 1 << 40,
            Kind::NotFinite => frame.payload = poisoned(),
            Kind::Noise => header = Header::zeroed(),
        }
        let message = header.with(&[bytes_of(&frame.envelope), bytes_of(&frame.payload)]);
        if publisher.put(message).wait().is_ok() {
            sent += 1;
        }
        if period_ns > 20_000 || sent.is_multiple_of(64) {
            sleep_until(start_ns + sent * period_ns);
        }
    }
    sleep_until(now_ns() + 200_000_000);
    println!("{}", serde_json::json!({ "connected": is_connected, "sent": sent }));
}

fn poisoned() -> RobotState {
    let mut payload = RobotState::zeroed();
    let field = RobotState::FIELDS.iter().find(|field| field.scalar == mikoshi_ipc_types::Scalar::Float);
    let at = field.expect("it has numbers").offset_bytes;
    bytemuck::bytes_of_mut(&mut payload)[at..at + 8].copy_from_slice(&f64::NAN.to_le_bytes());
    payload
}
