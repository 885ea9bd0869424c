//! Virtual sticks, the generalized vectors, and joint torques.

#![allow(non_snake_case)]

mod common;

use common::{pseudo_random, random_vector, team};
use core::f64::consts::FRAC_PI_2;
use mikoshi_cooperation::{
    GeneralizedForce, GeneralizedPosition, GeneralizedVelocity, InternalForces, VirtualStick,
    WorkspaceScratch, generalized_velocity, joint_torques, tip_wrenches,
};
use mikoshi_spatial::{Hand, Object, Pose, Tip, Twist, World, Wrench, exp, log};
use nalgebra::{DMatrix, Matrix6xX, Vector3, Vector6};

fn random_pose(random: &mut impl FnMut() -> f64) -> Pose<World, Hand> {
    Pose::new(random_vector(random, 2.0), exp(&random_vector(random, 1.7)))
}

fn random_wrench(random: &mut impl FnMut() -> f64) -> Wrench<World> {
    Wrench::new(random_vector(random, 50.0), random_vector(random, 10.0))
}

fn random_twist(random: &mut impl FnMut() -> f64, size: f64) -> Twist<World> {
    Twist::new(random_vector(random, size), random_vector(random, size))
}

/// A team of 2, 1 and 3 arms that holds an object, tips apart by up to `spread`.
struct Grasp {
    internal_forces: InternalForces,
    X_WA: Pose<World, Object>,
    sticks: Vec<VirtualStick>,
    hands: Vec<Pose<World, Hand>>,
    wrenches: Vec<Wrench<World>>,
}

impl Grasp {
    fn new(X_WA: Pose<World, Object>, spread: f64) -> Self {
        let mut random = pseudo_random();
        let internal_forces = InternalForces::balanced_tree(&team(&[2, 1, 3]));
        let n = internal_forces.arms();
        let at_grasp: Vec<_> = (0..n).map(|_| random_pose(&mut random)).collect();
        let sticks: Vec<_> = at_grasp.iter().map(|X_WH| VirtualStick::at_grasp(X_WH, &X_WA)).collect();
        let hands: Vec<_> = at_grasp
            .iter()
            .zip(&sticks)
            .map(|(X_WH, stick)| {
                let tip = random_twist(&mut random, spread);
                X_WH.displaced(&stick.hand_displacement(X_WH, &tip))
            })
            .collect();
        let wrenches = (0..n).map(|_| random_wrench(&mut random)).collect();
        Self { internal_forces, X_WA, sticks, hands, wrenches }
    }

    fn tips(&self) -> Vec<Pose<World, Tip>> {
        self.sticks.iter().zip(&self.hands).map(|(stick, X_WH)| stick.tip_pose(X_WH)).collect()
    }

    fn tip_wrenches(&self) -> Vec<Wrench<World>> {
        let hands = self.sticks.iter().zip(&self.hands).zip(&self.wrenches);
        hands.map(|((stick, X_WH), f_H)| stick.tip_wrench(X_WH, f_H)).collect()
    }

    fn evaluate(&self) -> (GeneralizedForce, GeneralizedPosition) {
        let n = self.internal_forces.arms();
        let mut h = GeneralizedForce::zero(n);
        let mut z = GeneralizedPosition::at_grasp(Pose::identity(), n);
        let mut scratch = WorkspaceScratch::new(&self.internal_forces);
        scratch.poison();
        let hands = self.sticks.iter().zip(&self.hands).zip(&self.wrenches);
        let hands = hands.map(|((stick, X_WH), f_H)| (*stick, *X_WH, *f_H));
        scratch.evaluate(&self.internal_forces.of_all(), hands, &mut h, &mut z);
        (h, z)
    }
}

fn somewhere() -> Pose<World, Object> {
    Pose::new(Vector3::new(3.0, -1.0, 0.9), exp(&Vector3::new(0.5, -0.4, 2.9)))
}

