//! What is to hold of a sweep by itself. Its scenario judges the values that it puts there.

use super::checks::{Checks, Violation};
use crate::document::Node;
use crate::sweep::{Comparison, GridAxis, Sweep, grid};

/// More runs than this are a slip of the pen.
const MAX_RUNS: u64 = 100_000;
/// Keys that say which run it is: the sweep has words of its own for them.
const RESERVED: [&str; 3] = ["seed", "name", "description"];

/// Everything wrong with a sweep that sets `set`, and along whose axes `followers` change.
pub(crate) fn sweep(sweep: &Sweep, set: &[&str], followers: &[Vec<(String, Vec<Node>)>]) -> Vec<Violation> {
    let mut checks = Checks::default();
    checks.name("name", &sweep.name);
    let runs = sweep.runs;
    checks.require((1..=MAX_RUNS).contains(&runs), "runs", runs, format_args!("1 to {MAX_RUNS} runs"));
    let points = grid::size(&sweep.grid);
    let fits = sweep.grid.is_empty() || points.saturating_mul(runs) <= MAX_RUNS;
    let found = format!("a grid of {points} points with {runs} runs each");
    checks.require(fits, "grid", found, format_args!("at most {MAX_RUNS} runs"));
    let has_seeds = sweep.first_seed.checked_add(runs).is_some();
    checks.require(has_seeds, "first_seed", sweep.first_seed, "a seed with one for every run after it");
    let all = sweep.all_runs();
    let expected = format_args!("no more than all of the {all} runs").to_string();
    checks.require(sweep.succeed_min <= all, "succeed_min", sweep.succeed_min, expected);
    for key in set {
        let expected = "a key that does not tell runs apart: first_seed does";
        checks.require(!RESERVED.contains(key), format_args!("set.{key}"), "a value", expected);
    }
    keys(&mut checks, sweep, set, followers);
    for (index, range) in sweep.ranges.iter().enumerate() {
        let expected = format_args!("at least min ({})", range.min).to_string();
        checks.require(range.max >= range.min, format_args!("ranges.{index}.max"), range.max, expected);
        for (end, value) in [("min", range.min), ("max", range.max)] {
            let fits = !range.whole || value.fract() == 0.0 && value.abs() < 2_f64.powi(53);
            checks.require(fits, format_args!("ranges.{index}.{end}"), value, "a whole number");
        }
    }
    for (index, (axis, followers)) in sweep.grid.iter().zip(followers).enumerate() {
        grid_axis(&mut checks, index, axis, followers);
    }
    if let Some(comparison) = &sweep.comparison {
        comparison_numbers(&mut checks, comparison);
    }
    checks.0
}

/// Every key varies in one place only, and none of them says which run it is.
fn keys(checks: &mut Checks, sweep: &Sweep, set: &[&str], followers: &[Vec<(String, Vec<Node>)>]) {
    let mut varied = Vec::new();
    for (index, (axis, followers)) in sweep.grid.iter().zip(followers).enumerate() {
        varied.push((axis.key.as_str(), format!("grid.{index}.key")));
        for (key, _) in followers {
            varied.push((key.as_str(), format!("grid.{index}.with.{key}")));
        }
    }
    let ranges = sweep.ranges.iter().enumerate();
    varied.extend(ranges.map(|(index, range)| (range.key.as_str(), format!("ranges.{index}.key"))));
    checks.unique(varied.iter().map(|(key, _)| *key), |index| {
        varied.get(index).map_or_else(String::new, |(_, place)| place.clone())
    });
    for (key, place) in &varied {
        let found = format!("{key:?}");
        checks.require(!set.contains(key), place, &found, "a key that is not in [set]");
        checks.require(!RESERVED.contains(key), place, &found, "a key of numbers");
    }
}

fn grid_axis(checks: &mut Checks, index: usize, axis: &GridAxis, followers: &[(String, Vec<Node>)]) {
    let count = axis.values.len();
    checks.require(count > 0, format_args!("grid.{index}.values"), "no value", "at least one");
    for (key, values) in followers {
        let found = format!("{} values", values.len());
        let expected = format!("an array with one for each of the {count} of {:?}", axis.key);
        checks.require(values.len() == count, format_args!("grid.{index}.with.{key}"), found, expected);
    }
}

fn comparison_numbers(checks: &mut Checks, comparison: &Comparison) {
    match comparison {
        Comparison::TimeToEdge { within } => {
            checks.positive("comparison.time-to-edge.within", *within);
        }
        Comparison::FollowerDelay { paper_falls_s } => {
            checks.positive("comparison.follower-delay.paper_falls_s", *paper_falls_s);
        }
    }
}
