//! What a servo makes of silence: the last command, led on tick by tick.
//!
//! Robots that hear the same last command lead it on in the same way, so that a team without its coordinator
//! finishes its step and stands, all feet on the same ticks.

use mikoshi_humanoid::gait::{StepClock, StepTiming};
use mikoshi_ipc_types::TeamCommand;
use mikoshi_spatial::{Hand, Pose, Twist, World};

/// Time constant with which hands come to rest.
const REST_S: f64 = 0.1;

/// Leads `command` on by one tick of `period_s` seconds: hands move on with their twist V, which decays,
/// V ← V·e^(−T/τ); the step clock goes on to the end of its walk. What can't be led on stays.
pub(crate) fn lead_on(command: &mut TeamCommand, timing: &StepTiming, period_s: f64) {
    if let Some(clock) = StepClock::from_words(command.step_clock) {
        command.step_clock = clock.extrapolated(timing, 1).to_words();
    }
    let decay = (-period_s / REST_S).exp();
    for (pose, twist) in command.hand_pose_ref.iter_mut().zip(&mut command.hand_twist_ref) {
        let Some(X_WH) = Pose::<World, Hand>::from_array(pose) else { continue };
        let V_WH = Twist::<World>::from_array(twist);
        *pose = X_WH.displaced(&(V_WH * period_s)).to_array();
        *twist = (V_WH * decay).to_array();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
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

    #[test]
    fn a_team_that_hears_nothing_more_finishes_its_walk_and_its_hands_come_to_rest() {
        let timing = StepTiming::standard(PERIOD_S);
        let mut command = walking();
        for _ in 0..1000 {
            lead_on(&mut command, &timing, PERIOD_S);
        }
        assert_eq!(StepClock::from_words(command.step_clock), Some(StepClock::Standing));
        let [x, y, z, ..] = command.hand_pose_ref[0];
        // The integral of a decaying velocity: V·τ, and half a tick more.
        let coast = |velocity: f64| velocity * (REST_S + PERIOD_S / 2.0);
        let expected = [0.3 + coast(0.05), 0.1, 0.8 + coast(-0.02)];
        for (found, expected) in [x, y, z].into_iter().zip(expected) {
            assert!((found - expected).abs() < 2e-6, "{found} instead of {expected}");
        }
        assert!(command.hand_twist_ref[0].iter().all(|part| part.abs() < 1e-9));
    }

    #[test]
    fn for_a_moment_hands_move_on_as_if_nothing_had_happened() {
        let timing = StepTiming::standard(PERIOD_S);
        let mut command = walking();
        lead_on(&mut command, &timing, PERIOD_S);
        assert!((command.hand_pose_ref[0][0] - 0.3 - 0.05 * PERIOD_S).abs() < 1e-12);
        let Some(StepClock::Stepping { tick_in_step, will_continue, .. }) =
            StepClock::from_words(command.step_clock)
        else {
            panic!("it steps")
        };
        assert_eq!((tick_in_step, will_continue), (71, true));
    }

    #[test]
    fn hands_that_are_not_there_stay_so() {
        let mut command = walking();
        lead_on(&mut command, &StepTiming::standard(PERIOD_S), PERIOD_S);
        assert_eq!(command.hand_pose_ref[1], [0.0; 7]);
    }
}
