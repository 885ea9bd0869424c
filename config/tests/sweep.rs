//! Sweeps: what each run draws, and what is refused before any runs.

mod common;

use mikoshi_config::sweep::Comparison;
use mikoshi_config::{LoadedSweep, load_scenario, load_sweep};
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

const GOOD: &str = r#"name = "lifts"
description = "Lifts of many masses"
scenario = "lift"
runs = 10
first_seed = 3
succeed_min = 9
[set]
hybrid.kz = 0.1
hybrid.start_s = ""
physics = { friction = 0.5 }
[[ranges]]
key = "object.mass_kg"
min = 1
max = 6
[[ranges]]
key = "sensors.delay_ticks"
min = 0
max = 4
whole = true
"#;

/// The fixture with a sweep of this text.
fn fixture(text: &str) -> (TempDir, PathBuf) {
    let copy = common::fixture();
    fs::create_dir(copy.path().join("sweeps")).unwrap();
    let path = copy.path().join("sweeps/lifts.toml");
    fs::write(&path, text).unwrap();
    (copy, path)
}

fn load(text: &str) -> LoadedSweep {
    let (_copy, path) = fixture(text);
    load_sweep(&path).unwrap_or_else(|error| panic!("{error}"))
}

/// The text for the good sweep with `good` replaced by `bad`.
#[track_caller]
fn gives(good: &str, bad: &str, expected: &str) {
    assert_eq!(GOOD.matches(good).count(), 1, "{good:?} is to be found once");
    let (copy, path) = fixture(&GOOD.replace(good, bad));
    let Err(error) = load_sweep(&path) else { panic!("the input is bad") };
    let error = error.to_string();
    assert_eq!(error.replace(&format!("{}/", copy.path().display()), ""), expected);
}

#[test]
fn runs_lie_within_their_ranges_whose_whole_numbers_all_occur() {
    let runs = load(GOOD).runs(200);
    let masses: Vec<f64> = runs.iter().map(|run| run.parameters[0].1).collect();
    assert!(masses.iter().all(|mass| (1.0..=6.0).contains(mass)));
    let mean = masses.iter().sum::<f64>() / 200.0;
    assert!((mean - 3.5).abs() < 0.3, "{mean}");
    for ticks in 0..=4 {
        let count = runs.iter().filter(|run| run.parameters[1].1 == f64::from(ticks)).count();
        assert!((20..=60).contains(&count), "{ticks}: {count}");
    }
}

#[test]
fn a_run_draws_by_its_seed_and_key_whatever_else_is_drawn() {
    let all = load(GOOD).runs(10);
    assert_eq!(all.iter().map(|run| run.seed).collect::<Vec<_>>(), (3..13).collect::<Vec<u64>>());
    let without_mass = GOOD.replace("[[ranges]]\nkey = \"object.mass_kg\"\nmin = 1\nmax = 6\n", "");
    let later = load(&without_mass.replace("first_seed = 3", "first_seed = 8")).runs(2);
    assert_eq!(later[0].parameters[0], all[5].parameters[1]);
    assert_ne!(all[0].parameters, all[1].parameters);
}

#[test]
fn overrides_make_the_scenario_that_the_sweep_describes() {
    let (_copy, path) = fixture(GOOD);
    let loaded = load_sweep(&path).unwrap();
    let run = &loaded.runs(1)[0];
    let scenario = load_scenario(&loaded.scenario, &run.overrides, Some(run.seed)).unwrap().scenario;
    assert_eq!((scenario.seed, scenario.hybrid.kz, scenario.physics.friction), (3, 0.1, 0.5));
    assert_eq!(scenario.hybrid.start_s, None, "an empty string takes a key away");
    assert_eq!(scenario.object.mass_kg, run.parameters[0].1, "to the last bit");
    assert_eq!(scenario.sensors.delay_ticks as f64, run.parameters[1].1);
}

