//! Teams that some arms have left: internal forces among those who stay, and a law that goes on with them.

#![allow(non_snake_case)]

mod common;

use assert_no_alloc::assert_no_alloc;
use common::{CAPACITY, ClosedLoop, parameters, team};
use mikoshi_cooperation::{FormError, HybridLaw, InternalForces, ReformError};
use mikoshi_spatial::{Twist, Wrench};
use nalgebra::{DMatrix, Vector3};
use proptest::prelude::*;

#[global_allocator]
static ALLOCATOR: assert_no_alloc::AllocDisabler = assert_no_alloc::AllocDisabler;

/// A tree, and which of its arms take part: at least one.
fn formed_team() -> impl Strategy<Value = (InternalForces, Vec<bool>)> {
    prop::collection::vec(1..=3_usize, 1..=9)
        .prop_filter("two arms", |arms| arms.iter().sum::<usize>() >= 2)
        .prop_flat_map(|arms| {
            let forces = InternalForces::balanced_tree(&team(&arms));
            let n = forces.arms();
            (Just(forces), prop::collection::vec(any::<bool>(), n))
        })
        .prop_filter("one arm", |(_, takes_part)| takes_part.iter().any(|&is| is))
}

fn indices(flags: impl Iterator<Item = bool>) -> Vec<usize> {
    flags.enumerate().filter(|(_, is)| *is).map(|(index, _)| index).collect()
}

fn is_close(a: &DMatrix<f64>, b: &DMatrix<f64>) -> bool {
    a.shape() == b.shape() && (a - b).amax() < 1e-12
}

proptest! {
    /// Eqs. 4, 6 and 12 for whoever is left: as many rows as arms, exact inverses, equal shares, and zeros elsewhere.
    #[test]
    fn w_c_and_u_of_any_arms_are_those_of_a_team_of_their_own((forces, takes_part) in formed_team()) {
        let mut formation = forces.whole().clone();
        forces.form(|arm| takes_part[arm], &mut formation).unwrap();
        let n = forces.arms();
        let arms = indices(takes_part.iter().copied());
        let rows = indices((0..n).map(|row| formation.has_row(row)));
        prop_assert_eq!(formation.arms(), arms.len());
        prop_assert_eq!(rows.len(), arms.len());

        let of_those = |matrix: &DMatrix<f64>, rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| matrix[(rows[i], columns[j])])
        };
        let (w_and_c, u) = (forces.among(&formation).w_and_c(), forces.among(&formation).u());
        let (w_and_c_left, u_left) = (of_those(&w_and_c, &rows, &arms), of_those(&u, &arms, &rows));
        let k = arms.len();
        prop_assert!(is_close(&(&w_and_c_left * &u_left), &DMatrix::identity(k, k)));
        prop_assert!(is_close(&(&u_left * &w_and_c_left), &DMatrix::identity(k, k)));
        prop_assert!(is_close(&w_and_c_left.rows(0, 1).into_owned(), &DMatrix::from_element(1, k, 1.0)), "W");
        // W V = 0, and C W⁻ = 0: what is internal moves nothing, and whoever stays bears as much as another.
        prop_assert!(u_left.column(0).iter().all(|&weight| (weight - 1.0 / k as f64).abs() < 1e-15));
        for (arm, &weight) in formation.w_inverse().iter().enumerate() {
            prop_assert_eq!(weight, if takes_part[arm] { 1.0 / k as f64 } else { 0.0 });
        }
        for row in 0..n {
            for arm in 0..n {
                if !formation.has_row(row) || !takes_part[arm] {
                    prop_assert_eq!((w_and_c[(row, arm)], u[(arm, row)]), (0.0, 0.0));
                }
            }
        }
    }

    /// z = Uᵀ y (eq. 27) and δy = [W; C]ᵀ δz are still each other's inverses and duals of the two above; a tip that takes
    /// no part is not looked at, and goes with others that do.
    #[test]
    fn positions_of_any_arms_are_dual_to_their_forces(
        (forces, takes_part) in formed_team(), y in prop::collection::vec(-1.0..1.0, 27),
    ) {
        let mut formation = forces.whole().clone();
        forces.form(|arm| takes_part[arm], &mut formation).unwrap();
        let (n, among) = (forces.arms(), forces.among(&formation));
        let mut y = y[..n].to_vec();
        let (mut z, mut back, mut work) = (vec![0.0; n], vec![0.0; n], vec![f64::NAN; forces.work_len()]);
        for (y, is) in y.iter_mut().zip(&takes_part) {
            *y = if *is { *y } else { f64::NAN };
        }
        among.generalized_position(&y, &mut z, &mut work);
        let of_those: Vec<f64> = y.iter().copied().filter(|y| !y.is_nan()).collect();
        prop_assert!((z[0] - of_those.iter().sum::<f64>() / of_those.len() as f64).abs() < 1e-12, "eq. 27");
        among.tip_displacements(&z, &mut back, &mut work);
        let span = |values: &[f64]| values.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
        let (least, most) = span(&of_those);
        for (arm, &is) in takes_part.iter().enumerate() {
            if is {
                prop_assert!((back[arm] - y[arm]).abs() < 1e-12);
            } else {
                prop_assert!(back[arm] >= least - 1e-12 && back[arm] <= most + 1e-12);
            }
        }
        let by_matrix = among.u().transpose() * DMatrix::from_iterator(n, 1, y.iter().map(|y| if y.is_nan() { 0.0 } else { *y }));
        prop_assert!((0..n).all(|row| (by_matrix[row] - z[row]).abs() < 1e-12));
    }

    /// Nothing is left of who was formed before.
    #[test]
    fn a_formation_is_a_function_of_its_arms((forces, takes_part) in formed_team()) {
        let (mut direct, mut by_way) = (forces.whole().clone(), forces.whole().clone());
        forces.form(|arm| takes_part[arm], &mut direct).unwrap();
        forces.form(|arm| arm % 2 == 0, &mut by_way).unwrap();
        assert_no_alloc(|| forces.form(|arm| takes_part[arm], &mut by_way)).unwrap();
        prop_assert_eq!(&direct, &by_way);
        forces.form(|_| true, &mut by_way).unwrap();
        prop_assert_eq!(&by_way, forces.whole());
    }
}

