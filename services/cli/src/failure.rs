//! How a command ends when it does not end well.

use core::error::Error;
use core::fmt::{self, Write as _};
use std::process::ExitCode;

/// What the exit status says. Scripts rely on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The run met its scenario's thresholds; the command did what it was asked to.
    Met,
    /// The run did not meet its thresholds.
    NotMet,
    /// Bad usage or configuration.
    Usage,
    /// A fault of the system.
    Fault,
    /// A signal ended it.
    Signal(u8),
}

impl Status {
    /// The exit status.
    pub fn code(self) -> u8 {
        match self {
            Self::Met => 0,
            Self::NotMet => 1,
            Self::Usage => 2,
            Self::Fault => 3,
            Self::Signal(number) => 128_u8.saturating_add(number),
        }
    }
}

impl From<Status> for ExitCode {
    fn from(status: Status) -> Self {
        Self::from(status.code())
    }
}

/// Why a command ended, for people and for scripts.
#[derive(Debug)]
pub struct Failure {
    /// For scripts.
    pub status: Status,
    /// For people: what, where, and what was expected. Further lines say how to put it right.
    pub message: String,
}

impl Failure {
    /// Bad usage or configuration.
    pub fn usage(error: impl Into<Box<dyn Error>>) -> Self {
        Self { status: Status::Usage, message: with_causes(&*error.into()) }
    }

    /// A fault of the system.
    pub fn fault(error: impl Into<Box<dyn Error>>) -> Self {
        Self { status: Status::Fault, message: with_causes(&*error.into()) }
    }

    /// One line of JSON: `{"error": {"status", "message"}}`.
    pub fn to_json(&self) -> String {
        serde_json::json!({ "error": { "status": self.status.code(), "message": self.message } }).to_string()
    }

    /// The same with what was being done.
    pub fn context(mut self, what: impl fmt::Display) -> Self {
        self.message = format!("{what}: {}", self.message);
        self
    }
}

/// An error and what caused it, unless its text says so already.
fn with_causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        let cause_text = cause.to_string();
        if !text.contains(&cause_text) {
            // Writing to a string can't fail.
            let _ = write!(text, ": {cause_text}");
        }
        source = cause.source();
    }
    text
}

/// Every line of a message, each with `error: ` or the room for it in front.
pub fn as_lines(kind: &str, message: &str) -> String {
    let mut text = String::new();
    for (index, line) in message.lines().enumerate() {
        let _ = match index {
            0 => writeln!(text, "{kind}: {line}"),
            _ => writeln!(text, "{:1$}{line}", "", kind.len() + 2),
        };
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("cause")]
    struct Cause;

    #[derive(Debug, thiserror::Error)]
    #[error("{text}")]
    struct Outer {
        text: &'static str,
        source: Cause,
    }

    #[test]
    fn causes_are_told_once() {
        let told = Outer { text: "outer: cause", source: Cause };
        assert_eq!(Failure::usage(told).message, "outer: cause");
        let untold = Outer { text: "outer", source: Cause };
        assert_eq!(Failure::fault(untold).message, "outer: cause");
    }

    #[test]
    fn as_json_an_error_is_one_line_whatever_it_says() {
        let failure = Failure::usage("a \"b\"\nc");
        assert_eq!(failure.to_json(), r#"{"error":{"message":"a \"b\"\nc","status":2}}"#);
    }

    #[test]
    fn further_lines_stand_below_the_first() {
        assert_eq!(as_lines("error", "a\nb"), "error: a\n       b\n");
    }
}
