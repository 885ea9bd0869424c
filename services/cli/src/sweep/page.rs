//! A sweep's result as its page has it.

use super::figure::figure;
use super::result::{Row, SweepResult};
use super::text::{figures, parameters, verdict};
use mikoshi_config::Sweep;
use mikoshi_config::scenario::Thresholds;
use mikoshi_report::{SweepFailure, SweepReport};

/// Everything that the page tells; `limits` are those of its runs.
pub fn report(sweep: &Sweep, result: &SweepResult, limits: &Thresholds) -> SweepReport {
    let medians_and_worst = figures(&result.median).into_iter().zip(figures(&result.worst));
    SweepReport {
        name: sweep.name.clone(),
        description: sweep.description.clone(),
        passed: result.passed,
        verdict: verdict(result),
        figures: medians_and_worst
            .map(|((name, median), (_, worst))| {
                [name.to_owned(), format!("{median:.2}"), format!("{worst:.2}")]
            })
            .collect(),
        failures: failures(result),
        overview: figure(result, limits),
        comparison: result.comparison.clone(),
    }
}

/// Runs that did not succeed.
pub fn failures(result: &SweepResult) -> Vec<SweepFailure> {
    let failure = |row: &Row| SweepFailure {
        run: format!("Run {}, seed {}: {}", row.run, row.seed, parameters(result, row)),
        causes: row.failures.clone(),
    };
    result.runs.iter().filter(|row| !row.passed).map(failure).collect()
}