#[test]
fn rows_keep_their_meaning_when_an_arm_leaves() {
    let forces = InternalForces::balanced_tree(&team(&[2, 2]));
    assert_eq!(forces.names(), ["object", "A|B", "A.right|A.left", "B.right|B.left"]);
    let mut formation = forces.whole().clone();
    forces.form(|arm| arm != 1, &mut formation).unwrap();
    let rows = DMatrix::from_row_slice(
        4,
        4,
        &[
            1.0,
            0.0,
            1.0,
            1.0, // all
            2.0 / 3.0,
            0.0,
            -1.0 / 3.0,
            -1.0 / 3.0, // 1 · 2 / 3 of A's one hand less the mean of B's two
            0.0,
            0.0,
            0.0,
            0.0, // A has no two hands any more
            0.0,
            0.0,
            0.5,
            -0.5,
        ],
    );
    assert!(is_close(&forces.among(&formation).w_and_c(), &rows));
}

#[test]
fn what_can_not_be_formed_is_refused_and_nothing_changes() {
    let chain = InternalForces::chain(&team(&[2, 2]));
    let mut formation = chain.whole().clone();
    assert!(!chain.can_re_form());
    assert_eq!(chain.form(|arm| arm != 1, &mut formation), Err(FormError::NotATree));
    assert_eq!(chain.form(|_| true, &mut formation), Ok(()));
    assert_eq!(&formation, chain.whole());
    let tree = InternalForces::balanced_tree(&team(&[2, 2]));
    let mut formation = tree.whole().clone();
    assert_eq!(tree.form(|_| false, &mut formation), Err(FormError::NoArm));
    assert_eq!(&formation, tree.whole());
    let other = InternalForces::balanced_tree(&team(&[1, 2]));
    assert_eq!(other.form(|_| true, &mut formation), Err(FormError::WrongSize));
}

fn four_robots() -> ClosedLoop {
    let forces = InternalForces::balanced_tree(&team(&[2; 4]));
    let law = HybridLaw::new(forces.clone(), parameters(&forces)).unwrap();
    ClosedLoop::new(law, 0.01, 1)
}

fn reform(team: &mut ClosedLoop, takes_part: impl Fn(usize) -> bool) -> Result<(), ReformError> {
    let hands = team.hand_inputs();
    let X_WA = team.out.position.external;
    let ClosedLoop { law, state, scratch, .. } = team;
    assert_no_alloc(|| law.reform(state, scratch, &X_WA, &hands, takes_part))
}

/// Largest way of a hand in a tick \[m\].
fn largest_step(team: &mut ClosedLoop) -> f64 {
    let before: Vec<_> = team.out.hands.iter().map(|hand| hand.pose).collect();
    team.tick(true);
    let steps = before
        .iter()
        .zip(&team.out.hands)
        .map(|(before, now)| before.displacement_to(&now.pose).linear.norm());
    steps.fold(0.0, f64::max)
}

