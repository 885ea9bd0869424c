//! A run as it would have been with other settings: for processes that take another one's place, and for
//! replays that ask what would have been.

use crate::failure::Failure;
use mikoshi_config::scenario::Control;
use mikoshi_config::{RunSpec, load_scenario, save_scenario, scenario_text};
use mikoshi_resolution::{resolve, tick_schedule};
use std::collections::BTreeSet;

/// The same run with these settings; who takes part, what is exchanged and when must stay.
///
/// # Errors
/// A setting that is wrong, or that changes more than one process may: bad usage.
pub fn revise(run: &RunSpec, overrides: &[(String, String)]) -> Result<RunSpec, Failure> {
    let folder = tempfile::tempdir().map_err(Failure::fault)?;
    let file = folder.path().join("scenario.toml");
    save_scenario(run, &file).map_err(Failure::fault)?;
    let loaded = load_scenario(&file, overrides, None).map_err(Failure::usage)?;
    let revised = resolve(&loaded).map_err(Failure::usage)?;
    let names = |run: &RunSpec| -> Vec<_> {
        run.robots.iter().map(|robot| (robot.member.clone(), robot.grasping_hands.clone())).collect()
    };
    let (old, new) = (&run.scenario, &revised.scenario);
    let keeps = [
        ("robots", names(run) == names(&revised)),
        ("control_period_s", old.control_period_s == new.control_period_s),
        ("coordination_delay_ticks", tick_schedule(run).ok() == tick_schedule(&revised).ok()),
        ("duration_s", run.ticks == revised.ticks),
    ];
    match keeps.into_iter().find(|(_, is_kept)| !is_kept) {
        None => Ok(revised),
        Some((key, _)) => Err(Failure::usage(format!("--set: {key} can't change in the middle of a run"))),
    }
}

/// What the coordinator alone reads, and goes on with in the middle of a run: gains, limits, references of forces.
/// A `*` stands for any one part of a key.
const SETTABLE: [&str; 36] = [
    "hybrid.kz",
    "hybrid.loop_gain",
    "hybrid.hand_stiffness_n_m",
    "hybrid.hand_stiffness_nm_rad",
    "hybrid.grasp_stiffness_n_m",
    "hybrid.grasp_stiffness_nm_rad",
    "hybrid.filter_hz",
    "hybrid.axes.*.reference",
    "load.hand_moment_nm",
    "load.shares",
    "load.shares.*",
    "safety.hand_force_max_n",
    "safety.hand_moment_max_nm",
    "safety.zmp_margin_min_m",
    "safety.tilt_max_rad",
    "safety.torque_limit_s",
    "safety.slip_m",
    "safety.slip_rad",
    "safety.slip_ticks",
    "safety.lost_grasp",
    "membership.*",
    "membership.*.leave_s",
    "membership.*.join_s",
    "membership.*.distance_m",
    "membership.*.speed_m_s",
    "membership.*.draw_back_m",
    "operator.drive.timeout_s",
    "operator.drive.velocity_max_m_s",
    "operator.drive.vertical_max_m_s",
    "operator.drive.yaw_rate_max_rad_s",
    "operator.drive.tilt_rate_max_rad_s",
    "operator.drive.acceleration_m_s2",
    "operator.drive.angular_acceleration_rad_s2",
    "operator.drive.range_m",
    "operator.drive.height_m",
    "operator.drive.tilt_rad",
];

/// Whether a run may go on as another, by changing the coordinator alone.
///
/// # Errors
/// A key that others read, too, or whose change nothing would smooth; in words.
pub fn may_be_set(run: &RunSpec, revised: &RunSpec) -> Result<(), String> {
    let table = |run: &RunSpec| -> Result<toml::Table, String> {
        let text = scenario_text(run).map_err(|error| error.to_string())?;
        text.parse().map_err(|error: toml::de::Error| error.to_string())
    };
    let mut changed = vec![];
    let (old, new) = (toml::Value::Table(table(run)?), toml::Value::Table(table(revised)?));
    find_changes("", Some(&old), Some(&new), &mut changed);
    let is_settable = |key: &String| SETTABLE.iter().any(|pattern| matches_key(pattern, key));
    if let Some(key) = changed.iter().find(|key| !is_settable(key)) {
        return Err(format!(
            "{key} can't be set in the middle of a run: others read it, too, or nothing smooths its change. Can be: {}",
            SETTABLE.join(", ")
        ));
    }
    let positions = run.scenario.hybrid.axes.iter().enumerate();
    let mut positions = positions.filter(|(_, axis)| axis.control == Control::Position);
    match positions.find(|(index, _)| changed.contains(&format!("hybrid.axes.{index}.reference"))) {
        Some((index, _)) => Err(format!(
            "hybrid.axes.{index}.reference can't be set in the middle of a run: hands would jump to another position"
        )),
        None => Ok(()),
    }
}

