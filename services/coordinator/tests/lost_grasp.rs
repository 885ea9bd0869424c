//! Hands that lose the object, by the coordinator's tick: found, left out, and no other hand jumps.

#![allow(non_snake_case)]

mod common;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use bytemuck::Zeroable;
use common::resolved;
use mikoshi_config::RunSpec;
use mikoshi_coordinator::{Coordinator, CoordinatorOutputs, CoordinatorScratch, CoordinatorState};
use mikoshi_ipc_types::{PoseWire, RobotState, TeamState, all_hands, mode, stop_cause};
use mikoshi_spatial::{Hand, Object, Pose, Twist, World, Wrench};
use nalgebra::{UnitQuaternion, Vector3};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

/// The law is at work, and the wrenches' filter has settled.
const STARTED: u64 = 200;
const STIFFNESS_N_M: f64 = 66e3;
const STIFFNESS_NM_RAD: f64 = 850.0;

/// Robots that follow their hands' references, with an object on springs between them; its mass is dealt out.
struct Team {
    run: RunSpec,
    coordinator: Coordinator,
    state: CoordinatorState,
    scratch: CoordinatorScratch,
    out: CoordinatorOutputs,
    tick: u64,
    X_WA: Pose<World, Object>,
    grips: Vec<Pose<Object, Hand>>,
    hands: Vec<Pose<World, Hand>>,
    /// Hands that hold nothing, and those whose grippers say so.
    lost: Vec<usize>,
    said: u64,
    /// Amplitude of what hands are seen off by, in m and rad, tick by tick.
    noise: f64,
    /// Overwrites scratch with NaN between ticks.
    poisons: bool,
}

impl Team {
    fn holding(overrides: &[(&str, &str)]) -> Self {
        let run = resolved("hold", &[overrides, &[("hybrid.start_s", "0.1")]].concat());
        let coordinator = Coordinator::new(&run).expect("a coordinator");
        let X_WA =
            Pose::<World, Object>::new(run.scenario.object.position_m.into(), UnitQuaternion::identity());
        let grips = run.robots.iter().flat_map(|robot| &robot.hand_in_object);
        let grips: Vec<_> =
            grips.map(|array| Pose::<Object, Hand>::from_array(array).expect("a pose")).collect();
        Self {
            state: coordinator.initial_state().expect("a state"),
            scratch: coordinator.scratch(),
            coordinator,
            out: CoordinatorOutputs::default(),
            tick: 0,
            X_WA,
            hands: grips.iter().map(|grip| X_WA * *grip).collect(),
            grips,
            lost: vec![],
            said: 0,
            noise: 0.0,
            poisons: false,
            run,
        }
    }

    fn started(overrides: &[(&str, &str)]) -> Self {
        let mut team = Self::holding(overrides);
        team.go_on(STARTED);
        assert_eq!(team.team_state().team_mode, mode::CARRY);
        team
    }

    fn team_state(&self) -> &TeamState {
        &self.out.team_state
    }

    fn wrench(&self, hand: usize) -> Wrench<World> {
        if self.lost.contains(&hand) {
            return Wrench::zero();
        }
        let stretch = (self.X_WA * self.grips[hand]).displacement_to(&self.hands[hand]);
        Wrench::new(stretch.linear * STIFFNESS_N_M, stretch.angular * STIFFNESS_NM_RAD)
    }

    /// The object goes a part of the way to where its hands' wrenches balance its weight.
    fn settle(&mut self) {
        for _ in 0..50 {
            let weight = Vector3::new(0.0, 0.0, -self.run.scenario.object.mass_kg * 9.81);
            let mut sum = Wrench::new(weight, Vector3::zeros());
            let mut turning = 0.0;
            for hand in (0..self.hands.len()).filter(|hand| !self.lost.contains(hand)) {
                let lever = self.hands[hand].translation - self.X_WA.translation;
                sum += self.wrench(hand).shifted(&lever);
                turning += STIFFNESS_N_M * lever.norm_squared() + STIFFNESS_NM_RAD;
            }
            let stiffness = STIFFNESS_N_M * (self.hands.len() - self.lost.len()) as f64;
            let step = Twist::new(sum.force / stiffness, sum.moment / turning);
            self.X_WA = self.X_WA.displaced(&step);
        }
    }

    fn robots(&self) -> Vec<RobotState> {
        let mut next = 0;
        let state = |robot: &mikoshi_config::RobotSpec| {
            let mut state = RobotState::zeroed();
            state.base_pose[3] = 1.0;
            (state.zmp_margin_m, state.speed_share) = (0.05, 1.0);
            state.holding_hands = all_hands(robot.grasping_hands.len());
            for hand in 0..robot.grasping_hands.len() {
                let wobble = self.noise * (1.7 * self.tick as f64 + next as f64).sin();
                let off = Twist::new(Vector3::repeat(0.3 * wobble), Vector3::repeat(wobble));
                state.hand_pose[hand] = self.hands[next].displaced(&off).to_array();
                state.hand_pose_commanded[hand] = self.hands[next].to_array();
                state.hand_wrench[hand] = self.wrench(next).to_array();
                if self.said >> next & 1 != 0 {
                    state.holding_hands &= !(1 << hand);
                }
                next += 1;
            }
            state
        };
        self.run.robots.iter().map(state).collect()
    }

    fn references(&self) -> Vec<PoseWire> {
        let robots = self.run.robots.iter().zip(&self.out.commands);
        robots
            .flat_map(|(robot, command)| command.hand_pose_ref[..robot.grasping_hands.len()].to_vec())
            .collect()
    }

    fn go_on(&mut self, ticks: u64) {
        for _ in 0..ticks {
            self.settle();
            let robots = self.robots();
            let Self { coordinator, state, scratch, out, .. } = self;
            if self.poisons {
                scratch.poison();
            }
            assert_no_alloc(|| coordinator.tick(self.tick, state, scratch, robots.iter(), out))
                .expect("commands");
            let references = self.references();
            for (hand, reference) in self.hands.iter_mut().zip(references) {
                *hand = Pose::from_array(&reference).expect("a pose");
            }
            self.tick += 1;
        }
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
