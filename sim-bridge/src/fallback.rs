//! What drives do whose commands are missing for good: they play the plan that the servo has sent beforehand, and
//! without one they stay where they are. Who plays a plan comes into it, and out of it again, without a jump.

use crate::coast::Coast;
use crate::plan::{ByJoint, Plan};
use bytemuck::{Pod, Zeroable};
use mikoshi_ipc_types::{JointCommand, MAX_JOINTS};

/// Time constant in which drives go over from one reference to another.
const CHANGE_S: f64 = 0.1;
/// What is left of a change below which it is over \[rad\].
const NOTHING_RAD: f64 = 1e-6;

/// What drives know of their servo. All of it matters between ticks.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FallbackState {
    /// The last whole plan, and the one that is coming.
    plan: Plan,
    coming: Plan,
    /// Ticks in a row without a command that could be used.
    silent_ticks: u64,
    /// 1 while the plan is played.
    plays: u64,
    /// How much of the plan's last part applies.
    lateness: f64,
    /// 1 while there is an offset.
    changes: u64,
    /// Of what drives are told against what they should be told, and its rate \[rad, rad/s\].
    offset_rad: ByJoint,
    offset_rate_rad_s: ByJoint,
}

// SAFETY: zeros are a valid value of integers and floats.
unsafe impl Zeroable for FallbackState {}
// SAFETY: `repr(C)` over integers and floats of one size: no padding, any bit pattern valid.
unsafe impl Pod for FallbackState {}

/// How the drives of one robot go on. Immutable.
#[derive(Clone, Debug)]
pub(crate) struct Fallback {
    period_s: f64,
    coast: Coast,
    /// Lower and upper limit of each joint.
    limits: Vec<[f64; 2]>,
}

impl Fallback {
    /// For joints with these limits, at this control period.
    pub(crate) fn new(period_s: f64, limits: Vec<[f64; 2]>) -> Self {
        Self { period_s, coast: Coast::of_period(period_s), limits }
    }

    /// Drives are told `command` after `last`.
    pub(crate) fn hear(
        &self,
        state: &mut FallbackState,
        tick: u64,
        command: &JointCommand,
        last: &JointCommand,
    ) -> JointCommand {
        state.silent_ticks = 0;
        state.coming.hear(tick, command, &self.limits);
        if state.coming.is_whole() {
            state.plan = state.coming;
        } else if command.fallback_part == 0 {
            state.plan = Plan::zeroed();
        }
        if core::mem::take(&mut state.plays) != 0 {
            let before = command.joint_position_ref_rad.iter().zip(&command.joint_velocity_ref_rad_s);
            let before = before.map(|(angle, rate)| (angle - rate * self.period_s, *rate));
            state.start_change(before, last);
        }
        let mut command = *command;
        if state.changes != 0 {
            self.change(state, &mut command, |_| 0.0);
        }
        command
    }

    /// Drives are told nothing in this tick; without a plan they would be told `otherwise`.
    pub(crate) fn miss(
        &self,
        state: &mut FallbackState,
        tick: u64,
        otherwise: JointCommand,
        last: &JointCommand,
    ) -> JointCommand {
        state.silent_ticks = state.silent_ticks.saturating_add(1);
        if self.coast.is_late(state.silent_ticks) {
            return otherwise;
        }
        let lost_tick = (tick + 1).saturating_sub(state.silent_ticks);
        if state.plays == 0 && state.plan.is_for(lost_tick) {
            (state.plays, state.lateness) = (1, state.plan.lateness(lost_tick));
            let (plan, before) = (state.plan, tick.saturating_sub(1));
            let played = (0..self.limits.len()).map(|joint| plan.at(before, joint));
            state.start_change(played.map(|(angle, rate)| (angle, rate / self.period_s)), last);
        }
        if state.plays == 0 {
            return otherwise;
        }
        let mut command = otherwise;
        let drives = command.joint_position_ref_rad.iter_mut().zip(&mut command.joint_velocity_ref_rad_s);
        for (joint, (angle, rate)) in drives.enumerate().take(self.limits.len()) {
            let (at, rate_per_tick) = state.plan.at(tick, joint);
            (*angle, *rate) = (at, rate_per_tick / self.period_s);
        }
        let (plan, lateness) = (state.plan, state.lateness);
        self.change(state, &mut command, |joint| lateness * plan.late_offset(joint));
        command
    }

    /// Adds what is left of the offset, which goes to `rest` as a critically damped spring does:
    /// with y = x − rest and λ = 1/τ, `y ← (y + (ẏ + λ y) T) e^(−λT)`, `ẏ ← (ẏ − λ (ẏ + λ y) T) e^(−λT)`.
    fn change(&self, state: &mut FallbackState, command: &mut JointCommand, rest: impl Fn(usize) -> f64) {
        let (lambda, dt) = (1.0 / CHANGE_S, self.period_s);
        let decay = (-lambda * dt).exp();
        let mut left: f64 = 0.0;
        let told = command.joint_position_ref_rad.iter_mut().zip(&mut command.joint_velocity_ref_rad_s);
        let offsets = state.offset_rad.iter_mut().zip(&mut state.offset_rate_rad_s);
        let joints = told.zip(offsets).zip(&self.limits).enumerate();
        for (joint, (((angle, rate), (offset, offset_rate)), [lower, upper])) in joints {
            let rest = rest(joint);
            let (from, speed) = (*offset - rest, *offset_rate);
            let pull = (speed + lambda * from) * dt;
            (*offset, *offset_rate) = (rest + (from + pull) * decay, (speed - lambda * pull) * decay);
            *angle = (*angle + *offset).clamp(*lower, *upper);
            *rate += *offset_rate;
            left = left.max(offset.abs()).max(offset_rate.abs() * CHANGE_S);
        }
        if left < NOTHING_RAD && state.plays == 0 {
            state.changes = 0;
        }
    }
}

impl FallbackState {
    /// Drives that were told `last` shall be told what was this angle and rate of each joint then.
    fn start_change(&mut self, before: impl Iterator<Item = (f64, f64)>, last: &JointCommand) {
        (self.offset_rad, self.offset_rate_rad_s) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        let told = last.joint_position_ref_rad.iter().zip(&last.joint_velocity_ref_rad_s);
        let offsets = self.offset_rad.iter_mut().zip(&mut self.offset_rate_rad_s);
        for ((offset, rate), ((angle, speed), (angle_before, rate_before))) in offsets.zip(told.zip(before)) {
            (*offset, *rate) = (angle - angle_before, speed - rate_before);
        }
        self.changes = 1;
    }
}
