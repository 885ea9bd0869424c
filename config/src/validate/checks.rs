//! The checks that keys have in common.

use core::fmt::Display;
use std::collections::BTreeSet;

/// A key and what is wrong with its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Violation {
    pub key: String,
    pub problem: String,
}

#[derive(Default)]
pub(super) struct Checks(pub Vec<Violation>);

impl Checks {
    pub fn require(&mut self, holds: bool, key: impl Display, found: impl Display, expected: impl Display) {
        if !holds {
            let problem = format!("found {found}, expected {expected}");
            self.0.push(Violation { key: key.to_string(), problem });
        }
    }

    pub fn positive(&mut self, key: impl Display, value: f64) {
        self.require(value.is_finite() && value > 0.0, key, value, "a finite number above 0");
    }

    pub fn not_negative(&mut self, key: impl Display, value: f64) {
        self.require(value.is_finite() && value >= 0.0, key, value, "a finite number from 0");
    }

    pub fn finite(&mut self, key: impl Display, value: f64) {
        self.require(value.is_finite(), key, value, "a finite number");
    }

    pub fn finite_numbers(&mut self, key: &str, values: &[f64]) {
        for (index, value) in values.iter().enumerate() {
            self.finite(format_args!("{key}.{index}"), *value);
        }
    }

    /// Letters, digits, `_` and `-`: names become parts of file and service names.
    pub fn name(&mut self, key: impl Display, name: &str) {
        let fits = (1..=64).contains(&name.len())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
        self.require(fits, key, format_args!("{name:?}"), "1 to 64 letters, digits, _ or -");
    }

    pub fn count(&mut self, key: impl Display, count: usize, most: usize, what: &str) {
        self.require((1..=most).contains(&count), key, count, format_args!("1 to {most} {what}"));
    }

    pub fn unique<'n>(&mut self, names: impl Iterator<Item = &'n str>, key: impl Fn(usize) -> String) {
        let mut seen = BTreeSet::new();
        for (index, name) in names.enumerate() {
            self.require(seen.insert(name), key(index), format_args!("{name:?} again"), "each name once");
        }
    }
}
