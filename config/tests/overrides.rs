//! What lies over what: team, scenario, `--set`, `--seed`.

use mikoshi_config::{Scenario, load_scenario};
use std::path::Path;

fn load(options: &[(&str, &str)], seed: Option<u64>) -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixture/scenarios/lift.toml");
    let overrides: Vec<_> = options.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    load_scenario(&path, &overrides, seed).unwrap_or_else(|error| panic!("{error}")).scenario
}

#[test]
fn the_team_lies_beneath_the_scenario() {
    let scenario = load(&[], None);
    assert_eq!(scenario.object.mass_kg, 3.0);
    assert_eq!(scenario.robots.len(), 2);
    // Both files have this table: it is joined key by key, and the scenario wins.
    assert_eq!(scenario.thresholds.foot_slip_max_m, Some(0.005));
    assert_eq!(scenario.thresholds.zmp_margin_min_m, Some(0.02));
}

#[test]
fn ratios_of_periods_are_rounded_to_whole_ticks() {
    let scenario = load(&[("duration_s", "0.3"), ("control_period_s", "0.1"), ("hybrid.start_s", "")], None);
    assert_eq!(scenario.ticks(), 3, "0.3 / 0.1 is a little less than 3");
    assert_eq!(scenario.substeps(), 100);
}

#[test]
fn another_team_is_read_before_options_apply_to_it() {
    let robots = "[{name=\"L\", model=\"arm\", x_m=0, y_m=0, yaw_deg=0}, {name=\"R\", model=\"arm\", x_m=1, y_m=0, yaw_deg=0}]";
    let options = [
        ("object.size_m", "[1, 1, 1]"),
        ("object.position_m", "[0, 0, 0]"),
        ("robots", robots),
        ("team", "solo"),
    ];
    let scenario = load(&options, None);
    assert_eq!((scenario.team.as_deref(), scenario.object.mass_kg), (Some("solo"), 1.0));
    assert_eq!(scenario.robots[1].x_m, 1.0);
}

#[test]
fn options_reach_into_tables_and_arrays() {
    let options = [
        ("object.mass_kg", "10"),
        ("robots.1.x_m", "0.6"),
        ("object.size_m.2", "0.4"),
        ("sensors.delay_ticks", "4"),
    ];
    let scenario = load(&options, None);
    assert_eq!(scenario.object.mass_kg, 10.0);
    assert_eq!(scenario.robots[1].x_m, 0.6);
    assert_eq!(scenario.object.size_m, [0.6, 0.7, 0.4]);
    assert_eq!(scenario.sensors.delay_ticks, 4);
}

#[test]
fn the_last_of_two_options_wins() {
    assert_eq!(load(&[("hybrid.kz", "0.1"), ("hybrid.kz", "0.2")], None).hybrid.kz, 0.2);
}

#[test]
fn an_empty_value_takes_a_key_away() {
    assert_eq!(load(&[("hybrid.start_s", "")], None).hybrid.start_s, None);
    assert_eq!(load(&[("physics", "")], None).physics.friction, 1.0);
}

#[test]
fn the_seed_option_lies_over_everything() {
    assert_eq!(load(&[], None).seed, 0);
    assert_eq!(load(&[("seed", "7")], None).seed, 7);
    assert_eq!(load(&[("seed", "7")], Some(u64::MAX)).seed, u64::MAX);
}
