//! What the sweeps of a survey came to: `survey.json`, which others script against, the page and the text.

use super::figure::figure;
use super::page;
use super::planned::PlannedSweep;
use super::result::{SweepResult, share};
use super::text;
use crate::table;
use core::fmt::Write as _;
use mikoshi_config::LoadedSurvey;
use mikoshi_report::{SurveyReport, SurveyedSweep, SweepFigure};
use serde::Serialize;
use std::path::Path;

/// A survey's result. Keys stay; more may follow.
#[derive(Clone, Debug, Serialize)]
pub struct SurveyResult {
    pub survey: String,
    pub passed: bool,
    pub succeeded: u64,
    /// Of as many runs as there are: a survey that is cut short needs its share.
    pub succeed_min: u64,
    pub runs: u64,
    /// As each sweep's own `sweep.json` has them.
    pub sweeps: Vec<SweepResult>,
}

/// How many of its runs each sweep has if a survey has `count` in all: every sweep its share, rounded up.
pub fn runs_of_sweeps(loaded: &LoadedSurvey, count: u64) -> impl Iterator<Item = u64> {
    let all = loaded.all_runs();
    loaded.sweeps.iter().map(move |sweep| share(sweep.sweep.all_runs(), count, all))
}

impl SurveyResult {
    /// Of these sweeps.
    pub fn of(loaded: &LoadedSurvey, sweeps: Vec<SweepResult>) -> Self {
        let succeeded = sweeps.iter().map(|sweep| sweep.succeeded).sum();
        let runs = sweeps.iter().map(|sweep| sweep.runs.len() as u64).sum();
        let succeed_min = share(loaded.survey.succeed_min, runs, loaded.all_runs());
        Self {
            survey: loaded.survey.name.clone(),
            passed: succeeded >= succeed_min,
            succeeded,
            succeed_min,
            runs,
            sweeps,
        }
    }

    /// Whether it passed, and why, in one line.
    fn verdict(&self) -> String {
        format!(
            "{}: {} of {} runs of {} sweeps succeeded, expected at least {}",
            if self.passed { "passed" } else { "NOT passed" },
            self.succeeded,
            self.runs,
            self.sweeps.len(),
            self.succeed_min
        )
    }
}

/// Titles of what is told of each sweep.
fn columns() -> Vec<String> {
    let figures = FIGURES.map(|name| format!("worst {name}"));
    ["sweep", "scenario", "succeeded"].map(str::to_owned).into_iter().chain(figures).collect()
}

/// By what sweeps are told apart.
const FIGURES: [&str; 3] = ["position peak mm", "ZMP margin mm", "internal peak N"];

fn cells(sweep: &SweepResult) -> Vec<String> {
    let figures = text::figures(&sweep.worst);
    let figure =
        |name: &str| figures.iter().find(|(of, _)| *of == name).map_or(f64::NAN, |(_, value)| *value);
    let succeeded = format!("{} of {}", sweep.succeeded, sweep.runs.len());
    let worst = FIGURES.map(|name| format!("{:.2}", figure(name)));
    [sweep.sweep.clone(), sweep.scenario.clone(), succeeded].into_iter().chain(worst).collect()
}

/// For people.
pub fn report(result: &SurveyResult, out: &Path) -> String {
    let mut report = table::of_text(&columns(), result.sweeps.iter().map(cells));
    for sweep in &result.sweeps {
        report += &text::failures(sweep);
    }
    // Writing to a string can't fail.
    let _ = writeln!(report, "\nresults in {}\n{}", out.display(), result.verdict());
    report
}

/// As its page has it.
pub fn page(loaded: &LoadedSurvey, result: &SurveyResult, planned: &[PlannedSweep<'_>]) -> SurveyReport {
    let sweeps = result.sweeps.iter().zip(planned).filter_map(|(sweep, planned)| {
        let title = format!("{}: {} of {}", sweep.sweep, sweep.succeeded, sweep.runs.len());
        Some(SurveyedSweep {
            name: sweep.sweep.clone(),
            cells: cells(sweep),
            overview: SweepFigure { title, ..figure(sweep, planned.thresholds()?) },
            failures: page::failures(sweep),
        })
    });
    SurveyReport {
        name: loaded.survey.name.clone(),
        description: loaded.survey.description.clone(),
        passed: result.passed,
        verdict: result.verdict(),
        columns: columns(),
        sweeps: sweeps.collect(),
    }
}
