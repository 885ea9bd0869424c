//! `mikoshi sweep`: many runs of one scenario, or of several, and what they come to together.

use crate::arguments::SweepArguments;
use crate::failure::{Failure, Status};
use crate::interrupts::Interrupts;
use crate::output_directory::OutputDirectory;
use crate::print::print_out;
use crate::sweep::jobs::Jobs;
use crate::sweep::planned::{PlannedSweep, json, write};
use crate::sweep::survey::{self, SurveyResult};
use crate::sweep::text;
use mikoshi_config::{LoadedSurvey, LoadedSweep, SweepFile, load_sweep_file};
use mikoshi_report::write_survey;
use std::num::NonZeroUsize;
use std::path::Path;
use std::thread::available_parallelism;

/// Runs a sweep, or several together, or what an earlier command has left of them.
///
/// # Errors
/// Bad usage or configuration, an interruption, or a run that could not be carried out. A run that does not
/// meet its thresholds is no error.
pub fn sweep(arguments: &SweepArguments) -> Result<Status, Failure> {
    let interrupts = Interrupts::listen().map_err(Failure::fault)?;
    let passed = match load_sweep_file(&arguments.sweep).map_err(Failure::usage)? {
        SweepFile::Sweep(loaded) => one(arguments, &loaded, &interrupts)?,
        SweepFile::Survey(loaded) => many(arguments, &loaded, &interrupts)?,
    };
    Ok(if passed { Status::Met } else { Status::NotMet })
}

fn one(arguments: &SweepArguments, loaded: &LoadedSweep, interrupts: &Interrupts) -> Result<bool, Failure> {
    let out = out(arguments, &loaded.sweep.name)?;
    let count = count(arguments, loaded.sweep.all_runs());
    let planned = [PlannedSweep::of(loaded, count, out.path(), arguments.keep_logs)?];
    perform(arguments, &planned, interrupts)?;
    let [planned] = planned;
    let result = planned.conclude()?;
    tell(arguments, || json(&result), || text::report(&result, out.path()))?;
    Ok(result.passed)
}

fn many(arguments: &SweepArguments, loaded: &LoadedSurvey, interrupts: &Interrupts) -> Result<bool, Failure> {
    let out = out(arguments, &loaded.survey.name)?;
    let counts = survey::runs_of_sweeps(loaded, count(arguments, loaded.all_runs()));
    let sweeps = loaded.sweeps.iter().zip(&loaded.survey.sweeps).zip(counts);
    let planned = sweeps
        .map(|((sweep, name), count)| {
            PlannedSweep::of(sweep, count, &out.path().join(name), arguments.keep_logs)
        })
        .collect::<Result<Vec<_>, _>>()?;
    perform(arguments, &planned, interrupts)?;
    let sweeps = planned.iter().map(PlannedSweep::conclude).collect::<Result<_, _>>()?;
    let result = SurveyResult::of(loaded, sweeps);
    write(&out.path().join("survey.json"), &json(&result)?)?;
    write_survey(&survey::page(loaded, &result, &planned), out.path()).map_err(Failure::fault)?;
    tell(arguments, || json(&result), || survey::report(&result, out.path()))?;
    Ok(result.passed)
}

fn out(arguments: &SweepArguments, name: &str) -> Result<OutputDirectory, Failure> {
    let default = || Path::new("runs").join(format!("sweep-{name}"));
    Ok(OutputDirectory::open(&arguments.out.clone().unwrap_or_else(default), false)?)
}

fn count(arguments: &SweepArguments, all: u64) -> u64 {
    arguments.runs.map_or(all, |runs| runs.get().into())
}

fn perform(
    arguments: &SweepArguments,
    planned: &[PlannedSweep<'_>],
    interrupts: &Interrupts,
) -> Result<(), Failure> {
    let folders: Vec<_> = planned.iter().flat_map(PlannedSweep::folders).collect();
    let jobs = arguments.jobs.or_else(|| available_parallelism().ok()).map_or(1, NonZeroUsize::get);
    Jobs::new(jobs, interrupts)?.perform(&folders, !arguments.quiet)
}

fn tell(
    arguments: &SweepArguments,
    json: impl FnOnce() -> Result<String, Failure>,
    text: impl FnOnce() -> String,
) -> Result<(), Failure> {
    if arguments.json {
        print_out(&json()?);
    } else if !arguments.quiet {
        print_out(&text());
    }
    Ok(())
}
