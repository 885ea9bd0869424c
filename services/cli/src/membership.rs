//! A run in which somebody leaves or joins from now on.

use mikoshi_config::RunSpec;
use mikoshi_config::scenario::Membership;

/// The setting of `membership` in which `robot` is asked to leave, or to join, in `tick`, or as soon after what it was asked
/// before as may be. As far and as fast as its last entry has it.
///
/// # Errors
/// There is nothing in it that could be written; in words.
pub fn asked_from(run: &RunSpec, robot: &str, leaves: bool, tick: u64) -> Result<(String, String), String> {
    let scenario = &run.scenario;
    let mut entries = scenario.membership.clone();
    let period_s = scenario.control_period_s;
    let last = entries.iter().rposition(|entry| entry.robot == robot);
    let asked_s =
        last.and_then(|last| entries[last].leave_s.into_iter().chain(entries[last].join_s).reduce(f64::max));
    let time_s = (tick as f64 * period_s).max(asked_s.map_or(0.0, |asked_s| asked_s + period_s));
    let is_away = last.is_some_and(|last| entries[last].join_s.is_none());
    match last {
        _ if leaves && is_away => return Err(format!("{robot} is asked to be away already")),
        Some(last) if !leaves && is_away => entries[last].join_s = Some(time_s),
        _ if !leaves => return Err(format!("{robot} is in the team already, or asked to join")),
        Some(last) => {
            entries.push(Membership { leave_s: Some(time_s), join_s: None, ..entries[last].clone() })
        }
        None => entries.push(Membership { leave_s: Some(time_s), ..Membership::of(robot) }),
    }
    let value = toml::Value::try_from(entries).map_err(|error| error.to_string())?;
    Ok(("membership".to_owned(), value.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::revise::{may_be_set, revise};
    use mikoshi_config::load_scenario;
    use mikoshi_resolution::resolve;
    use std::path::Path;

    #[test]
    fn who_is_asked_to_leave_and_to_join_by_turns_is_heard_and_nobody_else() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios");
        let loaded = load_scenario(&folder.join("drive.toml"), &[], None).expect("a scenario");
        let mut run = resolve(&loaded).expect("a run");
        assert!(asked_from(&run, "D", false, 10).expect_err("it is there").contains("in the team already"));
        for (leaves, expected) in [(true, (1, None)), (false, (1, Some(0.055))), (true, (2, None))] {
            let setting = asked_from(&run, "D", leaves, 10).expect("a setting");
            let revised = revise(&run, &[setting]).map_err(|failure| failure.message).expect("a run");
            assert_eq!(may_be_set(&run, &revised), Ok(()));
            let entries = &revised.scenario.membership;
            let join_s = entries.last().and_then(|entry| entry.join_s);
            assert_eq!((entries.len(), join_s.map(|s| (s * 1e6).round() / 1e6)), expected);
            run = revised;
        }
        assert!(asked_from(&run, "D", true, 99).expect_err("it leaves").contains("away already"));
        let of_nobody = asked_from(&run, "Z", true, 10).expect("a setting");
        assert!(revise(&run, &[of_nobody]).is_err(), "there is no such robot");
    }
}
