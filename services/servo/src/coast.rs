//! What a servo makes of silence: the last command, led on tick by tick.
//!
//! Robots that hear the same last command lead it on in the same way, so that a team without its coordinator
//! finishes its step and stands, all feet on the same ticks.

use bytemuck::{Pod, Zeroable};
use mikoshi_humanoid::gait::{StepClock, StepTiming};
use mikoshi_ipc_types::{MAX_HANDS, TeamCommand};
use mikoshi_spatial::{Hand, Pose, Twist, World};

/// For how long hands go on as if nothing had happened: commands that are late come in this time.
const GO_ON_S: f64 = 0.02;
/// Time constant with which they then come to rest.
const REST_S: f64 = 0.1;

/// How the hands of one who hears nothing go on.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct Course {
    /// By which each hand's reference moved between the last two commands. That is more than its twist, which knows
    /// nothing of how hands give way to forces.
    steps: [[f64; 6]; MAX_HANDS],
    /// For how many ticks in a row nothing was heard.
    silent_ticks: u64,
}

impl Course {
    /// Takes note of a command that follows `last`.
    pub(crate) fn note(&mut self, last: Option<&TeamCommand>, command: &TeamCommand, period_s: f64) {
        let follows = core::mem::take(&mut self.silent_ticks) == 0;
        let last = last.filter(|_| follows);
        for (hand, step) in self.steps.iter_mut().enumerate() {
            let pose = |command: &TeamCommand| Pose::<World, Hand>::from_array(&command.hand_pose_ref[hand]);
            *step = match (last.and_then(pose), pose(command)) {
                (Some(from), Some(to)) => from.displacement_to(&to).to_array(),
                // What was led on is not where it was sent.
                _ => (Twist::<World>::from_array(&command.hand_twist_ref[hand]) * period_s).to_array(),
            };
        }
    }

    /// Leads `command` on by one tick of `period_s` seconds: hands go on by the steps δ by which they moved before,
    /// and after a while these and the twists V decay, (δ, V) ← (δ, V)·e^(−T/τ); the step clock goes on to the end of
    /// its walk. What can't be led on stays.
    pub(crate) fn lead_on(&mut self, command: &mut TeamCommand, timing: &StepTiming, period_s: f64) {
        if let Some(clock) = StepClock::from_words(command.step_clock) {
            command.step_clock = clock.extrapolated(timing, 1).to_words();
        }
        self.silent_ticks = self.silent_ticks.saturating_add(1);
        let goes_on = self.silent_ticks as f64 * period_s <= GO_ON_S;
        let share = if goes_on { 1.0 } else { (-period_s / REST_S).exp() };
        let hands = command.hand_pose_ref.iter_mut().zip(&mut command.hand_twist_ref);
        for ((pose, twist), step) in hands.zip(&mut self.steps) {
            let Some(X_WH) = Pose::<World, Hand>::from_array(pose) else { continue };
            *twist = (Twist::<World>::from_array(twist) * share).to_array();
            let moved = Twist::<World>::from_array(step) * share;
            *step = moved.to_array();
            *pose = X_WH.displaced(&moved).to_array();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_humanoid::balance::Side;

    const PERIOD_S: f64 = 0.005;

    fn walking() -> TeamCommand {
        let step =
            StepClock::Stepping { step_index: 3, tick_in_step: 70, swing: Side::Left, will_continue: true };
        let mut command = TeamCommand { step_clock: step.to_words(), ..TeamCommand::zeroed() };
        command.hand_pose_ref[0] = [0.3, 0.1, 0.8, 1.0, 0.0, 0.0, 0.0];
        command.hand_twist_ref[0] = [0.05, 0.0, -0.02, 0.0, 0.0, 0.1];
        command
    }

    /// The course of one who has heard this command, and the one of the tick before if hands moved by a step since.
    fn course(command: &TeamCommand, step_m: Option<[f64; 3]>) -> Course {
        let mut course = Course::zeroed();
        let mut last = *command;
        for (axis, step) in step_m.unwrap_or_default().into_iter().enumerate() {
            last.hand_pose_ref[0][axis] -= step;
        }
        course.note(step_m.map(|_| &last), command, PERIOD_S);
        course
    }

    #[test]
    fn a_team_that_hears_nothing_more_finishes_its_walk_and_its_hands_come_to_rest() {
        let timing = StepTiming::standard(PERIOD_S);
        let mut command = walking();
        let mut course = course(&command, None);
        for _ in 0..1000 {
            course.lead_on(&mut command, &timing, PERIOD_S);
        }
        assert_eq!(StepClock::from_words(command.step_clock), Some(StepClock::Standing));
        let [x, y, z, ..] = command.hand_pose_ref[0];
        // Four ticks, and the integral of a decaying velocity: V·τ, less half a tick.
        let coast = |velocity: f64| velocity * (GO_ON_S + REST_S - PERIOD_S / 2.0);
        let expected = [0.3 + coast(0.05), 0.1, 0.8 + coast(-0.02)];
        for (found, expected) in [x, y, z].into_iter().zip(expected) {
            assert!((found - expected).abs() < 2e-6, "{found} instead of {expected}");
        }
        assert!(command.hand_twist_ref[0].iter().all(|part| part.abs() < 1e-9));
    }

    #[test]
    fn for_a_moment_hands_move_on_as_they_did_and_not_only_as_the_object_does() {
        let timing = StepTiming::standard(PERIOD_S);
        let mut command = walking();
        let step_m = [2e-4, -1e-4, 3e-5];
        let mut course = course(&command, Some(step_m));
        for tick in 1..=4 {
            course.lead_on(&mut command, &timing, PERIOD_S);
            for (axis, start) in [0.3, 0.1, 0.8].into_iter().enumerate() {
                let expected = start + f64::from(tick) * step_m[axis];
                assert!((command.hand_pose_ref[0][axis] - expected).abs() < 1e-12);
            }
            assert_eq!(command.hand_twist_ref[0], walking().hand_twist_ref[0]);
        }
        course.lead_on(&mut command, &timing, PERIOD_S);
        assert!(command.hand_twist_ref[0][0] < 0.05, "it comes to rest");
        let Some(StepClock::Stepping { tick_in_step, will_continue, .. }) =
            StepClock::from_words(command.step_clock)
        else {
            panic!("it steps")
        };
        assert_eq!((tick_in_step, will_continue), (75, true));
    }

    #[test]
    fn what_was_led_on_tells_nothing_of_how_hands_move() {
        let mut command = walking();
        let mut course = course(&command, Some([2e-4, 0.0, 0.0]));
        course.lead_on(&mut command, &StepTiming::standard(PERIOD_S), PERIOD_S);
        let mut next = walking();
        next.hand_pose_ref[0][0] += 0.01;
        course.note(Some(&command), &next, PERIOD_S);
        assert!((course.steps[0][0] - 0.05 * PERIOD_S).abs() < 1e-12);
        assert_eq!(course.silent_ticks, 0);
    }

    #[test]
    fn hands_that_are_not_there_stay_so() {
        let mut command = walking();
        let mut course = course(&command, None);
        course.lead_on(&mut command, &StepTiming::standard(PERIOD_S), PERIOD_S);
        assert_eq!(command.hand_pose_ref[1], [0.0; 7]);
    }
}
