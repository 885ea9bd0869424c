//! Two measurements beside each other.

use super::result::LatencyResult;
use crate::failure::Failure;
use crate::table;
use mikoshi_observation::Span;
use serde::Serialize;
use std::fs;
use std::path::Path;

/// One span of both; ratios are the second's to the first's.
#[derive(Debug, Serialize)]
pub struct Compared {
    span: Span,
    first_p50_ns: u64,
    second_p50_ns: u64,
    p50_ratio: f64,
    p99_ratio: f64,
    p999_ratio: f64,
}

/// The second as a multiple of the first, span by span.
///
/// # Errors
/// A file can't be read, or is no measurement: bad usage.
pub fn compare(first: &Path, second: &Path) -> Result<Vec<Compared>, Failure> {
    let (one, other) = (read(first)?, read(second)?);
    let rows = one.spans.iter().filter_map(|span| {
        let found = other.spans.iter().find(|found| found.span == span.span)?;
        let ratio = |one: u64, other: u64| other as f64 / one.max(1) as f64;
        Some(Compared {
            span: span.span,
            first_p50_ns: span.p50_ns,
            second_p50_ns: found.p50_ns,
            p50_ratio: ratio(span.p50_ns, found.p50_ns),
            p99_ratio: ratio(span.p99_ns, found.p99_ns),
            p999_ratio: ratio(span.p999_ns, found.p999_ns),
        })
    });
    Ok(rows.collect())
}

/// For people.
pub fn to_text(rows: &[Compared]) -> String {
    let titles = ["second / first", "p50, us", "p50, us", "p50 ratio", "p99 ratio", "p99.9 ratio"];
    let us = |ns: u64| format!("{:.1}", ns as f64 * 1e-3);
    let cells = |row: &Compared| {
        let ratios = [row.p50_ratio, row.p99_ratio, row.p999_ratio].map(|ratio| format!("{ratio:.2}"));
        let medians = [us(row.first_p50_ns), us(row.second_p50_ns)];
        [vec![row.span.to_string()], medians.to_vec(), ratios.to_vec()].concat()
    };
    table::of_numbers(&titles, rows.iter().map(cells))
}

fn read(path: &Path) -> Result<LatencyResult, Failure> {
    let bytes = fs::read(path).map_err(|error| Failure::usage(error).context(path.display()))?;
    serde_json::from_slice(&bytes).map_err(|error| {
        Failure::usage(format!("not a measurement of `mikoshi latency`: {error}")).context(path.display())
    })
}
