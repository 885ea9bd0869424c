//! The plan that a servo sends for the case that it is lost: part by part, judged, put together, read.

use bytemuck::{Pod, Zeroable};
use mikoshi_ipc_types::{FALLBACK_PARTS, JointCommand, MAX_JOINTS};

const PARTS: u64 = FALLBACK_PARTS as u64;
/// Knots of a plan; its last part is none.
const KNOTS: usize = FALLBACK_PARTS - 1;
/// No knot lies farther ahead.
const FARTHEST_TICKS: u64 = 10_000;

/// A value by joint.
pub(crate) type ByJoint = [f64; MAX_JOINTS];

/// As much of a plan as has come.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plan {
    /// Parts that have come.
    parts: u64,
    /// Tick of the command that the first one came with.
    begin_tick: u64,
    knot_tick: [u64; FALLBACK_PARTS],
    position_rad: [ByJoint; FALLBACK_PARTS],
}

// SAFETY: zeros are a valid value of integers and floats.
unsafe impl Zeroable for Plan {}
// SAFETY: `repr(C)` over integers and floats of one size: no padding, any bit pattern valid.
unsafe impl Pod for Plan {}

impl Plan {
    /// Takes the part that comes with a command. One that does not follow, or that no robot with these joint limits
    /// can carry out, ends the plan.
    pub(crate) fn hear(&mut self, tick: u64, command: &JointCommand, limits: &[[f64; 2]]) {
        if command.fallback_part == 1 {
            (self.parts, self.begin_tick) = (0, tick);
        }
        let follows = command.fallback_part == self.parts + 1 && tick == self.begin_tick + self.parts;
        let index = self.parts as usize;
        let slot = self.knot_tick.get_mut(index).zip(self.position_rad.get_mut(index));
        let (true, Some((knot_tick, position))) = (follows, slot) else {
            self.parts = 0;
            return;
        };
        *position = command.fallback_position_rad;
        *knot_tick = tick.saturating_add(command.fallback_ahead_ticks.min(FARTHEST_TICKS));
        self.parts += 1;
        if !self.is_possible(limits) {
            self.parts = 0;
        }
    }

    /// Whether the last part that came may be what it says.
    fn is_possible(&self, limits: &[[f64; 2]]) -> bool {
        let index = (self.parts as usize).saturating_sub(1);
        let (Some(position), Some(&tick)) = (self.position_rad.get(index), self.knot_tick.get(index)) else {
            return false;
        };
        let is_in_order = match index.checked_sub(1).and_then(|before| self.knot_tick.get(before)) {
            // A plan is for the ticks after its last part.
            None => tick == self.begin_tick + PARTS,
            Some(&before) if index < KNOTS => tick > before,
            Some(&before) => tick == before,
        };
        let are_within =
            position.iter().zip(limits).all(|(angle, [lower, upper])| (lower..=upper).contains(&angle));
        is_in_order && are_within
    }

    /// Whether all parts have come.
    pub(crate) fn is_whole(&self) -> bool {
        self.parts == PARTS
    }

    /// Whether it is for a servo that is lost in this tick; where the next plan did not become whole, the last one
    /// serves.
    pub(crate) fn is_for(&self, tick: u64) -> bool {
        let first = self.begin_tick.saturating_add(PARTS);
        self.is_whole() && (first..first.saturating_add(2 * PARTS)).contains(&tick)
    }

    /// How much of its last part applies to a servo that is lost in this tick.
    pub(crate) fn lateness(&self, tick: u64) -> f64 {
        tick.saturating_sub(self.begin_tick.saturating_add(PARTS)) as f64 / PARTS as f64
    }

    /// By how much its last part differs from its end.
    pub(crate) fn late_offset(&self, joint: usize) -> f64 {
        self.knot(KNOTS, joint) - self.knot(KNOTS - 1, joint)
    }

    /// Angle and rate \[rad, rad/tick\] of a joint at a tick: cubic between knots, with the rate at a knot that of
    /// its neighbours, and at rest from the last knot on.
    pub(crate) fn at(&self, tick: u64, joint: usize) -> (f64, f64) {
        let after = self.knot_tick.iter().take(KNOTS).position(|&knot| knot > tick);
        let Some(after) = after else { return (self.knot(KNOTS - 1, joint), 0.0) };
        let Some(before) = after.checked_sub(1) else { return (self.knot(0, joint), 0.0) };
        let (from, to) = (self.knot(before, joint), self.knot(after, joint));
        let length = self.ticks(before, after);
        let (rate_from, rate_to) = (self.rate(before, joint) * length, self.rate(after, joint) * length);
        let s = self.knot_tick.get(before).map_or(0.0, |&knot| (tick - knot) as f64) / length;
        let way = to - from;
        let (second, third) = (3.0 * way - 2.0 * rate_from - rate_to, rate_from + rate_to - 2.0 * way);
        let angle = from + (rate_from + (second + third * s) * s) * s;
        (angle, (rate_from + (2.0 * second + 3.0 * third * s) * s) / length)
    }

