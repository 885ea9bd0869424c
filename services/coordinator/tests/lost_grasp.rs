//! Hands that lose the object, by the coordinator's tick: found, left out, and no other hand jumps.

#![allow(non_snake_case)]

mod common;
#[path = "common/team.rs"]
mod team;

use mikoshi_ipc_types::{mode, stop_cause};
use team::Team;

/// The law is at work, and the wrenches' filter has settled.
const STARTED: u64 = 200;

impl Team {
    fn started(overrides: &[(&str, &str)]) -> Self {
        let mut team = Self::holding(overrides);
        team.go_on(STARTED);
        assert_eq!(team.team_state().team_mode, mode::CARRY);
        team
    }

    /// Goes on until some hand is left out, and says after how many ticks.
    fn go_on_until_a_loss(&mut self, most: u64) -> Option<u64> {
        (0..most).find(|_| {
            let before = self.team_state().absent_hands;
            self.go_on(1);
            self.team_state().absent_hands != before
        })
    }

    /// Where the first hands are that still hold.
    fn is_in_every_grip(&self) -> bool {
        let mut holding = (0..self.hands.len()).filter(|hand| !self.lost.contains(hand));
        holding.all(|hand| {
            (self.X_WA * self.grips[hand]).displacement_to(&self.hands[hand]).linear.norm() < 1e-3
        })
    }
}

const CARRY_ON: (&str, &str) = ("safety.lost_grasp", "carry-on");

#[test]
fn a_hand_that_holds_nothing_is_found_though_its_gripper_says_it_holds_and_the_others_carry_on() {
    for lost in [0, 3, 6] {
        let mut team = Team::started(&[CARRY_ON]);
        team.lost.push(lost);
        let after = team.go_on_until_a_loss(400).expect("it is found");
        assert!(team.team_state().hand_slip[lost] < 1e-9, "who takes no part is not watched");
        assert_eq!(team.team_state().absent_hands, 1 << lost, "after {after} ticks");
        assert_eq!((team.team_state().loss_cause, team.team_state().stop_cause), (stop_cause::SLIP, 0));
        let closed = team.out.commands[lost / 2].closed_hands;
        assert_eq!(closed, 0b11 & !(1 << (lost % 2)), "it is told to open");
        team.go_on(2000);
        assert_eq!((team.team_state().team_mode, team.team_state().stop_cause), (mode::CARRY, 0));
        assert_eq!(team.team_state().absent_hands, 1 << lost, "nobody else is");
        assert!(team.is_in_every_grip());
        let rows = &team.team_state().generalized_force;
        assert!((rows[0][2] - 3.0 * 9.81).abs() < 0.01, "they bear it: {:?}", rows[0]);
        let internal = rows[1..8].iter().flatten().fold(0.0, |most: f64, part| most.max(part.abs()));
        assert!(internal < 0.05, "{internal}");
        assert_eq!(team.out.commands[lost / 2].hand_wrench_ref[lost % 2], [0.0; 6]);
    }
}

#[test]
fn no_hand_jumps_when_another_is_left_out() {
    let mut team = Team::started(&[CARRY_ON]);
    team.lost.push(3);
    let (mut before, mut last_step) = (team.references(), 0.0_f64);
    for tick in 0..400 {
        let absent = team.team_state().absent_hands;
        team.go_on(1);
        let now = team.references();
        let steps = now.iter().zip(&before).map(|(now, before)| {
            now.iter().zip(before).map(|(now, before)| (now - before).abs()).fold(0.0, f64::max)
        });
        let step = steps.fold(0.0, f64::max);
        if team.team_state().absent_hands != absent {
            assert!(step < last_step + 5e-6, "tick {tick}: {step} after {last_step}");
        }
        (before, last_step) = (now, step);
    }
    assert_eq!(team.team_state().absent_hands, 1 << 3);
}

#[test]
fn by_the_other_policy_the_team_stops_and_forms_anew_all_the_same() {
    let mut team = Team::started(&[]);
    team.lost.push(5);
    team.go_on_until_a_loss(400).expect("it is found");
    let state = team.team_state();
    assert_eq!((state.stop_cause, state.stop_robot, state.team_mode), (stop_cause::SLIP, 3, mode::SAFE_STOP));
    team.go_on(1000);
    assert!(team.is_in_every_grip(), "the law does not chase a force that is gone");
}

#[test]
fn a_gripper_that_says_it_is_open_is_believed_after_five_ticks() {
    let mut team = Team::started(&[CARRY_ON]);
    team.lost.push(2);
    team.said = 1 << 2;
    assert_eq!(team.go_on_until_a_loss(100), Some(5));
    assert_eq!(team.team_state().loss_cause, stop_cause::GRASP);
    // One wild reading is none.
    let mut team = Team::started(&[]);
    for tick in 0..100 {
        team.said = u64::from(tick % 5 != 0) << 2;
        team.go_on(1);
    }
    assert_eq!((team.team_state().absent_hands, team.team_state().stop_cause), (0, 0));
}

#[test]
fn robots_lose_both_hands_and_the_team_stops_when_one_robot_alone_is_left() {
    let mut team = Team::started(&[CARRY_ON]);
    for (robot, cause) in [(0, 0), (1, 0), (3, stop_cause::TOO_FEW_HANDS)] {
        for hand in [2 * robot, 2 * robot + 1] {
            team.lost.push(hand);
            team.said |= 1 << hand;
        }
        team.go_on(200);
        assert_eq!(team.team_state().stop_cause, cause, "robot {robot}");
        assert_eq!(team.team_state().absent_hands, team.said);
    }
    assert_eq!(team.team_state().stop_robot, 4);
}

#[test]
fn a_team_whose_internal_forces_are_no_tree_stops_and_controls_no_force_any_more() {
    let mut team = Team::started(&[("hybrid.internal_forces", "chain")]);
    team.lost.push(3);
    team.go_on(400);
    assert_eq!(team.team_state().stop_cause, stop_cause::SLIP);
    assert_eq!(team.team_state().absent_hands, 0);
    let before = team.references();
    team.go_on(100);
    assert_eq!(team.references(), before, "hands stay where they are");
}

#[test]
fn hands_that_wobble_in_the_sensors_are_not_taken_for_lost() {
    let mut team = Team::started(&[]);
    team.noise = 2e-3;
    team.go_on(4000);
    assert_eq!((team.team_state().absent_hands, team.team_state().stop_cause), (0, 0));
    team.lost.push(4);
    team.go_on_until_a_loss(400).expect("it is found all the same");
    assert_eq!(team.team_state().absent_hands, 1 << 4);
}

#[test]
fn nothing_that_survives_in_scratch_counts_when_a_team_forms_anew() {
    let run = |poisons| {
        let mut team = Team::started(&[CARRY_ON]);
        team.poisons = poisons;
        team.lost.push(1);
        team.go_on(400);
        assert_eq!(team.team_state().absent_hands, 0b10);
        (bytemuck::bytes_of(&team.state).to_vec(), team.references())
    };
    assert!(run(false) == run(true));
}
