//! A session with all other hosts: by name, with certificates, and to say only what is one's own.

use crate::checkpoint::MAX_CHECKPOINT_BYTES;
use crate::keys::Keys;
use core::fmt::Write as _;
use mikoshi_config::RunSpec;
use mikoshi_config::scenario::Host;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use zenoh::{Config, Session, Wait as _};

/// Largest message that is put together from parts: no frame is larger, and no checkpoint.
const MAX_MESSAGE_BYTES: usize = MAX_CHECKPOINT_BYTES + (1 << 10);
/// For how long a session is kept of whose other side nothing is heard. Shorter than that is a cut that it outlives.
const LEASE_MS: u64 = 10_000;

/// Why there is no session.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {why}")]
pub struct SessionError {
    what: String,
    why: String,
}

impl SessionError {
    /// Something can't be, for this reason.
    pub fn of(what: impl Into<String>, why: impl ToString) -> Self {
        Self { what: what.into(), why: why.to_string() }
    }
}

/// How messages travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Carrier {
    /// QUIC: streams for what must arrive, and datagrams for what must arrive in time.
    Quic,
    /// QUIC's streams alone.
    QuicStream,
    /// TLS over TCP.
    Tls,
}

impl Carrier {
    /// What Zenoh calls a place that is reached so.
    pub fn endpoint(self, address: &str) -> String {
        match self {
            Self::Quic => format!("quic/{address}?mixed_rel=1"),
            Self::QuicStream => format!("quic/{address}"),
            Self::Tls => format!("tls/{address}"),
        }
    }
}

/// The files by which a host shows who it is, and knows who others are.
pub struct Certificates {
    pub(crate) authority: PathBuf,
    pub(crate) certificate: PathBuf,
    key: PathBuf,
}

impl Certificates {
    /// Of this host, in this folder.
    ///
    /// # Errors
    /// A file is missing, or others may read the key.
    pub fn of(folder: &Path, host: &str) -> Result<Self, SessionError> {
        use std::os::unix::fs::PermissionsExt as _;
        let found = Self {
            authority: folder.join("ca.pem"),
            certificate: folder.join(format!("{host}.pem")),
            key: folder.join(format!("{host}-key.pem")),
        };
        for file in [&found.authority, &found.certificate, &found.key] {
            let metadata = std::fs::metadata(file)
                .map_err(|error| SessionError::of(file.display().to_string(), error))?;
            if *file == found.key && metadata.permissions().mode() & 0o077 != 0 {
                return Err(SessionError::of(file.display().to_string(), "others may read it (chmod 600)"));
            }
        }
        Ok(found)
    }
}

/// Which parts a session has.
pub struct Parts {
    /// Where it listens.
    pub listen: Vec<String>,
    /// To whom it connects, again and again until they are there.
    pub connect: Vec<String>,
    /// Who may say what; everybody everything where that is none.
    pub access: Option<Value>,
}

/// Which hosts have something to say to each other: those between which frames go, and all with the one of the clock.
fn speak(pairs: &BTreeSet<(usize, usize)>, one: usize, other: usize) -> bool {
    pairs.contains(&(one.min(other), one.max(other)))
}

impl Parts {
    /// Of host `own` of this run. Of each pair of hosts the later one connects.
    pub fn of(
        run: &RunSpec,
        keys: &Keys,
        own: usize,
        pairs: &BTreeSet<(usize, usize)>,
        carrier: Carrier,
    ) -> Self {
        let hosts = &run.scenario.hosts;
        let endpoint = |host: &Host| carrier.endpoint(&host.listen);
        let earlier = hosts.iter().enumerate().take(own).filter(|(host, _)| speak(pairs, own, *host));
        Self {
            listen: vec![endpoint(&hosts[own])],
            connect: earlier.map(|(_, host)| endpoint(host)).collect(),
            access: Some(access(run, keys, own)),
        }
    }
}

