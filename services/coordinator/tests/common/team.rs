//! A team without legs, for tests of the coordinator's tick.

use crate::common::resolved;
use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use bytemuck::Zeroable;
use mikoshi_config::RunSpec;
use mikoshi_coordinator::{Coordinator, CoordinatorOutputs, CoordinatorScratch, CoordinatorState};
use mikoshi_ipc_types::{PoseWire, RobotState, TeamState, all_hands, flag};
use mikoshi_spatial::{Hand, Object, Pose, Twist, World, Wrench};
use nalgebra::{UnitQuaternion, Vector3};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

const STIFFNESS_N_M: f64 = 66e3;
const STIFFNESS_NM_RAD: f64 = 850.0;

/// Robots that follow their hands' references, with an object on springs between them; its mass is dealt out.
pub struct Team {
    pub run: RunSpec,
    pub coordinator: Coordinator,
    pub state: CoordinatorState,
    pub scratch: CoordinatorScratch,
    pub out: CoordinatorOutputs,
    pub tick: u64,
    pub X_WA: Pose<World, Object>,
    pub grips: Vec<Pose<Object, Hand>>,
    pub hands: Vec<Pose<World, Hand>>,
    /// Hands that hold nothing, and those whose grippers say so.
    pub lost: Vec<usize>,
    pub said: u64,
    /// Amplitude of what hands are seen off by, in m and rad, tick by tick.
    pub noise: f64,
    /// Overwrites scratch with NaN between ticks.
    pub poisons: bool,
    /// Grippers do what they are told: they open, and take hold where they are.
    pub obeys: bool,
}

impl Team {
    pub fn holding(overrides: &[(&str, &str)]) -> Self {
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
            obeys: false,
            run,
        }
    }

    pub fn team_state(&self) -> &TeamState {
        &self.out.team_state
    }

    pub fn wrench(&self, hand: usize) -> Wrench<World> {
        if self.lost.contains(&hand) {
            return Wrench::zero();
        }
        let stretch = (self.X_WA * self.grips[hand]).displacement_to(&self.hands[hand]);
        Wrench::new(stretch.linear * STIFFNESS_N_M, stretch.angular * STIFFNESS_NM_RAD)
    }

    /// The object goes a part of the way to where its hands' wrenches balance its weight.
    pub fn settle(&mut self) {
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

    pub fn robots(&self) -> Vec<RobotState> {
        let mut next = 0;
        let state = |robot: &mikoshi_config::RobotSpec| {
            let mut state = RobotState::zeroed();
            state.base_pose[3] = 1.0;
            (state.zmp_margin_m, state.speed_share) = (0.05, 1.0);
            state.flags = flag::READY_TO_STEP | flag::CAN_STOP;
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

    pub fn references(&self) -> Vec<PoseWire> {
        let robots = self.run.robots.iter().zip(&self.out.commands);
        robots
            .flat_map(|(robot, command)| command.hand_pose_ref[..robot.grasping_hands.len()].to_vec())
            .collect()
    }

    pub fn go_on(&mut self, ticks: u64) {
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
            if self.obeys {
                self.open_and_close();
            }
            self.tick += 1;
        }
    }

    fn open_and_close(&mut self) {
        let robots = self.run.robots.iter().zip(&self.out.commands);
        let told = robots.flat_map(|(robot, command)| {
            (0..robot.grasping_hands.len()).map(|hand| command.closed_hands >> hand & 1 != 0)
        });
        for (hand, shall_hold) in told.enumerate() {
            let holds = !self.lost.contains(&hand);
            if holds && !shall_hold {
                self.lost.push(hand);
                self.said |= 1 << hand;
            } else if !holds && shall_hold {
                self.grips[hand] = self.X_WA.inverse() * self.hands[hand];
                self.lost.retain(|lost| *lost != hand);
                self.said &= !(1 << hand);
            }
        }
    }
}
