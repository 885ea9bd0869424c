//! A toy world: hands on springs at a rigid object without inertia.

#![allow(dead_code, reason = "each test binary uses its own part")]
#![allow(non_snake_case)]

use mikoshi_cooperation::{
    ForceGains, GeneralizedForce, GeneralizedPosition, HandInput, HandStiffness, HybridInputs, HybridLaw,
    HybridOutput, HybridParameters, HybridReference, HybridScratch, HybridState, InternalForces, Selection,
    TeamArms, VirtualStick,
};
use mikoshi_spatial::{Hand, Object, Pose, Twist, World, Wrench, exp, skew};
use nalgebra::{Matrix3, Matrix6, Vector3};
use std::collections::VecDeque;

pub const CAPACITY: usize = 32;
pub const PERIOD_S: f64 = 0.005;
pub const FILTER_HZ: f64 = 10.0;
pub const STIFFNESS: HandStiffness = HandStiffness { n_m: 1000.0, nm_rad: 300.0 };

/// Where n hands nominally hold the object: around it, each turned its own way.
pub fn nominal_grasp(arms: usize) -> Vec<Pose<Object, Hand>> {
    (0..arms)
        .map(|i| {
            let angle = 2.0 * std::f64::consts::PI * i as f64 / arms as f64;
            let position = Vector3::new(0.3 * angle.cos(), 0.6 * angle.sin(), 0.05 * (i % 3) as f64);
            Pose::new(position, exp(&Vector3::new(0.4, -0.2 * i as f64, angle)))
        })
        .collect()
}

