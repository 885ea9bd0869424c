//! What is to hold of a survey by itself. Its sweeps are judged as they are loaded.

use super::checks::{Checks, Violation};
use crate::survey::Survey;

/// Everything wrong with a survey whose sweeps have so many runs.
pub(crate) fn survey(survey: &Survey, all_runs: u64) -> Vec<Violation> {
    let mut checks = Checks::default();
    checks.name("name", &survey.name);
    checks.require(!survey.sweeps.is_empty(), "sweeps", "none", "at least one sweep");
    checks.unique(survey.sweeps.iter().map(String::as_str), |index| format!("sweeps.{index}"));
    let expected = format!("no more than all of the {all_runs} runs");
    checks.require(survey.succeed_min <= all_runs, "succeed_min", survey.succeed_min, expected);
    checks.0
}
