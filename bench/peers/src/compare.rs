//! All carriers in one run: in every round each has a team of its own, one after the other, so that a machine that
//! stalls or slows down does so for all of them.

use crate::carrier::Carrier;
use crate::driver::{DriverError, Wait};
use crate::team::{self, Outcome, Task};
use clap::{Args, ValueEnum};
use comfy_table::{CellAlignment, ContentArrangement, LineStyle, Table, TableStyle};
use core::fmt::Write;
use serde::Serialize;
use std::path::PathBuf;

/// A line below the titles, and nothing else.
const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// How much is measured.
#[derive(Debug, Args)]
pub struct Measurement {
    /// Rounds: in each of them every carrier runs once under every wait
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u64).range(1..))]
    rounds: u64,
    /// Ticks of a round
    #[arg(long, default_value_t = 3000, value_parser = clap::value_parser!(u64).range(10..))]
    ticks: u64,
    /// Ticks before them, in which memory is touched for the first time
    #[arg(long, default_value_t = 500)]
    warm_up: u64,
    /// What is compared; all that was compiled in by default
    #[arg(long, value_delimiter = ',')]
    carriers: Vec<Carrier>,
    /// How they wait; both by default
    #[arg(long, value_delimiter = ',')]
    waits: Vec<Wait>,
    /// Where the result is written as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// One carrier under one wait.
#[derive(Debug, Serialize)]
struct Row {
    carrier: Carrier,
    wait: Wait,
    ticks: usize,
    p50_ns: u64,
    p99_ns: u64,
    p999_ns: u64,
    /// Its median tick in each round.
    rounds_p50_ns: Vec<u64>,
    /// The quotient of its median tick and that of raw shared memory under the same wait, in the same round.
    ratio_to_raw: Option<Spread>,
}

/// Of one number for each round.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Spread {
    median: f64,
    lower_quartile: f64,
    upper_quartile: f64,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let at = |share| Some(*values.get(index_at(values.len(), share))?);
        Some(Self { median: at(0.5)?, lower_quartile: at(0.25)?, upper_quartile: at(0.75)? })
    }
}

/// Where in so many sorted values this share of them is below.
fn index_at(count: usize, share: f64) -> usize {
    ((count as f64 * share) as usize).min(count.saturating_sub(1))
}

/// How long ticks took, sorted.
fn durations_ns(outcome: &Outcome, warm_up: u64) -> Vec<u64> {
    let times = outcome.times_ns.get(warm_up as usize..).unwrap_or_default();
    let mut durations: Vec<u64> = times.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    durations.sort_unstable();
    durations
}

fn percentile(sorted: &[u64], share: f64) -> u64 {
    sorted.get(index_at(sorted.len(), share)).copied().unwrap_or_default()
}

/// Measures, and tells.
///
/// # Errors
/// A team fails, or the result can't be written.
pub fn compare(measurement: &Measurement) -> Result<(), DriverError> {
    let carriers = match &measurement.carriers[..] {
        [] => Carrier::value_variants(),
        some => some,
    };
    let waits = match &measurement.waits[..] {
        [] => &Wait::ALL[..],
        some => some,
    };
    let runs: Vec<(Wait, Carrier)> =
        waits.iter().flat_map(|wait| carriers.iter().map(move |carrier| (*wait, *carrier))).collect();
    let mut durations: Vec<Vec<Vec<u64>>> = vec![vec![]; runs.len()];
    for round in 1..=measurement.rounds {
        eprint!("\rround {round} of {}", measurement.rounds);
        for ((wait, carrier), durations) in runs.iter().zip(&mut durations) {
            let ticks = measurement.warm_up + measurement.ticks + 1;
            let task = Task { carrier: *carrier, wait: *wait, ticks, is_checked: false, fault: None };
            let outcome = team::run(task);
            let outcome = outcome.map_err(|error| DriverError(format!("{carrier}, {wait}: {error}")))?;
            durations.push(durations_ns(&outcome, measurement.warm_up));
        }
    }
    eprintln!();
    let rows = rows(&runs, &durations);
    println!("{}", to_text(&rows));
    if let Some(file) = &measurement.json {
        let text = serde_json::to_string_pretty(&rows).map_err(DriverError::of)?;
        std::fs::write(file, text + "\n").map_err(DriverError::of)?;
    }
    Ok(())
}

