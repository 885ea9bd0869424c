//! Forces from outside, on MuJoCo's bodies.

use crate::layout::Layout;
use mikoshi_physics::{ActivePush, force_n};
use mujoco_rs::prelude::{MjData, MjModel};

/// Adds all forces of this tick to those that are set on the object; bases of robots bear no others.
pub fn apply(data: &mut MjData<Box<MjModel>>, layout: &Layout, pushes: &[ActivePush], tick: u64) {
    let bodies =
        core::iter::once(layout.object.body).chain(layout.robots.iter().map(|robot| robot.base.body));
    for (target, body) in bodies.enumerate() {
        let applied = &mut data.xfrc_applied_mut()[body];
        if target > 0 {
            *applied = [0.0; 6];
        }
        applied.iter_mut().zip(force_n(pushes, target, tick)).for_each(|(sum, force)| *sum += force);
    }
}

/// Takes all of them away.
pub fn clear(data: &mut MjData<Box<MjModel>>, layout: &Layout) {
    let applied = data.xfrc_applied_mut();
    applied[layout.object.body] = [0.0; 6];
    layout.robots.iter().for_each(|robot| applied[robot.base.body] = [0.0; 6]);
}
