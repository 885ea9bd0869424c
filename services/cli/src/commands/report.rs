//! `mikoshi report`: the paper's figures from what a run has left.

use crate::arguments::ReportArguments;
use crate::failure::{Failure, as_lines};
use crate::judge::judged_limits;
use crate::observed_run::observed_run;
use crate::output_directory::{REPORT, RUN_LOG, SUMMARY};
use crate::print::{print_error, print_file};
use mikoshi_coordinator::build_hybrid_law;
use mikoshi_observation::{LogReader, Observation, Summary};
use mikoshi_report::{ReportedRun, RunData, WriteReportError, write_report};
use std::fs;
use std::path::Path;

/// Draws the figures and writes the page.
///
/// # Errors
/// A folder without a run that can be read; a report that can't be written.
pub fn report(arguments: &ReportArguments) -> Result<(), Failure> {
    let mut runs = vec![read_run(&arguments.run)?];
    let mut default_out = arguments.run.join(REPORT);
    if let Some(other) = &arguments.other {
        runs.push(read_run(other)?);
        default_out = default_out.join(format!("against-{}", name_of(other)));
        if runs[0].label == runs[1].label {
            // Two folders of one name: by their paths, then.
            (runs[0].label, runs[1].label) =
                (arguments.run.display().to_string(), other.display().to_string());
        }
    }
    let out = arguments.out.as_ref().unwrap_or(&default_out);
    let page = write_report(&runs, out).map_err(|error| match error {
        WriteReportError::Io { .. } => Failure::usage(error),
        WriteReportError::Draw { .. } => Failure::fault(error),
    })?;
    print_file(&page, arguments.json)
}

/// Reads what a run has left in its folder.
fn read_run(folder: &Path) -> Result<ReportedRun, Failure> {
    let summary = read_summary(&folder.join(SUMMARY))?;
    let path = folder.join(RUN_LOG);
    let mut log = LogReader::open(&path).map_err(Failure::usage)?;
    let scenario = &log.run().scenario;
    if (&scenario.name, scenario.seed) != (&summary.scenario, summary.seed) {
        return Err(Failure::usage(format!(
            "{}: {SUMMARY} is of {}, seed {}, but {RUN_LOG} of {}, seed {}",
            folder.display(),
            summary.scenario,
            summary.seed,
            scenario.name,
            scenario.seed
        )));
    }
    let law = build_hybrid_law(log.run()).map_err(|error| Failure::usage(error).context(path.display()))?;
    let observed = observed_run(log.run(), law.internal_forces())?;
    let mut data = RunData::new(log.run(), &observed);
    let mut observation = Observation::for_team(log.run().robots.len());
    while log.read_tick(&mut observation).map_err(Failure::usage)? {
        data.observe(&observation);
    }
    let damage = log.damage().map(ToString::to_string);
    if let Some(damage) = &damage {
        let warning = format!("{}: cut or damaged, drawn up to there: {damage}", path.display());
        print_error(&as_lines("warning", &warning));
    }
    let limits = judged_limits(&log.run().scenario, &summary);
    Ok(ReportedRun { label: name_of(folder), summary, data, limits, damage })
}

fn read_summary(path: &Path) -> Result<Summary, Failure> {
    let text = fs::read_to_string(path).map_err(|error| {
        Failure::usage(error).context(format!("{}: no results of a run that has ended", path.display()))
    })?;
    serde_json::from_str(&text).map_err(|error| {
        Failure::usage(error).context(format!("{}: not a summary of this build", path.display()))
    })
}

/// What a run's folder is called.
fn name_of(folder: &Path) -> String {
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    folder.file_name().map_or_else(|| "run".to_owned(), |name| name.to_string_lossy().into_owned())
}