/// Zenoh's own access control: whoever has a certificate as a host is heard under that host's keys, and is told what
/// he asks for of ours.
fn access(run: &RunSpec, keys: &Keys, own: usize) -> Value {
    let scenario = &run.scenario;
    let keys_of = |host: usize| keys.all_of(host);
    let (mut rules, mut subjects, mut policies) = (vec![], vec![], vec![]);
    for (index, host) in scenario.hosts.iter().enumerate().filter(|(index, _)| *index != own) {
        let name = &host.name;
        let rule = |id: String, messages: &[&str], flow: &str, keys: Vec<String>| json!({ "id": id, "messages": messages, "flows": [flow], "permission": "allow", "key_exprs": keys });
        rules.push(rule(format!("from-{name}"), &["put"], "ingress", keys_of(index)));
        rules.push(rule(format!("to-{name}"), &["put"], "egress", keys_of(own)));
        rules.push(rule(format!("asked-by-{name}"), &["declare_subscriber"], "ingress", keys_of(own)));
        rules.push(rule(format!("asked-of-{name}"), &["declare_subscriber"], "egress", keys_of(index)));
        subjects.push(json!({ "id": name, "cert_common_names": [name] }));
        let names = ["from", "to", "asked-by", "asked-of"].map(|kind| format!("{kind}-{name}"));
        policies.push(json!({ "rules": names, "subjects": [name] }));
    }
    json!({
        "enabled": true,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    })
}

/// Opens a session: it listens when this returns, and connects when others are there.
///
/// # Errors
/// An address can't be used, or a certificate.
pub fn open(parts: &Parts, certificates: &Certificates) -> Result<Session, SessionError> {
    let mut config = Config::default();
    let path = |path: &Path| json!(path);
    let tls = json!({
        "root_ca_certificate": path(&certificates.authority),
        "listen_private_key": path(&certificates.key),
        "listen_certificate": path(&certificates.certificate),
        "connect_private_key": path(&certificates.key),
        "connect_certificate": path(&certificates.certificate),
        "enable_mtls": true,
        "verify_name_on_connect": true,
        "close_link_on_expiration": true,
    });
    let mut settings = vec![
        ("mode", json!("peer")),
        ("listen/endpoints", json!(parts.listen)),
        ("connect/endpoints", json!(parts.connect)),
        ("connect/timeout_ms", json!(0)),
        ("connect/exit_on_failure", json!(false)),
        (
            "connect/retry",
            json!({ "period_init_ms": 50, "period_max_ms": 500, "period_increase_factor": 2.0 }),
        ),
        ("scouting/multicast/enabled", json!(false)),
        ("scouting/gossip/enabled", json!(false)),
        // For this process: what Zenoh counts. Others are not granted a look.
        ("adminspace/enabled", json!(true)),
        ("adminspace/permissions", json!({ "read": true, "write": false })),
        ("transport/link/protocols", json!(["tls", "quic"])),
        ("transport/link/tls", tls),
        ("transport/link/tx/lease", json!(LEASE_MS)),
        (
            "transport/link/tx/queue/size",
            json!({
                "control": 2, "real_time": 16, "interactive_high": 2, "interactive_low": 2,
                "data_high": 2, "data": 16, "data_low": 2, "background": 2,
            }),
        ),
        // Most of a frame is the zeros of robots that a team does not have.
        ("transport/unicast/compression/enabled", json!(true)),
        ("transport/link/rx/max_message_size", json!(MAX_MESSAGE_BYTES)),
    ];
    if let Some(access) = &parts.access {
        settings.push(("access_control", access.clone()));
    }
    for (key, value) in settings {
        config.insert_json5(key, &value.to_string()).map_err(|error| SessionError::of(key, error))?;
    }
    let opened = zenoh::open(config).wait();
    opened.map_err(|error| {
        let mut what = String::from("no session with the other hosts");
        // Writing to a string can't fail.
        let _ = write!(what, " by {}", parts.listen.join(", "));
        SessionError::of(what, error)
    })
}
