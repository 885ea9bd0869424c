//! The schedule of a run.

use mikoshi_config::{RunSpec, scenario as config};
use mikoshi_runtime::{Clock, Placement, ScheduleError, TickSchedule};

/// Which service has which core.
pub fn placement_of(scenario: &config::Scenario) -> Placement {
    let placement = &scenario.placement;
    Placement {
        bridge_core: placement.bridge_core,
        coordinator_core: placement.coordinator_core,
        servo_cores: placement.servo_cores.clone(),
    }
}

/// The schedule by which all services of this run meet.
///
/// # Errors
/// More robots than a team may have, or a coordination delay beyond what can be scheduled.
pub fn tick_schedule(run: &RunSpec) -> Result<TickSchedule, ScheduleError> {
    let placement = placement_of(&run.scenario);
    let schedule =
        TickSchedule::of_team(run.robots.len(), run.scenario.coordination_delay_ticks, &placement)?;
    let clock = match run.scenario.clock {
        config::Clock::Lockstep => Clock::Lockstep,
        config::Clock::Wall => Clock::Wall { period_ns: (run.scenario.wall_period_s() * 1e9).round() as u64 },
    };
    Ok(schedule.with_clock(clock))
}