#[test]
fn unknown_keys_of_a_sweep_are_refused() {
    gives("runs = 10", "rums = 10", "sweeps/lifts.toml:4: rums: unknown key; did you mean \"runs\"?");
    gives("max = 6", "mix = 6", "sweeps/lifts.toml:14: ranges.0.mix: unknown key; did you mean \"min\"?");
    gives("runs = 10", "runs = -1", "sweeps/lifts.toml:4: runs: found -1, expected a whole number from 0");
}

#[test]
fn what_the_scenario_does_not_know_is_refused_where_the_sweep_says_it() {
    gives(
        "object.mass_kg",
        "object.mas_kg",
        "sweeps/lifts.toml:12: object.mas_kg: unknown key; did you mean \"mass_kg\"?",
    );
    gives(
        "kz = 0.1",
        "kz = 2",
        "sweeps/lifts.toml:8: hybrid.kz: found 2, expected a number above 0, up to 1",
    );
    gives(
        "\"lift\"",
        "\"left\"",
        "sweeps/lifts.toml:3: scenario: found \"left\", expected one of lift in scenarios; did you mean \"lift\"?",
    );
}

#[test]
fn a_range_with_an_end_that_can_not_be_run_is_refused() {
    gives(
        "min = 1",
        "min = 0",
        "sweeps/lifts.toml:13: object.mass_kg: found 0, expected a finite number above 0",
    );
    gives(
        "max = 4",
        "max = 1001",
        "sweeps/lifts.toml:18: sensors.delay_ticks: found 1001, expected at most 1000 ticks",
    );
    gives(
        "max = 4\nwhole = true",
        "max = 4",
        "sweeps/lifts.toml:16: sensors.delay_ticks: found 2.5844566117449546, expected a whole number from 0",
    );
}

#[test]
fn ranges_that_make_no_sense_are_refused() {
    gives("max = 6", "max = 0.5", "sweeps/lifts.toml:14: ranges.0.max: found 0.5, expected at least min (1)");
    gives("max = 4", "max = 4.5", "sweeps/lifts.toml:18: ranges.1.max: found 4.5, expected a whole number");
    gives(
        "object.mass_kg",
        "sensors.delay_ticks",
        "sweeps/lifts.toml:16: ranges.1.key: found \"sensors.delay_ticks\" again, expected each name once",
    );
    gives(
        "object.mass_kg",
        "hybrid.kz",
        "sweeps/lifts.toml:12: ranges.0.key: found \"hybrid.kz\", expected a key that is not in [set]",
    );
    gives(
        "kz = 0.1",
        "kz = 0.1\nseed = 4",
        "sweeps/lifts.toml:9: set.seed: found a value, expected a key that does not tell runs apart: first_seed does",
    );
    gives(
        "= 9",
        "= 11",
        "sweeps/lifts.toml:6: succeed_min: found 11, expected no more than all of the 10 runs",
    );
}

const GRID: &str = r#"name = "lifts"
description = "Lifts of two masses over three gains"
scenario = "lift"
runs = 2
first_seed = 3
succeed_min = 2
[[grid]]
key = "object.mass_kg"
values = [1, 2.5]
[[grid]]
key = "hybrid.kz"
values = [0.05, 0.1, 0.2]
with.hybrid.loop_gain = [0.03, 0.02, 0.01]
[[ranges]]
key = "physics.friction"
min = 0.4
max = 1.0
"#;

/// The text for the sweep over a grid with `good` replaced by `bad`.
#[track_caller]
fn grid_gives(good: &str, bad: &str, expected: &str) {
    assert_eq!(GRID.matches(good).count(), 1, "{good:?} is to be found once");
    let (copy, path) = fixture(&GRID.replace(good, bad));
    let Err(error) = load_sweep(&path) else { panic!("the input is bad") };
    assert_eq!(error.to_string().replace(&format!("{}/", copy.path().display()), ""), expected);
}