#[test]
fn a_law_goes_on_with_whoever_is_left_and_takes_their_internal_forces_to_zero() {
    const LOST: usize = 2;
    let mut team = four_robots();
    team.run(400);
    let step_before = largest_step(&mut team);
    team.lose(LOST);
    let X_WA = team.out.position.external;
    reform(&mut team, |arm| arm != LOST).unwrap();
    // What they are to begin with is what is there.
    let mut stepped = largest_step(&mut team);
    let jumped = X_WA.displacement_to(&team.out.position.external);
    assert!(jumped.linear.norm() < 1e-9 && jumped.angular.norm() < 1e-9, "Σa stays: {jumped:?}");
    for _ in 0..800 {
        stepped = stepped.max(largest_step(&mut team));
    }
    assert!(stepped < step_before + 1e-6, "{stepped} after {step_before}");
    let (force_n, moment_nm) = team.largest_internal();
    assert!(force_n < 0.01 && moment_nm < 0.01, "{force_n} N, {moment_nm} Nm");
    let wrenches = team.hand_wrenches();
    assert_eq!(wrenches[LOST], Wrench::zero());
    assert_eq!(team.out.hands[LOST].wrench, Wrench::zero());
    let error = team.out.position.external.displacement_to(&team.position_ref.external);
    assert!(error.linear.norm() < 1e-5, "{error:?}");
}

#[test]
fn a_hand_that_has_left_goes_along_with_the_object() {
    const LOST: usize = 5;
    let mut team = four_robots();
    team.run(400);
    team.lose(LOST);
    reform(&mut team, |arm| arm != LOST).unwrap();
    let in_object = |team: &ClosedLoop| team.X_WA.inverse() * *team.hands.front().unwrap().get(LOST).unwrap();
    let before = in_object(&team);
    team.twist_ref = Twist::new(Vector3::new(0.1, 0.05, 0.0), Vector3::new(0.0, 0.0, 0.1));
    team.run(600);
    let parted = before.displacement_to(&in_object(&team));
    // Its companions give way to what they lack by some hundredths of a millimetre a tick, at the start.
    assert!(parted.linear.norm() < 5e-3 && parted.angular.norm() < 1e-2, "{parted:?}");
}

#[test]
fn whoever_comes_back_is_let_in_without_a_jump() {
    let mut team = four_robots();
    team.run(400);
    let law = team.law.clone();
    reform(&mut team, |arm| arm / 2 != 1).unwrap();
    team.run(200);
    let mut forces = law.internal_forces().whole().clone();
    law.form(&team.state, &mut forces).unwrap();
    assert_eq!(forces.arms(), 6);
    let step_before = largest_step(&mut team);
    reform(&mut team, |_| true).unwrap();
    assert!(largest_step(&mut team) < step_before + 1e-6);
    law.form(&team.state, &mut forces).unwrap();
    assert_eq!(&forces, law.internal_forces().whole());
    team.run(800);
    let (force_n, _) = team.largest_internal();
    assert!(force_n < 0.01, "{force_n} N");
}

#[test]
fn the_filter_remembers_arms_and_not_rows() {
    let mut team = four_robots();
    team.run(20);
    let memory = team.state.filtered_force;
    reform(&mut team, |arm| arm != 7).unwrap();
    assert_ne!(team.state.filtered_force, memory);
    // By eq. 7 and back, with the arm that left still in its grip: it brings along what it applies.
    let filtered = team.state.filtered_force;
    let mut again = four_robots();
    again.run(20);
    again.scratch.poison();
    reform(&mut again, |arm| arm != 7).unwrap();
    assert_eq!(again.state.filtered_force, filtered, "nothing that survives in scratch counts");
    assert_eq!(again.state.is_absent[..8], [0, 0, 0, 0, 0, 0, 0, 1]);
}

#[test]
fn a_law_whose_c_is_a_matrix_does_not_lose_an_arm() {
    let forces = InternalForces::chain(&team(&[2; 4]));
    let law = HybridLaw::new(forces.clone(), parameters(&forces)).unwrap();
    let mut team = ClosedLoop::new(law, 0.01, 1);
    team.run(20);
    let before = team.state;
    assert_eq!(reform(&mut team, |arm| arm != 0), Err(ReformError::Form(FormError::NotATree)));
    assert_eq!(team.state, before);
    let _: [u64; CAPACITY] = before.is_absent;
}