    /// At a knot \[rad/tick\]: that of the parabola through it and its neighbours.
    fn rate(&self, knot: usize, joint: usize) -> f64 {
        if knot + 1 >= KNOTS {
            return 0.0;
        }
        let here = self.knot(knot, joint);
        let later = (self.knot(knot + 1, joint) - here) / self.ticks(knot, knot + 1);
        let Some(before) = knot.checked_sub(1) else { return later };
        let earlier = (here - self.knot(before, joint)) / self.ticks(before, knot);
        let share = self.ticks(before, knot) / self.ticks(before, knot + 1);
        earlier + (later - earlier) * share
    }

    fn ticks(&self, from: usize, to: usize) -> f64 {
        let tick = |knot: usize| self.knot_tick.get(knot).copied().unwrap_or_default();
        tick(to).saturating_sub(tick(from)).max(1) as f64
    }

    fn knot(&self, knot: usize, joint: usize) -> f64 {
        self.position_rad.get(knot).and_then(|position| position.get(joint)).copied().unwrap_or_default()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) const BEGIN: u64 = 1000;
    const SPACING: u64 = 14;
    pub(crate) const LIMITS: [[f64; 2]; 2] = [[-2.0, 2.0]; 2];

    /// Joint 1 turns by a radian from one end of the plan to the other.
    pub(crate) fn angle(knot: u64) -> f64 {
        let s = knot as f64 / (KNOTS - 1) as f64;
        s * s * (3.0 - 2.0 * s)
    }

    /// What comes with the commands of a plan; its last part says that joint 1 is .1 rad farther.
    pub(crate) fn part(index: u64) -> JointCommand {
        let mut command = JointCommand::zeroed();
        let knot = index.min(PARTS - 2);
        command.fallback_part = index + 1;
        command.fallback_ahead_ticks = PARTS + SPACING * knot - index;
        command.fallback_position_rad[1] = angle(knot) + if index + 1 == PARTS { 0.1 } else { 0.0 };
        command
    }

    fn heard(spoil: impl Fn(u64, &mut u64, &mut JointCommand)) -> Plan {
        let mut plan = Plan::zeroed();
        for index in 0..PARTS {
            let (mut tick, mut command) = (BEGIN + index, part(index));
            spoil(index, &mut tick, &mut command);
            plan.hear(tick, &command, &LIMITS);
        }
        plan
    }

    #[test]
    fn a_plan_leads_smoothly_through_its_knots_and_ends_at_rest() {
        let plan = heard(|_, _, _| ());
        assert!(plan.is_whole());
        let first = BEGIN + PARTS;
        for knot in 0..PARTS - 1 {
            let (found, _) = plan.at(first + SPACING * knot, 1);
            assert!((found - angle(knot)).abs() < 1e-12, "knot {knot}: {found}");
        }
        let last = first + SPACING * (PARTS - 2);
        for tick in first..last + 20 {
            let ((here, rate), (next, next_rate)) = (plan.at(tick, 1), plan.at(tick + 1, 1));
            assert!((next - here - (rate + next_rate) / 2.0).abs() < 2e-5, "at {tick}");
            assert!((next_rate - rate).abs() < 4e-4, "at {tick}: {rate} to {next_rate}");
        }
        assert_eq!(plan.at(last + 1000, 1), (1.0, 0.0));
        assert_eq!(plan.at(last, 0), (0.0, 0.0));
        assert!((plan.late_offset(1) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_plan_is_for_the_ticks_after_it_and_a_cycle_more() {
        let plan = heard(|_, _, _| ());
        let first = BEGIN + PARTS;
        let found =
            [first - 1, first, first + 2 * PARTS - 1, first + 2 * PARTS].map(|tick| plan.is_for(tick));
        assert_eq!(found, [false, true, true, false]);
        assert_eq!(plan.lateness(first + PARTS / 2), 0.5);
        assert!(!Plan::zeroed().is_for(0) && !Plan::zeroed().is_for(PARTS));
    }

    #[test]
    fn a_plan_that_can_not_be_is_none() {
        type Spoil = fn(&mut u64, &mut JointCommand);
        let spoils: [(&str, Spoil); 8] = [
            ("a joint beyond its limit", |_, command| command.fallback_position_rad[1] = 2.1),
            ("an angle that is none", |_, command| command.fallback_position_rad[0] = f64::NAN),
            ("a knot before the last one", |_, command| command.fallback_ahead_ticks = 1),
            ("a knot that never comes", |_, command| command.fallback_ahead_ticks = u64::MAX),
            ("a part that does not follow", |_, command| command.fallback_part += 1),
            ("a part that can't be", |_, command| command.fallback_part = u64::MAX),
            ("no part", |_, command| command.fallback_part = 0),
            ("a tick that is missing", |tick, _| *tick += 1),
        ];
        for (what, spoil) in spoils {
            for spoilt in [1, 7, PARTS - 1] {
                let plan = heard(|index, tick, command| {
                    if index == spoilt {
                        spoil(tick, command);
                    }
                });
                assert!(!plan.is_whole(), "{what}, part {spoilt}");
            }
        }
        let late = heard(|index, _, command| command.fallback_ahead_ticks += u64::from(index == 0));
        assert!(!late.is_whole(), "it does not cover the tick after its last part");
    }
}