fn rows_of(matrix: &DMatrix<f64>, of_arms: &[Vector6<f64>]) -> Vec<Vector6<f64>> {
    let row = |row: usize| of_arms.iter().enumerate().map(|(arm, v)| v * matrix[(row, arm)]).sum();
    (0..matrix.nrows()).map(row).collect()
}

#[test]
fn tips_coincide_with_the_object_at_the_grasp() {
    let mut random = pseudo_random();
    let X_WA = somewhere();
    for _ in 0..20 {
        let X_WH = random_pose(&mut random);
        let stick = VirtualStick::at_grasp(&X_WH, &X_WA);
        let apart = X_WA.displacement_to(&stick.tip_pose(&X_WH).relabel());
        assert!(apart.to_vector().norm() < 1e-14);
        let from_object = VirtualStick::from_hand_in_object(&(X_WA.inverse() * X_WH));
        assert_eq!(from_object, stick);
        let l = X_WA.translation - X_WH.translation;
        assert!((stick.vector(&X_WH) - l).norm() < 1e-14);
    }
}

/// Eq. A1 as the paper prints it, `n_b = n_h − l × f_h`.
#[test]
fn tip_wrench_is_eq_a1() {
    let mut random = pseudo_random();
    for _ in 0..20 {
        let (X_WH, f_H) = (random_pose(&mut random), random_wrench(&mut random));
        let stick = VirtualStick::at_grasp(&X_WH, &somewhere());
        let f_B = stick.tip_wrench(&X_WH, &f_H);
        let l = somewhere().translation - X_WH.translation;
        assert_eq!(f_B.force, f_H.force);
        assert!((f_B.moment - (f_H.moment - l.cross(&f_H.force))).norm() < 1e-12);
        let back = stick.hand_wrench(&X_WH, &f_B);
        assert!((back - f_H).to_vector().norm() < 1e-12);
    }
}

#[test]
fn a_hand_and_its_tip_do_the_same_work() {
    let mut random = pseudo_random();
    for _ in 0..20 {
        let (X_WH, f_H) = (random_pose(&mut random), random_wrench(&mut random));
        let stick = VirtualStick::at_grasp(&X_WH, &somewhere());
        let tip = random_twist(&mut random, 1.0);
        let hand = stick.hand_displacement(&X_WH, &tip);
        let difference = stick.tip_wrench(&X_WH, &f_H).power(&tip) - f_H.power(&hand);
        assert!(difference.abs() < 1e-11);
    }
}

#[test]
fn a_small_hand_displacement_displaces_the_tip_as_asked() {
    let mut random = pseudo_random();
    for _ in 0..20 {
        let X_WH = random_pose(&mut random);
        let stick = VirtualStick::at_grasp(&X_WH, &somewhere());
        let tip = random_twist(&mut random, 1e-5);
        let moved = X_WH.displaced(&stick.hand_displacement(&X_WH, &tip));
        let found = stick.tip_pose(&X_WH).displacement_to(&stick.tip_pose(&moved));
        assert!((found - tip).to_vector().norm() < 1e-9);
    }
}

/// Eqs. 11 and 28 by the matrices.
#[test]
fn h_is_w_and_c_times_the_tip_wrenches_with_internal_rows_in_object_axes() {
    let grasp = Grasp::new(somewhere(), 0.02);
    let (h, z) = grasp.evaluate();
    let tips: Vec<_> = grasp.tip_wrenches().iter().map(Wrench::to_vector).collect();
    let rows = rows_of(&grasp.internal_forces.w_and_c(), &tips);
    assert!((h.external.to_vector() - rows[0]).norm() < 1e-11);
    for (internal, row) in h.internal.iter().zip(&rows[1..]) {
        let in_object = Wrench::<World>::from_vector(row).expressed_in(&z.external.inverse());
        assert!((*internal - in_object).to_vector().norm() < 1e-11);
    }
}