/// All keys whose values differ.
fn find_changes(key: &str, old: Option<&toml::Value>, new: Option<&toml::Value>, changed: &mut Vec<String>) {
    let below = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match (old, new) {
        (Some(toml::Value::Table(old)), Some(toml::Value::Table(new))) => {
            let names: BTreeSet<_> = old.keys().chain(new.keys()).collect();
            for name in names {
                find_changes(&below(name), old.get(name), new.get(name), changed);
            }
        }
        (Some(toml::Value::Array(old)), Some(toml::Value::Array(new))) => {
            for index in 0..old.len().max(new.len()) {
                find_changes(&below(&index.to_string()), old.get(index), new.get(index), changed);
            }
        }
        (old, new) if old != new => changed.push(key.to_owned()),
        _ => {}
    }
}

fn matches_key(pattern: &str, key: &str) -> bool {
    let (mut parts, mut found) = (pattern.split('.'), key.split('.'));
    loop {
        match (parts.next(), found.next()) {
            (None, None) => return true,
            (Some(part), Some(name)) if part == "*" || part == name => {}
            _ => return false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn run(scenario: &str, overrides: &[(&str, &str)]) -> RunSpec {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios");
        let overrides: Vec<_> =
            overrides.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        let loaded = load_scenario(&folder.join(scenario), &overrides, None).expect("a scenario");
        resolve(&loaded).expect("a run")
    }

    fn set(scenario: &str, settings: &[(&str, &str)]) -> Result<(), String> {
        let run = run(scenario, &[]);
        let overrides: Vec<_> =
            settings.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        may_be_set(&run, &revise(&run, &overrides).map_err(|failure| failure.message)?)
    }

    #[test]
    fn gains_limits_and_references_of_forces_may_be_set() {
        assert_eq!(set("squeeze.toml", &[]), Ok(()));
        let settings = [
            ("hybrid.loop_gain", "0.04"),
            ("hybrid.axes.0.reference", "30"),
            ("safety.tilt_max_rad", "0.15"),
            ("hybrid.grasp_stiffness_n_m", "50e3"),
        ];
        assert_eq!(set("squeeze.toml", &settings), Ok(()));
        assert_eq!(set("drive.toml", &[("operator.drive.range_m", "2.0")]), Ok(()));
        let leave = ("membership", r#"[{robot = "D", leave_s = 30.0, join_s = 60.0}]"#);
        assert_eq!(set("drive.toml", &[leave]), Ok(()));
        assert_eq!(set("members.toml", &[("membership.0.leave_s", "7.0")]), Ok(()));
    }

    #[test]
    fn what_others_read_or_nothing_smooths_may_not() {
        for (scenario, key, value) in [
            ("drive.toml", "gait.lift_m", "0.04"),
            ("drive.toml", "operator.drive.braking_m_s2", "0.4"),
            ("drive.toml", "safety.stale_limit_ticks", "20"),
            ("drive.toml", "physics.friction", "0.8"),
            ("drive.toml", "hybrid.start_s", "2.0"),
            ("position_axis.toml", "hybrid.axes.0.reference", "0.02"),
            ("squeeze.toml", "hybrid.axes.0.control", "\"position\""),
            ("squeeze.toml", "thresholds.internal_end_n", "5"),
        ] {
            let error = set(scenario, &[("hybrid.kz", "0.04"), (key, value)]).expect_err(key);
            assert!(error.contains(key) && error.contains("in the middle of a run"), "{key}: {error}");
        }
        let error = set("drive.toml", &[("hybrid.kz", "7")]).expect_err("too much");
        assert!(error.contains("hybrid.kz: found 7"), "{error}");
    }
}
