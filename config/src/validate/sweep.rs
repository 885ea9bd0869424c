//! What is to hold of a sweep by itself. Its scenario judges the values that it puts there.

use super::checks::{Checks, Violation};
use crate::sweep::Sweep;

/// More runs than this are a slip of the pen.
const MAX_RUNS: u64 = 100_000;
/// Keys that say which run it is: the sweep has words of its own for them.
const RESERVED: [&str; 3] = ["seed", "name", "description"];

/// Everything wrong with a sweep that sets `set`.
pub(crate) fn sweep(sweep: &Sweep, set: &[&str]) -> Vec<Violation> {
    let mut checks = Checks::default();
    checks.name("name", &sweep.name);
    let runs = sweep.runs;
    checks.require((1..=MAX_RUNS).contains(&runs), "runs", runs, format_args!("1 to {MAX_RUNS} runs"));
    let has_seeds = sweep.first_seed.checked_add(runs).is_some();
    checks.require(has_seeds, "first_seed", sweep.first_seed, "a seed with one for every run after it");
    let expected = format_args!("no more than all of the {runs} runs").to_string();
    checks.require(sweep.succeed_min <= runs, "succeed_min", sweep.succeed_min, expected);
    for key in set {
        let expected = "a key that does not tell runs apart: first_seed does";
        checks.require(!RESERVED.contains(key), format_args!("set.{key}"), "a value", expected);
    }
    checks.unique(sweep.ranges.iter().map(|range| range.key.as_str()), |index| format!("ranges.{index}.key"));
    for (index, range) in sweep.ranges.iter().enumerate() {
        let key = format!("ranges.{index}.key");
        let found = format!("{:?}", range.key);
        checks.require(!set.contains(&range.key.as_str()), &key, &found, "a key that is not in [set]");
        checks.require(!RESERVED.contains(&range.key.as_str()), &key, &found, "a key of numbers");
        let expected = format_args!("at least min ({})", range.min).to_string();
        checks.require(range.max >= range.min, format_args!("ranges.{index}.max"), range.max, expected);
        for (end, value) in [("min", range.min), ("max", range.max)] {
            let fits = !range.whole || value.fract() == 0.0 && value.abs() < 2_f64.powi(53);
            checks.require(fits, format_args!("ranges.{index}.{end}"), value, "a whole number");
        }
    }
    checks.0
}