fn rows(runs: &[(Wait, Carrier)], durations: &[Vec<Vec<u64>>]) -> Vec<Row> {
    let medians: Vec<Vec<u64>> =
        durations.iter().map(|rounds| rounds.iter().map(|round| percentile(round, 0.5)).collect()).collect();
    let raw_of =
        |wait: Wait| runs.iter().position(|run| *run == (wait, Carrier::Raw)).map(|index| &medians[index]);
    let row = |index: usize| {
        let ((wait, carrier), medians) = (runs[index], &medians[index]);
        let mut all: Vec<u64> = durations[index].iter().flatten().copied().collect();
        all.sort_unstable();
        let quotients =
            |raw: &Vec<u64>| medians.iter().zip(raw).map(|(own, raw)| *own as f64 / *raw as f64).collect();
        Row {
            carrier,
            wait,
            ticks: all.len(),
            p50_ns: percentile(&all, 0.5),
            p99_ns: percentile(&all, 0.99),
            p999_ns: percentile(&all, 0.999),
            rounds_p50_ns: medians.clone(),
            ratio_to_raw: raw_of(wait).map(quotients).and_then(Spread::of),
        }
    };
    (0..runs.len()).map(row).collect()
}

fn to_text(rows: &[Row]) -> String {
    let mut table = Table::new();
    table.load_style(STYLE).set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(["wait", "carrier", "p50 µs", "p99 µs", "p99.9 µs", "× raw", "quartiles"]);
    let us = |ns: u64| format!("{:.1}", ns as f64 / 1e3);
    for row in rows {
        let (ratio, quartiles) = row.ratio_to_raw.map_or_else(Default::default, |ratio| {
            (
                format!("{:.2}", ratio.median),
                format!("{:.2} to {:.2}", ratio.lower_quartile, ratio.upper_quartile),
            )
        });
        let (wait, carrier) = (row.wait.to_string(), row.carrier.to_string());
        table.add_row([wait, carrier, us(row.p50_ns), us(row.p99_ns), us(row.p999_ns), ratio, quartiles]);
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let mut text: String = table.lines().map(|line| format!("{}\n", line.trim_end())).collect();
    for wait in Wait::ALL {
        // To a string nothing fails.
        let _ = writeln!(text, "\n{wait}: {}", claim(rows.iter().filter(|row| row.wait == wait)));
    }
    text
}

/// What can be said of Mikoshi, within one wait.
fn claim<'a>(rows: impl Iterator<Item = &'a Row> + Clone) -> String {
    let mikoshi = rows.clone().find(|row| row.carrier == Carrier::Mikoshi);
    let Some((mikoshi, ratio)) = mikoshi.and_then(|row| Some((row, row.ratio_to_raw?))) else {
        return "nothing to be said without raw shared memory and Mikoshi".to_owned();
    };
    let peers = rows.filter(|row| row.carrier.is_peer());
    let peers: Vec<_> = peers
        .map(|row| {
            let quotients = row.rounds_p50_ns.iter().zip(&mikoshi.rounds_p50_ns);
            let quotient = Spread::of(quotients.map(|(peer, own)| *peer as f64 / *own as f64).collect());
            format!("{:.2} × {}", quotient.map_or(f64::NAN, |quotient| quotient.median), row.carrier)
        })
        .collect();
    format!("Mikoshi takes {:.2} × raw; in its time there is room for: {}", ratio.median, peers.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_taken_round_by_round_under_the_same_wait() {
        let runs = [
            (Wait::Blocking, Carrier::Raw),
            (Wait::Blocking, Carrier::Mikoshi),
            (Wait::Yielding, Carrier::Raw),
        ];
        // The machine was twice as slow in the second round.
        let durations =
            [vec![vec![10], vec![20], vec![10]], vec![vec![15], vec![30], vec![12]], vec![vec![1]; 3]];
        let rows = rows(&runs, &durations);
        let ratio = |row: usize| rows[row].ratio_to_raw.map(|ratio| ratio.median);
        assert_eq!([ratio(0), ratio(1), ratio(2)], [Some(1.0), Some(1.5), Some(1.0)]);
        assert_eq!(rows[1].rounds_p50_ns, [15, 30, 12]);
        assert_eq!(rows[1].ratio_to_raw.map(|ratio| ratio.lower_quartile), Some(1.2));
    }

    #[test]
    fn ticks_of_the_warm_up_do_not_count() {
        let outcome = Outcome { times_ns: vec![0, 1000, 1010, 1040, 1050], numbers: vec![] };
        assert_eq!(durations_ns(&outcome, 1), [10, 10, 30]);
        assert_eq!(percentile(&[10, 10, 30], 0.5), 10);
        assert_eq!(percentile(&[10, 10, 30], 0.999), 30);
        assert_eq!(percentile(&[], 0.5), 0);
    }
}
