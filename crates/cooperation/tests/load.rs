//! What is carried, and who bears how much of it.

#![allow(non_snake_case)]

use bytemuck::Zeroable;
use mikoshi_cooperation::{Bearer, LoadIdentifier, LoadIdentifierState, share_load};
use mikoshi_spatial::{Object, Pose, World, Wrench, exp};
use nalgebra::{Matrix3, Vector3};

const PERIOD_S: f64 = 0.005;
const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// A body by its numbers, and the object's origin in it.
#[derive(Clone, Copy)]
struct Body {
    mass_kg: f64,
    com_m: Vector3<f64>,
    inertia_kg_m2: Matrix3<f64>,
}

/// Some way of moving, turning and leaning, that excites all that is sought, and its derivatives by differences.
fn pose(time_s: f64) -> Pose<World, Object> {
    let along =
        Vector3::new(0.04 * (1.7 * time_s).sin(), 0.03 * (2.3 * time_s).sin(), 0.02 * (1.1 * time_s).sin());
    let about =
        Vector3::new(0.2 * (1.9 * time_s).sin(), 0.15 * (2.9 * time_s).sin(), 0.3 * (1.3 * time_s).sin());
    Pose::new(along, exp(&about))
}

/// What moves a body like this, at the object's origin, by Newton and Euler about its centre of mass.
fn wrench(body: &Body, time_s: f64) -> Wrench<World> {
    let h = 1e-4;
    let com = |time_s: f64| pose(time_s).transform_point(&body.com_m);
    let acceleration = (com(time_s + h) - com(time_s) * 2.0 + com(time_s - h)) / (h * h);
    let momentum = |time_s: f64| {
        let omega = pose(time_s - h).displacement_to(&pose(time_s + h)).angular / (2.0 * h);
        let R = pose(time_s).rotation.to_rotation_matrix().into_inner();
        R * body.inertia_kg_m2 * R.transpose() * omega
    };
    let force = (acceleration - GRAVITY) * body.mass_kg;
    let moment = (momentum(time_s + h) - momentum(time_s - h)) / (2.0 * h);
    Wrench::new(force, moment + (com(time_s) - pose(time_s).translation).cross(&force))
}

fn body() -> Body {
    let inertia_kg_m2 = Matrix3::new(3.1, 0.2, -0.1, 0.2, 1.4, 0.3, -0.1, 0.3, 4.0);
    Body { mass_kg: 20.0, com_m: Vector3::new(0.05, -0.12, 0.03), inertia_kg_m2 }
}

fn watch(
    identifier: &LoadIdentifier,
    state: &mut LoadIdentifierState,
    body: &Body,
    ticks: core::ops::Range<u64>,
) {
    for tick in ticks {
        let time_s = tick as f64 * PERIOD_S;
        identifier.observe(state, &pose(time_s), &wrench(body, time_s));
    }
}

#[test]
fn what_moves_about_is_known_by_its_mass_its_centre_and_its_inertia() {
    let (identifier, mut state) = (LoadIdentifier::new(PERIOD_S), LoadIdentifierState::zeroed());
    assert!(state.body().is_none(), "nobody has looked");
    watch(&identifier, &mut state, &body(), 0..4000);
    let found = state.body().expect("it was looked at for 20 s");
    assert!((found.mass_kg - 20.0).abs() < 0.02, "{found:?}");
    assert!((found.com_m - body().com_m).norm() < 2e-3, "{found:?}");
    let I = body().inertia_kg_m2;
    for (found, (row, column)) in
        found.inertia_kg_m2.iter().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)])
    {
        assert!((found - I[(row, column)]).abs() < 0.15, "{row}, {column}: {found}");
    }
    assert!(found.mass_std_kg < 0.1 && found.com_std_m.max() < 0.01, "{found:?}");
}

#[test]
fn what_is_only_held_is_known_by_its_weight_and_nothing_is_claimed_of_its_inertia() {
    let (identifier, mut state) = (LoadIdentifier::new(PERIOD_S), LoadIdentifierState::zeroed());
    let Body { mass_kg, com_m, .. } = body();
    let at_rest = Pose::<World, Object>::identity();
    let force = -GRAVITY * mass_kg;
    (0..400).for_each(|_| identifier.observe(&mut state, &at_rest, &Wrench::new(force, com_m.cross(&force))));
    let found = state.body().expect("it was looked at for 2 s");
    assert!((found.mass_kg - mass_kg).abs() < 1e-2 && (found.com_m - com_m).xy().norm() < 1e-3, "{found:?}");
    assert!(found.com_std_m.z > 0.5 && found.inertia_std_kg_m2.iter().all(|std| *std > 10.0), "{found:?}");
}