/// Eqs. 27 and 29 by the matrices, with rotation vectors about the mean attitude.
#[test]
fn z_is_u_transposed_times_the_tip_positions_with_internal_rows_in_object_axes() {
    for spread in [0.0, 1e-3, 0.05, 0.3] {
        let grasp = Grasp::new(somewhere(), spread);
        let (_, z) = grasp.evaluate();
        let mean = &z.external;
        let from_mean = |X_WB: Pose<World, Tip>| mean.displacement_to(&X_WB.relabel()).to_vector();
        let tips: Vec<_> = grasp.tips().into_iter().map(from_mean).collect();
        let rows = rows_of(&grasp.internal_forces.u().transpose(), &tips);
        assert!(rows[0].norm() < 1e-12, "the tips' mean is the object: {}", rows[0]);
        for (internal, row) in z.internal.iter().zip(&rows[1..]) {
            let in_object = Twist::<World>::from_vector(row).expressed_in(&mean.inverse());
            assert!((*internal - in_object).to_vector().norm() < 1e-12);
        }
    }
}

#[test]
fn at_the_grasp_z_is_the_object_and_zero() {
    let (_, z) = Grasp::new(somewhere(), 0.0).evaluate();
    assert!(somewhere().displacement_to(&z.external).to_vector().norm() < 1e-13);
    assert!(z.internal.iter().all(|row| row.to_vector().norm() < 1e-13));
}

/// Where Euler angles would jump or be singular: heading near ±180°, pitch 90°.
#[test]
fn h_and_z_turn_with_the_team_wherever_it_faces() {
    let reference = Grasp::new(somewhere(), 0.05);
    let (h, z) = reference.evaluate();
    for turn in
        [Vector3::z() * 0.2416, Vector3::z() * 3.1, Vector3::y() * FRAC_PI_2, Vector3::new(2.0, 1.0, -2.0)]
    {
        let turn = Pose::<World, World>::new(Vector3::new(0.3, 0.2, 0.1), exp(&turn));
        let mut turned = Grasp::new(somewhere(), 0.05);
        turned.X_WA = turn * turned.X_WA;
        for (hand, wrench) in turned.hands.iter_mut().zip(&mut turned.wrenches) {
            *hand = turn * *hand;
            *wrench = wrench.expressed_in(&turn);
        }
        let (h_turned, z_turned) = turned.evaluate();
        let apart = (turn * z.external).displacement_to(&z_turned.external);
        assert!(apart.to_vector().norm() < 1e-12, "{apart:?}");
        for (a, b) in z.internal.iter().zip(&z_turned.internal) {
            assert!((*a - *b).to_vector().norm() < 1e-12);
        }
        for (a, b) in h.internal.iter().zip(&h_turned.internal) {
            assert!((*a - *b).to_vector().norm() < 1e-10);
        }
    }
}

#[test]
fn the_mean_of_two_attitudes_is_half_way_between_them() {
    let internal_forces = InternalForces::balanced_tree(&team(&[2]));
    let stick = VirtualStick { X_HB: Pose::identity() };
    let (first, apart) = (exp(&Vector3::new(1.0, 2.0, -0.5)), Vector3::new(0.2, -1.0, 0.7));
    let hands = [Pose::new(Vector3::zeros(), first), Pose::new(Vector3::x(), exp(&apart) * first)];
    let mut h = GeneralizedForce::zero(2);
    let mut z = GeneralizedPosition::at_grasp(Pose::identity(), 2);
    let each = hands.iter().map(|X_WH| (stick, *X_WH, Wrench::zero()));
    WorkspaceScratch::new(&internal_forces).evaluate(&internal_forces.of_all(), each, &mut h, &mut z);
    let half_way = exp(&(apart * 0.5)) * first;
    assert!(log(&(z.external.rotation * half_way.inverse())).norm() < 1e-13);
    assert!((z.external.translation - Vector3::x() * 0.5).norm() < 1e-15);
}

