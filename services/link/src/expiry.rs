//! When certificates of a host end: who hears of it in time makes new ones before a team stands.

use crate::session::{Certificates, SessionError};
use core::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};
use time::{Duration, OffsetDateTime};
use x509_parser::pem::parse_x509_pem;

/// How long before its end a certificate is spoken of.
const WARNED_BEFORE: Duration = Duration::days(30);

/// Of a host's own certificate and its authority's, the one that ends first.
pub struct Expiry {
    file: PathBuf,
    at: OffsetDateTime,
}

impl Expiry {
    /// Of these.
    ///
    /// # Errors
    /// A file can't be read, or is no certificate.
    pub fn of(certificates: &Certificates) -> Result<Self, SessionError> {
        let (own, authority) = (end_of(&certificates.certificate)?, end_of(&certificates.authority)?);
        Ok(if authority.at < own.at { authority } else { own })
    }

    /// Its day, year first.
    pub fn day(&self) -> String {
        self.at.date().to_string()
    }

    /// What is to be said of it now, if anything.
    pub fn warning(&self, now: OffsetDateTime) -> Option<String> {
        let Self { file, at } = self;
        let left = *at - now;
        let ends = match left.whole_days() {
            _ if left > WARNED_BEFORE => return None,
            _ if left <= Duration::ZERO => "has ended, and nobody listens to this host".to_owned(),
            0 => "ends within a day".to_owned(),
            1 => "ends tomorrow".to_owned(),
            days => format!("ends in {days} days"),
        };
        Some(format!(
            "{} {ends} ({at}): `mikoshi-link certify` makes a new one, and a link that is started anew reads it",
            file.display()
        ))
    }
}

fn end_of(file: &Path) -> Result<Expiry, SessionError> {
    let error = |problem: &dyn Display| SessionError::of(file.display().to_string(), problem);
    let text = fs::read(file).map_err(|problem| error(&problem))?;
    let (_, pem) = parse_x509_pem(&text).map_err(|problem| error(&problem))?;
    let certificate = pem.parse_x509().map_err(|problem| error(&problem))?;
    Ok(Expiry { file: file.to_owned(), at: certificate.validity().not_after.to_datetime() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends_at(at: OffsetDateTime) -> Expiry {
        Expiry { file: PathBuf::from("b.pem"), at }
    }

    #[test]
    fn a_month_before_its_end_it_is_spoken_of() {
        let at = OffsetDateTime::from_unix_timestamp(1_800_000_000).expect("a time");
        let said = |before: Duration| ends_at(at).warning(at - before).unwrap_or_default();
        assert_eq!(said(Duration::days(30) + Duration::seconds(1)), "");
        assert!(said(Duration::days(30)).starts_with("b.pem ends in 30 days (2027-01-15 8:00:00.0 "));
        assert!(said(Duration::hours(30)).contains("ends tomorrow"));
        assert!(said(Duration::seconds(1)).contains("ends within a day"));
        assert!(said(Duration::ZERO).contains("has ended"));
    }
}