/// Deterministic numbers in [−1, 1].
pub fn pseudo_random() -> impl FnMut() -> f64 {
    let mut x = 0x9e37_79b9_7f4a_7c15_u64;
    move || {
        x = x.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (x >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

pub fn random_vector(random: &mut impl FnMut() -> f64, size: f64) -> Vector3<f64> {
    Vector3::new(random(), random(), random()) * size
}

pub fn team(arms_per_robot: &[usize]) -> TeamArms {
    TeamArms::numbered(arms_per_robot).unwrap()
}

pub fn parameters(internal_forces: &InternalForces) -> HybridParameters {
    HybridParameters {
        period_s: PERIOD_S,
        kz: 0.05,
        kh: ForceGains { m_n: 1e-3, rad_nm: 3e-3 },
        selection: Selection::object_position_internal_force(internal_forces.arms()),
        filter_hz: FILTER_HZ,
        lead_limit_m: 0.1,
        lead_limit_rad: 0.2,
        approach_limit_m_s: 1.0,
        approach_limit_rad_s: 1.0,
    }
}

/// The world, and a law that controls it.
pub struct ClosedLoop {
    pub law: HybridLaw,
    pub state: HybridState<CAPACITY>,
    pub scratch: HybridScratch,
    pub out: HybridOutput,
    pub X_WA: Pose<World, Object>,
    /// Where each hand really holds the object.
    pub grasp: Vec<Pose<Object, Hand>>,
    /// Poses on their way to the hands; the front is where the hands are.
    pub hands: VecDeque<Vec<Pose<World, Hand>>>,
    pub force_ref: GeneralizedForce,
    pub position_ref: GeneralizedPosition,
    pub twist_ref: Twist<World>,
    /// Nothing moves the object, as if a wall held it on all sides.
    pub is_object_fixed: bool,
    /// Hands that don't hold it any more.
    pub lost: Vec<usize>,
}

impl ClosedLoop {
    /// Hands miss their nominal grasp by up to `offset_m` and twice as many radians;
    /// references reach them `delay_ticks` later than at once.
    pub fn new(law: HybridLaw, offset_m: f64, delay_ticks: usize) -> Self {
        let n = law.arms();
        let X_WA = Pose::new(Vector3::new(1.0, -2.0, 0.96), exp(&Vector3::new(0.0, 0.0, 0.4)));
        let nominal = nominal_grasp(n);
        let sticks: Vec<_> = nominal.iter().map(VirtualStick::from_hand_in_object).collect();
        let mut random = pseudo_random();
        let grasp = nominal
            .iter()
            .map(|X_AH| {
                let offset = Twist::new(
                    random_vector(&mut random, offset_m),
                    random_vector(&mut random, 2.0 * offset_m),
                );
                X_AH.displaced(&offset)
            })
            .collect();
        let hands: Vec<_> = nominal.iter().map(|X_AH| X_WA * *X_AH).collect();
        let (state, scratch, out) = (HybridState::at_grasp(&sticks).unwrap(), law.scratch(), law.output());
        let mut closed_loop = Self {
            law,
            state,
            scratch,
            out,
            X_WA,
            grasp,
            hands: VecDeque::from(vec![hands; delay_ticks + 1]),
            force_ref: GeneralizedForce::zero(n),
            position_ref: GeneralizedPosition::at_grasp(X_WA, n),
            twist_ref: Twist::zero(),
            is_object_fixed: false,
            lost: vec![],
        };
        closed_loop.settle();
        closed_loop
    }

    /// The wrench that each hand applies to the object at its own origin.
    pub fn hand_wrenches(&self) -> Vec<Wrench<World>> {
        let hands = self.hands.front().unwrap();
        let wrench = |(X_AG, X_WH): (&Pose<Object, Hand>, &Pose<World, Hand>)| {
            let X_WG = self.X_WA * *X_AG;
            let stretch = X_WG.displacement_to(X_WH);
            Wrench::new(stretch.linear * STIFFNESS.n_m, stretch.angular * STIFFNESS.nm_rad)
                .shifted(&(X_WG.translation - X_WH.translation))
        };
        let mut wrenches: Vec<_> = self.grasp.iter().zip(hands).map(wrench).collect();
        for &hand in &self.lost {
            wrenches[hand] = Wrench::zero();
        }
        wrenches
    }

    /// A hand lets go.
    pub fn lose(&mut self, hand: usize) {
        self.lost.push(hand);
        self.settle();
    }

    /// The object moves to where all wrenches balance: Newton's method with the stiffness of its first step.
    fn settle(&mut self) {
        if self.is_object_fixed {
            return;
        }
        let mut stiffness = Matrix6::zeros();
        for X_WH in self.hands.front().unwrap() {
            let lever = skew(&(X_WH.translation - self.X_WA.translation)) * STIFFNESS.n_m;
            let mut of_hand = Matrix6::from_diagonal_element(STIFFNESS.n_m);
            of_hand.fixed_view_mut::<3, 3>(0, 3).copy_from(&-lever);
            of_hand.fixed_view_mut::<3, 3>(3, 0).copy_from(&lever);
            let rotational = Matrix3::identity() * STIFFNESS.nm_rad - lever * lever / STIFFNESS.n_m;
            of_hand.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotational);
            stiffness += of_hand;
        }
        let compliance = stiffness.try_inverse().unwrap();
        for _ in 0..20 {
            let mut residual = Wrench::zero();
            for (f_H, X_WH) in self.hand_wrenches().iter().zip(self.hands.front().unwrap()) {
                residual += f_H.shifted(&(X_WH.translation - self.X_WA.translation));
            }
            let step = compliance * residual.to_vector();
            self.X_WA = self.X_WA.displaced(&Twist::from_vector(&step));
            if step.norm() < 1e-10 {
                break;
            }
        }
    }

    pub fn hand_inputs(&self) -> Vec<HandInput> {
        let commanded = self.hands.back().unwrap();
        let wrenches = self.hand_wrenches();
        let hands = self.hands.front().unwrap().iter().zip(commanded).zip(wrenches);
        hands
            .map(|((pose, pose_commanded), wrench)| HandInput {
                pose: *pose,
                pose_commanded: *pose_commanded,
                wrench,
            })
            .collect()
    }

    /// One tick. Without control the hands hold.
    pub fn tick(&mut self, is_controlled: bool) {
        let hands = self.hand_inputs();
        let reference = is_controlled.then_some(HybridReference {
            force: &self.force_ref,
            position: &self.position_ref,
            object_twist: self.twist_ref,
        });
        let inputs = HybridInputs { hands: &hands, grasp_yield: Twist::zero(), reference };
        self.law.act(&mut self.state, &mut self.scratch, &inputs, &mut self.out).unwrap();
        self.hands.pop_front();
        self.hands.push_back(self.out.hands.iter().map(|hand| hand.pose).collect());
        self.settle();
    }

    /// Ticks with a reference that moves at `twist_ref`.
    pub fn run(&mut self, ticks: usize) {
        for _ in 0..ticks {
            self.tick(true);
            self.position_ref.external = self.position_ref.external.displaced(&(self.twist_ref * PERIOD_S));
        }
    }

    /// Largest internal force \[N\] and moment \[Nm\], as the law sees them.
    pub fn largest_internal(&self) -> (f64, f64) {
        self.out.force.internal.iter().fold((0.0, 0.0), |(force, moment), wrench| {
            (f64::max(force, wrench.force.norm()), f64::max(moment, wrench.moment.norm()))
        })
    }
}
