//! `mikoshi run`: a scenario from its file to its summary.

use crate::arguments::{ResultsArguments, RunArguments};
use crate::burden::{RobotBurden, burdens};
use crate::failure::{Failure, Status, as_lines};
use crate::gain::GainReport;
use crate::observer::RunObserver;
use crate::outcome::Outcome;
use crate::output_directory::OutputDirectory;
use crate::prepare::{Prepared, prepare_paced};
use crate::print::{print_error, print_json, print_out};
use crate::report::report;
use mikoshi_config::save_scenario;
use mikoshi_observation::Summary;
use std::fs;

/// Runs a scenario; `execute` carries it out.
///
/// # Errors
/// Bad usage or configuration, or a fault of the system. A run that does not meet its thresholds is no
/// error: [`Status::NotMet`].
pub fn run(
    arguments: &RunArguments,
    execute: impl FnOnce(&Prepared, &OutputDirectory, &mut RunObserver) -> Result<Outcome, Failure>,
) -> Result<Status, Failure> {
    let mut prepared = prepare_paced(&arguments.scenario, arguments.real_time)?;
    let bridge = arguments.bridge.as_ref();
    let bridge =
        bridge.map(|path| path.canonicalize().map_err(|error| Failure::usage(error).context(path.display())));
    prepared.bridge = bridge.transpose()?;
    let scenario = &prepared.run.scenario;
    if let Some(warning) = scenario.is_controlled().then(|| GainReport::of(&prepared).warning()).flatten() {
        print_error(&as_lines("warning", &warning));
    }
    for warning in burdens(&prepared.run)?.iter().filter_map(RobotBurden::warning) {
        print_error(&as_lines("warning", &warning));
    }
    carry_out(&prepared, &arguments.results, arguments.json, arguments.viewer, execute)
}

/// Has a run carried out by `execute`, judges it, and leaves its results; with a viewer, to be looked at until somebody
/// interrupts.
pub(super) fn carry_out(
    prepared: &Prepared,
    arguments: &ResultsArguments,
    wants_json: bool,
    has_viewer: bool,
    execute: impl FnOnce(&Prepared, &OutputDirectory, &mut RunObserver) -> Result<Outcome, Failure>,
) -> Result<Status, Failure> {
    let scenario = &prepared.run.scenario;
    let out = OutputDirectory::of(arguments, &scenario.name, scenario.seed)?;
    save_scenario(&prepared.run, &out.scenario()).map_err(Failure::fault)?;

    let mut observer = RunObserver::new(prepared, arguments, &out)?;
    if has_viewer {
        observer.expect_viewer();
    }
    let outcome = match execute(prepared, &out, &mut observer) {
        Ok(outcome) => outcome,
        Err(failure) => {
            // There are no results: the folder is as good as new.
            out.discard();
            return Err(failure);
        }
    };
    let faults = match &outcome {
        Outcome::Fault { faults, .. } => faults.clone(),
        _ => vec![],
    };
    let viewer = observer.viewer();
    let summary = observer.finish(&prepared.run, faults);
    write_summary(&out, &summary)?;
    match outcome {
        Outcome::Completed => {
            if wants_json {
                print_json(&summary)?;
            } else if !arguments.quiet {
                print_out(&report(scenario, &summary, out.path()));
            }
            if let Some(viewer) = viewer {
                viewer.stay()?;
            }
            Ok(if summary.passed { Status::Met } else { Status::NotMet })
        }
        Outcome::Interrupted(signal) => {
            let message = format!("stopped after {} of {} ticks", summary.ticks, prepared.run.ticks);
            Err(Failure { status: Status::Signal(signal), message })
        }
        Outcome::Fault { failure, .. } => Err(failure),
    }
}

fn write_summary(out: &OutputDirectory, summary: &Summary) -> Result<(), Failure> {
    let mut text = serde_json::to_string_pretty(summary).map_err(Failure::fault)?;
    text.push('\n');
    let path = out.summary();
    fs::write(&path, text).map_err(|error| Failure::fault(error).context(path.display()))
}
