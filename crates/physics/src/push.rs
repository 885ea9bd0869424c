//! Forces from outside, by script or by the operator's word: each acts on one body for some ticks.

use bytemuck::{Pod, Zeroable};
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::Push;

/// What the scenario has, by the tick in which it begins.
#[derive(Clone, Debug, Default)]
pub struct PushScript(Vec<(u64, Push)>);

impl PushScript {
    /// Of this run. Whom they push was found to be there when the scenario was read.
    pub fn of(run: &RunSpec) -> Self {
        let scenario = &run.scenario;
        let event = |event: &mikoshi_config::scenario::PushEvent| {
            let ticks = scenario.tick_at(event.for_s).max(1);
            let target = scenario.push_target(&event.on)?;
            Some((
                scenario.tick_at(event.at_s),
                Push { number: 0, target, force_n: event.turned_force_n(), ticks },
            ))
        };
        Self(scenario.world.pushes.iter().filter_map(event).collect())
    }

    /// Begins those of this tick.
    pub fn begin(&self, pushes: &mut [ActivePush], tick: u64) {
        self.0.iter().filter(|(at, _)| *at == tick).for_each(|(_, push)| begin(pushes, push, tick));
    }
}

/// What pushes a body, up to some tick. One by body: the object, then robots.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ActivePush {
    force_n: [f64; 3],
    until_tick: u64,
}

/// Puts a push in the place of what pushes the same body. Bodies that are not there are not pushed.
pub fn begin(pushes: &mut [ActivePush], push: &Push, tick: u64) {
    if let Some(active) = pushes.get_mut(push.target as usize) {
        *active = ActivePush { force_n: push.force_n, until_tick: tick.saturating_add(push.ticks) };
    }
}

/// Whether any body is pushed in this tick.
pub fn are_active(pushes: &[ActivePush], tick: u64) -> bool {
    pushes.iter().any(|push| push.until_tick > tick)
}

/// The force on body number `target` in this tick.
pub fn force_n(pushes: &[ActivePush], target: usize, tick: u64) -> [f64; 3] {
    let active = pushes.get(target).filter(|push| push.until_tick > tick);
    active.map_or([0.0; 3], |push| push.force_n)
}
