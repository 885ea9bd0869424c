//! Robots that leave and join, by the coordinator's tick: nothing jumps, nobody is dropped, and who can't goes back.

#![allow(non_snake_case)]

mod common;
#[path = "common/team.rs"]
mod team;

use mikoshi_ipc_types::{member_fault, member_stage as stage, mode, stop_cause};
use mikoshi_spatial::{Object, Pose, World};
use team::Team;

/// B leaves in tick 400 and joins in tick 4000.
const LEAVES: (&str, &str) =
    ("membership", r#"[{robot = "B", leave_s = 2.0, join_s = 20.0, speed_m_s = 0.15}]"#);
/// It joins alone, in tick 400.
const JOINS: (&str, &str) = ("membership", r#"[{robot = "B", join_s = 2.0, speed_m_s = 0.15}]"#);
const B: usize = 1;
const HANDS_OF_B: u64 = 0b1100;
/// As fast as a robot walks off, and its palms are drawn back, in a tick.
const LARGEST_STEP_M: f64 = (0.15 + 0.03) * 0.005;

impl Team {
    fn obedient(overrides: &[(&str, &str)]) -> Self {
        let mut team = Self::holding(overrides);
        team.obeys = true;
        team
    }

    fn stage_of_b(&self) -> u64 {
        self.team_state().member_stage[B]
    }

    /// The stages that B goes through, with the tick in which each began.
    fn stages_until(&mut self, last: u64) -> Vec<(u64, u64)> {
        let mut stages = vec![];
        while self.tick < last {
            self.go_on(1);
            if stages.last().is_none_or(|(stage, _)| *stage != self.stage_of_b()) {
                stages.push((self.stage_of_b(), self.tick - 1));
            }
        }
        stages
    }

    /// Where the object is taken for, and where the hands that hold it have it.
    fn object_is_off_m(&self) -> f64 {
        let seen = Pose::<World, Object>::from_array(&self.team_state().object_pose).expect("a pose");
        seen.displacement_to(&self.X_WA).linear.norm()
    }
}

#[test]
fn a_robot_leaves_and_joins_stage_by_stage_and_all_bear_the_object_again() {
    let mut team = Team::obedient(&[LEAVES]);
    let stages: Vec<_> = team.stages_until(8000).into_iter().map(|(stage, _)| stage).collect();
    let all = [
        stage::MEMBER,
        stage::HALTING,
        stage::UNBURDENING,
        stage::OPENING,
        stage::WITHDRAWING,
        stage::LEAVING,
        stage::AWAY,
        stage::RETURNING,
        stage::APPROACHING,
        stage::REACHING,
        stage::CLOSING,
        stage::JOINING,
        stage::MEMBER,
    ];
    assert_eq!(stages, all);
    let state = team.team_state();
    assert_eq!((state.absent_hands, state.away_hands, state.stop_cause), (0, 0, 0));
    assert_eq!(state.member_fault[B], 0);
    let borne: f64 = (0..8).map(|hand| team.wrench(hand).force.z).sum();
    assert!((borne - 3.0 * 9.81).abs() < 0.05, "{borne}");
    let of_b = team.wrench(2).force.z + team.wrench(3).force.z;
    assert!((of_b - borne / 4.0).abs() < 0.5, "{of_b} of {borne}");
}

#[test]
fn no_reference_and_no_estimate_jumps_and_hands_open_and_close_without_force() {
    for mass_kg in ["3", "10"] {
        let mut team = Team::obedient(&[LEAVES, ("object.mass_kg", mass_kg)]);
        team.go_on(300);
        let (mut references, mut object) = (team.references(), team.X_WA);
        while team.tick < 8000 {
            let stage = team.stage_of_b();
            let before = team.wrench(2).force.norm().max(team.wrench(3).force.norm());
            team.go_on(1);
            let now = team.references();
            for (hand, (now, before)) in now.iter().zip(&references).enumerate() {
                let step = (0..3).map(|axis| (now[axis] - before[axis]).powi(2)).sum::<f64>().sqrt();
                let most = if HANDS_OF_B >> hand & 1 != 0 { LARGEST_STEP_M } else { 5e-5 };
                assert!(step < most, "{mass_kg} kg, tick {}, hand {hand}: {step}", team.tick);
            }
            let moved = object.displacement_to(&team.X_WA).linear.norm();
            assert!(moved < 5e-5, "{mass_kg} kg, tick {}: {moved}", team.tick);
            assert!(team.object_is_off_m() < 5e-4, "tick {}: {}", team.tick, team.object_is_off_m());
            if (stage, team.stage_of_b()) == (stage::UNBURDENING, stage::OPENING) {
                assert!(before < 1.5, "{mass_kg} kg: {before} N in a hand that opens");
            }
            if (stage, team.stage_of_b()) == (stage::CLOSING, stage::JOINING) {
                let after = team.wrench(2).force.norm().max(team.wrench(3).force.norm());
                assert!(after < 1.5, "{mass_kg} kg: {after} N in a hand that has closed");
            }
            (references, object) = (now, team.X_WA);
        }
        assert_eq!(team.stage_of_b(), stage::MEMBER);
    }
}

#[test]
fn a_robot_that_joins_alone_begins_away_and_the_others_carry_without_it() {
    let mut team = Team::obedient(&[JOINS]);
    for hand in [2, 3] {
        team.lost.push(hand);
        team.said |= 1 << hand;
        team.hands[hand].translation.x -= 0.5;
    }
    team.go_on(100);
    let state = team.team_state();
    assert_eq!(
        (state.absent_hands, state.away_hands, state.team_mode),
        (HANDS_OF_B, HANDS_OF_B, mode::CARRY)
    );
    assert_eq!(team.stage_of_b(), stage::AWAY);
    let stages: Vec<_> = team.stages_until(5000).into_iter().map(|(stage, _)| stage).collect();
    assert_eq!(stages.last(), Some(&stage::MEMBER), "{stages:?}");
    assert_eq!(team.team_state().absent_hands, 0);
    assert!((team.wrench(2).force.z - 3.0 * 9.81 / 8.0).abs() < 0.5, "{:?}", team.wrench(2));
}

#[test]
fn a_hand_that_does_not_open_stops_the_team() {
    let mut team = Team::obedient(&[LEAVES]);
    while team.stage_of_b() != stage::OPENING {
        team.go_on(1);
    }
    // From now on grippers do nothing.
    team.obeys = false;
    team.lost.clear();
    team.said = 0;
    team.go_on(500);
    let state = team.team_state();
    assert_eq!((state.stop_cause, state.stop_robot), (stop_cause::GRASP, B as u64 + 1));
    assert_eq!(state.member_fault[B], member_fault::HOLDING);
}

#[test]
fn a_robot_whose_hands_do_not_close_goes_back_and_stands_aside() {
    let mut team = Team::obedient(&[LEAVES]);
    while team.stage_of_b() != stage::REACHING {
        team.go_on(1);
    }
    team.obeys = false;
    let until = team.tick + 6000;
    let stages: Vec<_> = team.stages_until(until).into_iter().map(|(stage, _)| stage).collect();
    let back = [stage::REACHING, stage::CLOSING, stage::WITHDRAWING, stage::LEAVING, stage::AWAY];
    assert_eq!(stages, back);
    assert_eq!(team.team_state().member_fault[B], member_fault::NOT_HOLDING);
    assert_eq!((team.team_state().stop_cause, team.team_state().team_mode), (0, mode::CARRY));
}

#[test]
fn who_is_needed_does_not_leave() {
    let leave = ("membership", r#"[{robot = "B", leave_s = 2.0}]"#);
    // Of three robots one has lost the object before.
    let three = ("team", "three");
    let mut team = Team::holding(&[three, leave, ("safety.lost_grasp", "carry-on")]);
    team.go_on(100);
    for hand in [4, 5] {
        team.lost.push(hand);
        team.said |= 1 << hand;
    }
    team.go_on(700);
    assert_eq!((team.stage_of_b(), team.team_state().member_fault[B]), (stage::MEMBER, member_fault::NEEDED));
    assert_eq!(team.team_state().stop_cause, 0);
}

#[test]
fn nothing_that_survives_in_scratch_counts_when_a_robot_leaves_and_joins() {
    let run = |poisons| {
        let mut team = Team::obedient(&[LEAVES]);
        team.poisons = poisons;
        team.go_on(7500);
        assert_eq!(team.stage_of_b(), stage::MEMBER);
        (bytemuck::bytes_of(&team.state).to_vec(), team.references())
    };
    assert!(run(false) == run(true));
}
