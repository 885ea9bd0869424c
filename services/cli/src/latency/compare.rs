//! Two measurements beside each other.

use super::result::LatencyResult;
use crate::failure::Failure;
use crate::table;
use std::fs;
use std::path::Path;

/// The second as a multiple of the first, span by span.
///
/// # Errors
/// A file can't be read, or is no measurement: bad usage.
pub fn compare(first: &Path, second: &Path) -> Result<String, Failure> {
    let (one, other) = (read(first)?, read(second)?);
    let rows = one.spans.iter().filter_map(|span| {
        let found = other.spans.iter().find(|found| found.span == span.span)?;
        let pairs = [(span.p50_ns, found.p50_ns), (span.p99_ns, found.p99_ns), (span.p999_ns, found.p999_ns)];
        let ratio = |(one, other): (u64, u64)| format!("{:.2}", other as f64 / one.max(1) as f64);
        let us = |ns: u64| format!("{:.1}", ns as f64 * 1e-3);
        let medians = [us(span.p50_ns), us(found.p50_ns)];
        Some([vec![span.span.to_string()], medians.to_vec(), pairs.map(ratio).to_vec()].concat())
    });
    let titles = ["second / first", "p50, us", "p50, us", "p50 ratio", "p99 ratio", "p99.9 ratio"];
    Ok(table::of_numbers(&titles, rows))
}

fn read(path: &Path) -> Result<LatencyResult, Failure> {
    let bytes = fs::read(path).map_err(|error| Failure::usage(error).context(path.display()))?;
    serde_json::from_slice(&bytes).map_err(|error| {
        Failure::usage(format!("not a measurement of `mikoshi latency`: {error}")).context(path.display())
    })
}
