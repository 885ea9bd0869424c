//! An authority of the team's own, and a certificate by it for every host: nobody else's are believed.

use clap::Args;
use mikoshi_config::load_scenario;
use mikoshi_process::ServeError;
use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    KeyUsagePurpose,
};
use std::fs::{self, DirBuilder, OpenOptions};
use std::io::Write as _;
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};
use time::{Duration, OffsetDateTime};

/// `mikoshi-link certify`.
#[derive(Args)]
pub struct CertifyArguments {
    /// The scenario whose hosts they are for
    scenario: PathBuf,
    /// Where to put them; an authority that is there already is used again
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Only for this host
    #[arg(long, value_name = "NAME")]
    host: Option<String>,
    /// For how many days they are good, 3650 at most; a part of one will do
    #[arg(long, value_name = "N", default_value_t = 365.0, value_parser = parse_days)]
    days: f64,
}

/// For how long an authority is good, and nobody longer.
const AUTHORITY_DAYS: f64 = 3650.0;
const DAY_S: f64 = 86_400.0;
/// Clocks of hosts may differ by so much.
const LEEWAY: Duration = Duration::hours(1);

fn parse_days(text: &str) -> Result<f64, String> {
    let days = text.parse().map_err(|_| format!("expected a number of days, found {text:?}"))?;
    match (0.0..=AUTHORITY_DAYS).contains(&days) {
        true => Ok(days),
        false => Err(format!("expected 0 to {AUTHORITY_DAYS} days, found {days}")),
    }
}

fn days(count: f64) -> Duration {
    Duration::seconds_f64(count * DAY_S)
}

/// Makes them.
///
/// # Errors
/// The scenario is wrong, or has no such host; a file is there already or can't be written.
pub fn certify(arguments: &CertifyArguments) -> Result<(), ServeError> {
    let loaded = load_scenario(&arguments.scenario, &[], None).map_err(ServeError::configuration)?;
    let hosts = &loaded.scenario.hosts;
    let is_meant = |name: &str| arguments.host.as_deref().is_none_or(|host| host == name);
    if !hosts.iter().any(|host| is_meant(&host.name)) {
        let known: Vec<_> = hosts.iter().map(|host| host.name.as_str()).collect();
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        return Err(ServeError::configuration(format!("no such host in this scenario; it has {known}")));
    }
    let now = OffsetDateTime::now_utc();
    DirBuilder::new().recursive(true).mode(0o700).create(&arguments.out).map_err(ServeError::fault)?;
    let authority = authority(&arguments.out, now)?;
    for host in hosts.iter().filter(|host| is_meant(&host.name)) {
        let address = host.listen.rsplit_once(':').map_or(host.listen.as_str(), |(address, _)| address);
        let address = address.trim_matches(['[', ']']);
        let (certificate, key) = certificate(&host.name, address, &authority, now, days(arguments.days))?;
        write(&arguments.out.join(format!("{}.pem", host.name)), &certificate, 0o644, true)?;
        write(&arguments.out.join(format!("{}-key.pem", host.name)), &key, 0o600, true)?;
    }
    Ok(())
}

/// The authority in this folder, made if there is none.
fn authority(folder: &Path, now: OffsetDateTime) -> Result<Issuer<'static, KeyPair>, ServeError> {
    let (certificate, key) = (folder.join("ca.pem"), folder.join("ca-key.pem"));
    if certificate.exists() {
        let read = |path: &Path| {
            fs::read_to_string(path)
                .map_err(|error| ServeError::fault(format!("{}: {error}", path.display())))
        };
        let key = KeyPair::from_pem(&read(&key)?).map_err(ServeError::configuration)?;
        return Issuer::from_ca_cert_pem(&read(&certificate)?, key).map_err(ServeError::configuration);
    }
    let pair = KeyPair::generate().map_err(ServeError::fault)?;
    let mut params = CertificateParams::default();
    params.distinguished_name.push(DnType::CommonName, "Mikoshi team");
    params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
    (params.not_before, params.not_after) = (now - LEEWAY, now + days(AUTHORITY_DAYS));
    let signed = params.self_signed(&pair).map_err(ServeError::fault)?;
    write(&key, &pair.serialize_pem(), 0o600, false)?;
    write(&certificate, &signed.pem(), 0o644, false)?;
    Ok(Issuer::new(params, pair))
}

/// A certificate for a host that is found at this address, and its key.
fn certificate(
    name: &str,
    address: &str,
    authority: &Issuer<'static, KeyPair>,
    now: OffsetDateTime,
    good_for: Duration,
) -> Result<(String, String), ServeError> {
    let pair = KeyPair::generate().map_err(ServeError::fault)?;
    // Who connects knows the address, and the name stands where access is granted by it.
    let mut params = CertificateParams::new(vec![address.to_owned()]).map_err(ServeError::configuration)?;
    params.distinguished_name = rcgen::DistinguishedName::new();
    params.distinguished_name.push(DnType::CommonName, name);
    params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    params.extended_key_usages =
        vec![ExtendedKeyUsagePurpose::ServerAuth, ExtendedKeyUsagePurpose::ClientAuth];
    (params.not_before, params.not_after) = (now - LEEWAY, now + good_for);
    let signed = params.signed_by(&pair, authority).map_err(ServeError::fault)?;
    Ok((signed.pem(), pair.serialize_pem()))
}

/// Writes a file that gets its rights before it has content.
fn write(path: &Path, text: &str, mode: u32, may_replace: bool) -> Result<(), ServeError> {
    let fault = |error: std::io::Error| ServeError::fault(format!("{}: {error}", path.display()));
    if may_replace && path.exists() {
        fs::remove_file(path).map_err(fault)?;
    }
    let file = OpenOptions::new().write(true).create_new(true).mode(mode).open(path);
    file.and_then(|mut file| file.write_all(text.as_bytes())).map_err(fault)
}