#[test]
fn a_grid_has_every_value_with_every_other_and_all_of_them_with_every_seed() {
    let (_copy, path) = fixture(GRID);
    let loaded = load_sweep(&path).unwrap();
    assert_eq!(loaded.sweep.all_runs(), 12);
    assert_eq!(
        loaded.sweep.parameters().collect::<Vec<_>>(),
        ["object.mass_kg", "hybrid.kz", "physics.friction"]
    );
    let runs = loaded.runs(12);
    let places: Vec<_> =
        runs.iter().map(|run| (run.seed, run.parameters[0].1, run.parameters[1].1)).collect();
    let of_seed =
        |seed| [1.0, 2.5].into_iter().flat_map(move |mass| [0.05, 0.1, 0.2].map(move |kz| (seed, mass, kz)));
    assert_eq!(places, of_seed(3).chain(of_seed(4)).collect::<Vec<_>>());
    assert_eq!(runs[0].parameters[2], runs[5].parameters[2], "what is drawn depends on the seed");
    assert_ne!(runs[0].parameters[2], runs[6].parameters[2]);

    let run = &runs[5];
    let scenario = load_scenario(&loaded.scenario, &run.overrides, Some(run.seed)).unwrap().scenario;
    assert_eq!((scenario.object.mass_kg, scenario.hybrid.kz), (2.5, 0.2));
    assert_eq!(scenario.hybrid.loop_gain, 0.01, "it changes along");
}

#[test]
fn every_value_of_a_grid_is_tried_before_anything_runs() {
    grid_gives(
        "2.5",
        "-2.5",
        "sweeps/lifts.toml:9: object.mass_kg: found -2.5, expected a finite number above 0",
    );
    grid_gives(
        "0.1, 0.2]",
        "0.1, 2]",
        "sweeps/lifts.toml:12: hybrid.kz: found 2, expected a number above 0, up to 1",
    );
    grid_gives(
        "0.02, 0.01]",
        "0.02, -0.01]",
        "sweeps/lifts.toml:13: hybrid.loop_gain: found -0.01, expected a finite number above 0",
    );
}

#[test]
fn grids_that_make_no_sense_are_refused() {
    grid_gives(
        "0.02, 0.01]",
        "0.02]",
        "sweeps/lifts.toml:13: grid.1.with.hybrid.loop_gain: found 2 values, expected an array with one for each \
         of the 3 of \"hybrid.kz\"",
    );
    grid_gives("[1, 2.5]", "[]", "sweeps/lifts.toml:9: grid.0.values: found no value, expected at least one");
    grid_gives(
        "physics.friction",
        "hybrid.loop_gain",
        "sweeps/lifts.toml:15: ranges.0.key: found \"hybrid.loop_gain\" again, expected each name once",
    );
    grid_gives(
        "object.mass_kg",
        "seed",
        "sweeps/lifts.toml:8: grid.0.key: found \"seed\", expected a key of numbers",
    );
    grid_gives(
        "succeed_min = 2",
        "succeed_min = 13",
        "sweeps/lifts.toml:6: succeed_min: found 13, expected no more than all of the 12 runs",
    );
    grid_gives(
        "runs = 2",
        "runs = 50000",
        "sweeps/lifts.toml:7: grid: found a grid of 6 points with 50000 runs each, expected at most 100000 runs",
    );
}

#[test]
fn a_comparison_is_one_of_those_there_are_and_has_its_numbers() {
    let compared = |text: &str| GRID.replace("[[ranges]]", &format!("{text}\n[[ranges]]"));
    let loaded = load(&compared("[comparison.time-to-edge]\nwithin = 0.2"));
    assert_eq!(loaded.sweep.comparison, Some(Comparison::TimeToEdge { within: 0.2 }));
    grid_gives(
        "[[ranges]]",
        "[comparison.time-to-egde]\nwithin = 0.2\n[[ranges]]",
        "sweeps/lifts.toml:14: comparison: found \"time-to-egde\", expected one of \"time-to-edge\", \
         \"follower-delay\"; did you mean \"time-to-edge\"?",
    );
    grid_gives(
        "[[ranges]]",
        "[comparison.follower-delay]\npaper_falls_s = 0\n[[ranges]]",
        "sweeps/lifts.toml:15: comparison.follower-delay.paper_falls_s: found 0, expected a finite number above 0",
    );
}
