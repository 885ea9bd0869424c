//! `mikoshi sweep`: many runs of one scenario, and what they come to together.

use crate::arguments::SweepArguments;
use crate::failure::{Failure, Status};
use crate::interrupts::Interrupts;
use crate::output_directory::OutputDirectory;
use crate::print::print_out;
use crate::sweep::comparison::compare;
use crate::sweep::jobs::Jobs;
use crate::sweep::page;
use crate::sweep::result::SweepResult;
use crate::sweep::run_folder::RunFolder;
use crate::sweep::text;
use mikoshi_config::load_sweep;
use mikoshi_report::write_sweep;
use std::fs;
use std::num::NonZeroUsize;
use std::path::Path;
use std::thread::available_parallelism;

/// Runs a sweep, or what an earlier one has left of it.
///
/// # Errors
/// Bad usage or configuration, an interruption, or a run that could not be carried out. A run that does not
/// meet its thresholds is no error.
pub fn sweep(arguments: &SweepArguments) -> Result<Status, Failure> {
    let interrupts = Interrupts::listen().map_err(Failure::fault)?;
    let loaded = load_sweep(&arguments.sweep).map_err(Failure::usage)?;
    let sweep = &loaded.sweep;
    let default = || Path::new("runs").join(format!("sweep-{}", sweep.name));
    let out = OutputDirectory::open(&arguments.out.clone().unwrap_or_else(default), false)?;
    let runs = loaded.runs(arguments.runs.map_or(sweep.all_runs(), |runs| runs.get().into()));
    let folders = runs
        .iter()
        .map(|run| RunFolder::of(run, &loaded.scenario, out.path(), arguments.keep_logs))
        .collect::<Result<Vec<_>, _>>()?;

    let jobs = arguments.jobs.or_else(|| available_parallelism().ok()).map_or(1, NonZeroUsize::get);
    Jobs::new(jobs, &interrupts)?.perform(&folders, !arguments.quiet)?;

    let rows = runs.iter().zip(&folders).map(|(run, folder)| folder.row(run)).collect::<Result<_, _>>()?;
    let comparison = sweep.comparison.as_ref().map(|comparison| compare(comparison, &folders)).transpose()?;
    let result = SweepResult::of(sweep, rows, comparison);
    let json = serde_json::to_string_pretty(&result).map_err(Failure::fault)? + "\n";
    write(&out.path().join("sweep.json"), json.as_bytes())?;
    if let Some(first) = folders.first() {
        let report = page::report(sweep, &result, first.thresholds());
        write_sweep(&report, out.path()).map_err(Failure::fault)?;
    }
    if arguments.json {
        print_out(&json);
    } else if !arguments.quiet {
        print_out(&text::report(&result, out.path()));
    }
    Ok(if result.passed { Status::Met } else { Status::NotMet })
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    fs::write(path, bytes).map_err(|error| Failure::fault(error).context(path.display()))
}