/// Eqs. 30 and 31: u is the rate of z, tips being close.
#[test]
fn u_is_the_rate_of_z() {
    let mut random = pseudo_random();
    let grasp = Grasp::new(somewhere(), 1e-4);
    let n = grasp.internal_forces.arms();
    let rates: Vec<_> = (0..n).map(|_| random_twist(&mut random, 1.0)).collect();
    let (_, z) = grasp.evaluate();
    let mut u = GeneralizedVelocity::zero(n);
    let mut scratch = WorkspaceScratch::new(&grasp.internal_forces);
    generalized_velocity(&grasp.internal_forces, &z.external, &rates, &mut u, &mut scratch);

    let dt = 1e-5;
    let z_at = |sign: f64| {
        let mut moved = Grasp::new(somewhere(), 1e-4);
        for ((X_WH, stick), rate) in moved.hands.iter_mut().zip(&moved.sticks).zip(&rates) {
            *X_WH = X_WH.displaced(&stick.hand_displacement(X_WH, &(*rate * (0.5 * sign * dt))));
        }
        moved.evaluate().1
    };
    let (before, after) = (z_at(-1.0), z_at(1.0));
    let external = before.external.displacement_to(&after.external) * (1.0 / dt);
    assert!((external - u.external).to_vector().norm() < 1e-3, "{external:?} {:?}", u.external);
    for ((before, after), u) in before.internal.iter().zip(&after.internal).zip(&u.internal) {
        let rate = (*after - *before) * (1.0 / dt);
        assert!((rate - *u).to_vector().norm() < 1e-3, "{rate:?} {u:?}");
    }
}

#[test]
fn tip_wrenches_of_h_are_those_that_made_it() {
    let grasp = Grasp::new(somewhere(), 0.02);
    let (h, z) = grasp.evaluate();
    for (found, tip) in tip_wrenches(&grasp.internal_forces, &h, &z.external).iter().zip(grasp.tip_wrenches())
    {
        assert!((*found - tip).to_vector().norm() < 1e-11);
    }
}

/// Eq. 33 by the principle of virtual work: Λ · Θ̇ = h · u for any Θ̇, with u = J Θ̇ (eq. 32).
#[test]
fn joint_torques_do_the_work_of_the_generalized_force() {
    let mut random = pseudo_random();
    let grasp = Grasp::new(somewhere(), 0.0);
    let n = grasp.internal_forces.arms();
    let (h, z) = grasp.evaluate();
    let tips = tip_wrenches(&grasp.internal_forces, &h, &z.external);
    let (mut power_of_joints, mut tip_twists) = (0.0, Vec::new());
    for ((f_B, stick), X_WH) in tips.iter().zip(&grasp.sticks).zip(&grasp.hands) {
        let jacobian = Matrix6xX::from_fn(7, |_, _| random());
        let joint_rates: Vec<f64> = (0..7).map(|_| random()).collect();
        let mut torques_nm = [0.0; 7];
        joint_torques(&jacobian, &stick.hand_wrench(X_WH, f_B), &mut torques_nm);
        power_of_joints +=
            torques_nm.iter().zip(&joint_rates).map(|(torque, rate)| torque * rate).sum::<f64>();
        let hand = Twist::<World>::from_vector(&(jacobian * nalgebra::DVector::from_vec(joint_rates)));
        tip_twists.push(hand.shifted(&stick.vector(X_WH)));
    }
    let mut u = GeneralizedVelocity::zero(n);
    let mut scratch = WorkspaceScratch::new(&grasp.internal_forces);
    generalized_velocity(&grasp.internal_forces, &z.external, &tip_twists, &mut u, &mut scratch);
    let internal: f64 = h.internal.iter().zip(&u.internal).map(|(h, u)| h.power(u)).sum();
    let power = h.external.power(&u.external) + internal;
    assert!((power_of_joints - power).abs() < 1e-9, "{power_of_joints} {power}");
}
