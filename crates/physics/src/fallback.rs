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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::tests::{BEGIN, LIMITS, angle, part};
    use mikoshi_ipc_types::FALLBACK_PARTS;

    const PARTS: u64 = FALLBACK_PARTS as u64;
    const PERIOD_S: f64 = 0.005;

    fn fallback() -> Fallback {
        Fallback::new(PERIOD_S, LIMITS.to_vec())
    }

    /// As the plan has it at its beginning, and a little beside it.
    fn command(index: u64) -> JointCommand {
        let mut command = part(index);
        command.joint_position_ref_rad[..2].copy_from_slice(&[0.03, 0.02]);
        command
    }

    /// Drives that have heard a whole plan, what they were told last, and the tick of their first miss.
    fn after_a_plan(fallback: &Fallback) -> (FallbackState, JointCommand, u64) {
        let (mut state, mut last) = (FallbackState::zeroed(), JointCommand::zeroed());
        for index in 0..PARTS {
            let command = command(index);
            last = fallback.hear(&mut state, BEGIN + index, &command, &last);
            assert_eq!(bytemuck::bytes_of(&last), bytemuck::bytes_of(&command), "nothing is missing");
        }
        (state, last, BEGIN + PARTS)
    }

    /// Misses so many ticks from `tick` on; the largest step and change of rate of a joint.
    fn miss(
        fallback: &Fallback,
        state: &mut FallbackState,
        last: &mut JointCommand,
        ticks: core::ops::Range<u64>,
    ) -> (f64, f64) {
        let (mut step, mut jolt): (f64, f64) = (0.0, 0.0);
        for tick in ticks {
            let next = fallback.miss(state, tick, *last, last);
            step = step.max(largest(&next.joint_position_ref_rad, &last.joint_position_ref_rad));
            jolt = jolt.max(largest(&next.joint_velocity_ref_rad_s, &last.joint_velocity_ref_rad_s));
            *last = next;
        }
        (step, jolt)
    }

    fn largest(some: &ByJoint, others: &ByJoint) -> f64 {
        some.iter().zip(others).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn drives_play_the_plan_once_commands_are_missing_for_good() {
        let fallback = fallback();
        let (mut state, mut last, lost) = after_a_plan(&fallback);
        let told = last;
        miss(&fallback, &mut state, &mut last, lost..lost + 4);
        assert_eq!(last, told, "commands may only be late");
        let (step, jolt) = miss(&fallback, &mut state, &mut last, lost + 4..lost + 600);
        assert!(step < 0.01 && jolt < 0.3, "{step} rad in a tick, {jolt} rad/s");
        // The servo was lost at the first tick that the plan is for: its last part does not matter.
        assert!(last.joint_position_ref_rad[0].abs() < 1e-6);
        assert!((last.joint_position_ref_rad[1] - angle(PARTS - 2)).abs() < 1e-6);
        assert!(largest(&last.joint_velocity_ref_rad_s, &[0.0; MAX_JOINTS]) < 1e-6);
        assert_eq!(last.closed_hands, told.closed_hands);
    }

    #[test]
    fn the_later_the_loss_the_more_of_the_last_part_applies() {
        let fallback = fallback();
        let (mut state, mut last, lost) = after_a_plan(&fallback);
        for tick in lost..lost + PARTS / 2 {
            last = fallback.hear(&mut state, tick, &command(tick - lost), &last);
        }
        miss(&fallback, &mut state, &mut last, lost + PARTS / 2..lost + 600);
        assert!((last.joint_position_ref_rad[1] - angle(PARTS - 2) - 0.05).abs() < 1e-6);
    }

    #[test]
    fn without_a_plan_drives_stay_where_they_are() {
        let fallback = fallback();
        let (mut state, mut last, lost) = after_a_plan(&fallback);
        last = fallback.hear(&mut state, lost, &JointCommand { fallback_part: 0, ..command(0) }, &last);
        let told = last;
        miss(&fallback, &mut state, &mut last, lost + 1..lost + 100);
        assert_eq!(last, told);
    }

    #[test]
    fn a_servo_that_comes_back_takes_over_without_a_jump_and_is_then_heard_to_the_letter() {
        let fallback = fallback();
        let (mut state, mut last, lost) = after_a_plan(&fallback);
        miss(&fallback, &mut state, &mut last, lost..lost + 200);
        assert!(last.joint_position_ref_rad[1] > 0.3, "it has come far");
        let (mut step, mut jolt): (f64, f64) = (0.0, 0.0);
        for tick in lost + 200..lost + 800 {
            let next = fallback.hear(&mut state, tick, &command(0), &last);
            step = step.max(largest(&next.joint_position_ref_rad, &last.joint_position_ref_rad));
            jolt = jolt.max(largest(&next.joint_velocity_ref_rad_s, &last.joint_velocity_ref_rad_s));
            last = next;
        }
        assert!(step < 0.02 && jolt < 0.5, "{step} rad in a tick, {jolt} rad/s");
        assert_eq!(bytemuck::bytes_of(&last), bytemuck::bytes_of(&command(0)));
    }

    #[test]
    fn drives_are_never_told_to_go_beyond_a_limit() {
        let fallback = fallback();
        let (mut state, mut last, lost) = after_a_plan(&fallback);
        last.joint_position_ref_rad[1] = 1.99;
        last.joint_velocity_ref_rad_s[1] = 3.0;
        for tick in lost..lost + 600 {
            last = fallback.miss(&mut state, tick, last, &last);
            assert!(last.joint_position_ref_rad[1] <= LIMITS[1][1], "{}", last.joint_position_ref_rad[1]);
        }
    }
}
