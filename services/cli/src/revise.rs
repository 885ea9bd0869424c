//! A run as it would have been with other settings: for processes that take another one's place, and for
//! replays that ask what would have been.

use crate::failure::Failure;
use mikoshi_config::{RunSpec, load_scenario, save_scenario};
use mikoshi_resolution::{resolve, tick_schedule};

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
