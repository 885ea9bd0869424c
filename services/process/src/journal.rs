//! Where a process's words go: with their fields to the journal, if the system has started it; else to standard error.
//!
//! `journalctl -t mikoshi-servo MIKOSHI_ROBOT=A MIKOSHI_FAULT=...` finds them there by tick, robot and fault.

use core::fmt::Display;
use std::env;
use std::io::{self, Write as _};
use std::sync::OnceLock;
use tracing_subscriber::EnvFilter;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// It goes on.
    Warning,
    /// It ends.
    Error,
}

/// What is known of what is said.
#[derive(Clone, Copy, Debug, Default)]
pub struct About<'a> {
    /// In which tick.
    pub tick: Option<u64>,
    /// Of which robot.
    pub robot: Option<&'a str>,
    /// Which fault, as summaries name it.
    pub fault: Option<&'a str>,
}

/// Whether this process's words go to the journal. The first who asks has it opened.
pub fn is_open() -> bool {
    static IS_OPEN: OnceLock<bool> = OnceLock::new();
    *IS_OPEN.get_or_init(|| {
        // So systemd tells whose standard error is the journal.
        let layer = env::var_os("JOURNAL_STREAM").and_then(|_| tracing_journald::layer().ok());
        layer.is_some_and(|layer| {
            let layer = layer.with_field_prefix(Some("MIKOSHI".to_owned()));
            tracing_subscriber::registry().with(filter()).with(layer).try_init().is_ok()
        })
    })
}

/// Warnings, also those of libraries; `MIKOSHI_LOG` changes what is told.
pub fn filter() -> EnvFilter {
    EnvFilter::try_from_env("MIKOSHI_LOG").unwrap_or_else(|_| EnvFilter::new("warn"))
}

/// Says it.
pub fn say(severity: Severity, about: About<'_>, message: impl Display) {
    let About { tick, robot, fault } = about;
    // Nobody is left to be told if it can't be written.
    let _ = match (is_open(), severity) {
        (true, Severity::Warning) => {
            tracing::warn!(tick, robot, fault, "{message}");
            Ok(())
        }
        (true, Severity::Error) => {
            tracing::error!(tick, robot, fault, "{message}");
            Ok(())
        }
        (false, Severity::Warning) => writeln!(io::stderr(), "warning: {message}"),
        (false, Severity::Error) => writeln!(io::stderr(), "error: {message}"),
    };
}
