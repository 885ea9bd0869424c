//! One tick of the hybrid law, by number of two-armed robots.

#![allow(non_snake_case)]

use divan::{Bencher, black_box};
use mikoshi_cooperation::{
    ForceGains, GeneralizedForce, GeneralizedPosition, HandInput, HybridInputs, HybridLaw, HybridParameters,
    HybridReference, HybridState, InternalForces, Selection, TeamArms, VirtualStick,
};
use mikoshi_spatial::{Object, Pose, Twist, World, Wrench, exp};
use nalgebra::Vector3;

const CAPACITY: usize = 2000;

fn main() {
    divan::main();
}

#[divan::bench(args = [1, 4, 16, 64, 256, 1000])]
fn balanced_tree(bencher: Bencher, robots: usize) {
    let team = TeamArms::numbered(&vec![2; robots]).unwrap();
    tick(bencher, InternalForces::balanced_tree(&team));
}

#[divan::bench(args = [1, 4, 16])]
fn dense_chain(bencher: Bencher, robots: usize) {
    let team = TeamArms::numbered(&vec![2; robots]).unwrap();
    tick(bencher, InternalForces::chain(&team));
}

fn tick(bencher: Bencher, internal_forces: InternalForces) {
    let n = internal_forces.arms();
    let X_WA: Pose<World, Object> =
        Pose::new(Vector3::new(1.0, 2.0, 0.96), exp(&Vector3::new(0.0, 0.02, 0.3)));
    let hands: Vec<HandInput> = (0..n)
        .map(|i| {
            let angle = i as f64;
            let p_HA_W = Vector3::new(angle.cos(), angle.sin(), 0.1);
            let pose = Pose::new(X_WA.translation - p_HA_W, exp(&Vector3::new(0.1, 0.2, angle.sin())));
            let wrench = Wrench::new(p_HA_W * 5.0, Vector3::new(1.0, -2.0, angle.cos()));
            HandInput { pose, pose_commanded: pose, wrench }
        })
        .collect();
    let sticks: Vec<_> = hands.iter().map(|hand| VirtualStick::at_grasp(&hand.pose, &X_WA)).collect();
    let parameters = HybridParameters {
        period_s: 0.005,
        kz: 0.05,
        kh: ForceGains { m_n: 1e-4, rad_nm: 2e-4 },
        selection: Selection::object_position_internal_force(n),
        filter_hz: 10.0,
        lead_limit_m: 0.02,
        lead_limit_rad: 0.05,
        approach_limit_m_s: 0.01,
        approach_limit_rad_s: 0.02,
    };
    let law = HybridLaw::new(internal_forces, parameters).unwrap();
    let mut state = Box::new(HybridState::<CAPACITY>::at_grasp(&sticks).unwrap());
    let (mut scratch, mut out) = (law.scratch(), law.output());
    let force = GeneralizedForce::zero(n);
    let position = GeneralizedPosition::at_grasp(X_WA, n);
    let object_twist = Twist::new(Vector3::new(0.1, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.05));
    let reference = HybridReference { force: &force, position: &position, object_twist };
    bencher.bench_local(|| {
        let inputs =
            HybridInputs { hands: black_box(&hands), grasp_yield: Twist::zero(), reference: Some(reference) };
        law.act(&mut state, &mut scratch, &inputs, &mut out)
    });
}
