//! What a sweep came to, for people.

use super::result::{Figures, Row, SweepResult};
use crate::table;
use core::fmt::Write as _;
use std::path::Path;

/// The whole report.
pub fn report(result: &SweepResult, out: &Path) -> String {
    let mut text = table::of_numbers(
        &["figure", "median", "worst"],
        figures(&result.median).into_iter().zip(figures(&result.worst)).map(
            |((name, median), (_, worst))| {
                vec![name.to_owned(), format!("{median:.2}"), format!("{worst:.2}")]
            },
        ),
    );
    text += &failures(result);
    if !result.findings.is_empty() {
        text += "\nBeside the paper\n";
    }
    for finding in &result.findings {
        // Writing to a string can't fail.
        let _ = writeln!(text, "  {finding}");
    }
    let _ = writeln!(text, "\nresults in {}", out.display());
    let _ = writeln!(text, "{}", verdict(result));
    text
}

/// Whether it passed, and why, in one line.
pub fn verdict(result: &SweepResult) -> String {
    let compared = match &result.comparison {
        Some(comparison) if !comparison.is_met() => "; they do not agree with the paper as they are to",
        _ => "",
    };
    format!(
        "{}: {} of {} runs of {} succeeded, expected at least {}{compared}",
        if result.passed { "passed" } else { "NOT passed" },
        result.succeeded,
        result.runs.len(),
        result.scenario,
        result.succeed_min
    )
}

/// What is told of all figures.
pub fn figures(figures: &Figures) -> [(&'static str, f64); 8] {
    [
        ("position peak mm", 1e3 * figures.position_peak_m),
        ("position RMS mm", 1e3 * figures.position_rms_m),
        ("attitude RMS mrad", 1e3 * figures.attitude_rms_rad),
        ("ZMP margin mm", 1e3 * figures.zmp_margin_min_m),
        ("slip mm", 1e3 * figures.foot_slip_max_m),
        ("internal peak N", figures.internal_peak_n),
        ("internal end N", figures.internal_end_n),
        ("internal end Nm", figures.internal_end_nm),
    ]
}

/// Runs that did not succeed, below a line that says so; nothing if all did.
pub fn failures(result: &SweepResult) -> String {
    let mut failed = result.runs.iter().filter(|row| !row.passed).peekable();
    let mut text = match failed.peek() {
        Some(_) => format!("\nRuns of {} that failed\n", result.sweep),
        None => String::new(),
    };
    failed.for_each(|row| text += &failure(result, row));
    text
}

/// A run's causes, and what was drawn for it.
fn failure(result: &SweepResult, row: &Row) -> String {
    let mut text = format!("  run {}, seed {}\n", row.run, row.seed);
    for cause in &row.failures {
        let _ = writeln!(text, "    {cause}");
    }
    let parameters = parameters(result, row);
    if !parameters.is_empty() {
        let _ = writeln!(text, "    with {parameters}");
    }
    text
}

/// What tells a run from others: `mass_kg 5.43, friction 0.7`.
pub fn parameters(result: &SweepResult, row: &Row) -> String {
    let drawn = result.parameters.iter().filter_map(|key| {
        let name = short_name(key);
        row.parameters.get(key).map(|value| format!("{name} {}", three_digits(*value)))
    });
    let drawn: Vec<_> = drawn.collect();
    drawn.join(", ")
}

/// The last part of a key tells enough; of an array's element, with the array's name.
fn short_name(key: &str) -> &str {
    let is_index = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    let array = key.rsplit_once('.').filter(|(_, last)| is_index(last)).map_or(key, |(array, _)| array);
    let start = array.rfind('.').map_or(0, |dot| dot + 1);
    key.get(start..).unwrap_or(key)
}

/// Three digits tell enough.
fn three_digits(value: f64) -> String {
    let digits = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    let text = format!("{value:.*}", (2.0 - digits).clamp(0.0, 12.0) as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_told_by_their_last_part_and_elements_by_their_arrays() {
        let names = ["object.mass_kg", "seed", "motion.segments.0.velocity_m_s.1"].map(short_name);
        assert_eq!(names, ["mass_kg", "seed", "velocity_m_s.1"]);
    }

    #[test]
    fn numbers_are_told_by_three_digits() {
        let texts = [0.0, 3.0, 5.4321, 0.000_062_34, 123_456.0, -0.5].map(three_digits);
        assert_eq!(texts, ["0", "3", "5.43", "0.0000623", "123456", "-0.5"]);
    }
}