#[test]
fn a_mass_that_changes_is_found_again_within_a_second() {
    let (identifier, mut state) = (LoadIdentifier::new(PERIOD_S), LoadIdentifierState::zeroed());
    watch(&identifier, &mut state, &body(), 0..2000);
    let heavier = Body { mass_kg: 25.0, ..body() };
    watch(&identifier, &mut state, &heavier, 2000..2200);
    let found = state.body().expect("it was looked at");
    assert!((found.mass_kg - 25.0).abs() < 0.03 * 25.0, "{found:?}");
}

/// Four hands about an object.
fn bearers(weights: [f64; 4], moment: f64) -> [Bearer; 4] {
    let at = [(-0.3, 0.4), (-0.3, -0.4), (0.3, -0.4), (0.3, 0.4)];
    core::array::from_fn(|hand| {
        let (x, y) = at[hand];
        Bearer {
            position_m: Vector3::new(x, y, 0.0),
            weight: weights[hand],
            moment_nm: Vector3::new(0.0, -moment * f64::signum(x), 0.0),
        }
    })
}

fn shared(load: &Wrench<World>, bearers: [Bearer; 4]) -> [Wrench<World>; 4] {
    let mut out = [Wrench::zero(); 4];
    assert!(share_load(load, &Vector3::zeros(), bearers.into_iter(), &mut out));
    let sum = out
        .iter()
        .zip(&bearers)
        .fold(Wrench::<World>::zero(), |sum, (wrench, bearer)| sum + wrench.shifted(&bearer.position_m));
    assert!((sum - *load).to_vector().norm() < 1e-9, "{sum:?}");
    out
}

#[test]
fn hands_lift_by_forces_alone_and_with_moments_of_their_own_where_those_cancel() {
    let load = Wrench::new(Vector3::new(0.0, 0.0, 200.0), Vector3::zeros());
    for wrench in shared(&load, bearers([1.0; 4], 0.0)) {
        assert!((wrench.force.z - 50.0).abs() < 1e-9 && wrench.moment.norm() < 1e-9, "{wrench:?}");
    }
    for (wrench, bearer) in shared(&load, bearers([1.0; 4], 8.0)).iter().zip(bearers([1.0; 4], 8.0)) {
        assert!((wrench.force.z - 50.0).abs() < 1e-9 && (wrench.moment - bearer.moment_nm).norm() < 1e-9);
    }
}

#[test]
fn who_weighs_twice_as_much_bears_more_and_nobody_who_weighs_nothing_bears_anything() {
    let load = Wrench::new(Vector3::new(0.0, 0.0, 300.0), Vector3::zeros());
    // Two and two, across: what they bear balances whatever their weights.
    let out = shared(&load, bearers([2.0, 1.0, 2.0, 1.0], 0.0));
    assert!((out[0].force.z - 100.0).abs() < 1e-6 && (out[1].force.z - 50.0).abs() < 1e-6, "{out:?}");
    let out = shared(&load, bearers([1.0, 0.0, 1.0, 0.0], 5.0));
    assert_eq!(out[1], Wrench::zero());
    assert!((out[0].force.z - 150.0).abs() < 1e-6, "{out:?}");
    let mut out = [Wrench::zero(); 4];
    assert!(!share_load(&load, &Vector3::zeros(), bearers([0.0; 4], 5.0).into_iter(), &mut out));
}

#[test]
fn a_load_off_the_middle_is_borne_by_who_is_near_it() {
    let force = Vector3::new(0.0, 0.0, 200.0);
    let load = Wrench::new(force, Vector3::new(0.0, 0.1, 0.0).cross(&force));
    let out = shared(&load, bearers([1.0; 4], 0.0));
    assert!(out[0].force.z > 60.0 && out[1].force.z < 40.0, "{out:?}");
    assert!(out.iter().all(|wrench| wrench.moment.norm() < 0.2), "{out:?}");
}
