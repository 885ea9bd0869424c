//! Algebra of the internal forces: for trees, chains and given matrices.

#![allow(non_snake_case)]

use mikoshi_cooperation::{
    BuildInternalForcesError, BuildTeamArmsError, InternalForces, RobotArms, RowCombination, TeamArms,
    change_of_representation, pair_matrix, pairwise_forces,
};
use nalgebra::DMatrix;
use proptest::prelude::*;

fn arms_per_robot() -> impl Strategy<Value = Vec<usize>> {
    prop::collection::vec(1..=3_usize, 1..=9).prop_filter("two arms", |arms| arms.iter().sum::<usize>() >= 2)
}

fn team(arms_per_robot: &[usize]) -> TeamArms {
    TeamArms::numbered(arms_per_robot).unwrap()
}

/// A C of full rank that is neither tree nor chain: the identity's right part, disturbed.
fn matrix() -> impl Strategy<Value = Vec<Vec<f64>>> {
    (2..9_usize).prop_flat_map(|n| {
        let row = prop::collection::vec(-0.9 / n as f64..0.9 / n as f64, n);
        prop::collection::vec(row, n - 1).prop_map(|mut rows| {
            for (i, row) in rows.iter_mut().enumerate() {
                row[i] += 1.0;
                row[i + 1] -= 1.0;
            }
            rows
        })
    })
}

fn any_internal_forces() -> impl Strategy<Value = InternalForces> {
    prop_oneof![
        arms_per_robot().prop_map(|arms| InternalForces::balanced_tree(&team(&arms))),
        arms_per_robot().prop_map(|arms| InternalForces::chain(&team(&arms))),
        matrix().prop_map(|rows| InternalForces::from_matrix(&rows, rows.len() + 1).unwrap()),
    ]
}

fn column(values: &[f64]) -> DMatrix<f64> {
    DMatrix::from_column_slice(values.len(), 1, values)
}

fn is_close(a: &DMatrix<f64>, b: &DMatrix<f64>) -> bool {
    a.shape() == b.shape() && (a - b).amax() < 1e-9
}

proptest! {
    #[test]
    fn w_c_u_and_v_satisfy_eqs_4_6_and_12(forces in any_internal_forces()) {
        let n = forces.arms();
        let W = DMatrix::from_element(1, n, 1.0);
        let W_inverse = column(forces.w_inverse());
        prop_assert_eq!(forces.w_and_c().remove_rows(1, n - 1), W.clone());
        prop_assert!(is_close(&(&W * &W_inverse * &W), &W));
        prop_assert!(is_close(&(&W * forces.v()), &DMatrix::zeros(1, n - 1)));
        prop_assert!(is_close(&(forces.w_and_c() * forces.u()), &DMatrix::identity(n, n)));
        prop_assert!(is_close(&forces.u().remove_columns(1, n - 1), &W_inverse));
        prop_assert_eq!(forces.v(), forces.u().remove_column(0));
        prop_assert_eq!(forces.c(), forces.w_and_c().remove_row(0));
    }

    #[test]
    fn the_four_maps_are_the_matrices_and_their_transposes(
        forces in any_internal_forces(), seed in prop::collection::vec(-10.0..10.0, 27)
    ) {
        let n = forces.arms();
        let x = &seed[..n];
        let mut work = vec![f64::NAN; forces.work_len()];
        let mut out = vec![f64::NAN; n];
        let (w_and_c, u, x_column) = (forces.w_and_c(), forces.u(), column(x));
        forces.of_all().generalized_force(x, &mut out, &mut work);
        prop_assert!(is_close(&column(&out), &(&w_and_c * &x_column)));
        forces.of_all().tip_forces(x, &mut out, &mut work);
        prop_assert!(is_close(&column(&out), &(&u * &x_column)));
        forces.of_all().generalized_position(x, &mut out, &mut work);
        prop_assert!(is_close(&column(&out), &(u.transpose() * &x_column)));
        forces.of_all().tip_displacements(x, &mut out, &mut work);
        prop_assert!(is_close(&column(&out), &(w_and_c.transpose() * &x_column)));
    }

    #[test]
    fn forces_and_displacements_do_the_same_work_in_both_spaces(
        forces in any_internal_forces(),
        q in prop::collection::vec(-10.0..10.0, 27),
        dz in prop::collection::vec(-1.0..1.0, 27),
    ) {
        let n = forces.arms();
        let (mut h, mut dy, mut work) = (vec![0.0; n], vec![0.0; n], vec![0.0; forces.work_len()]);
        forces.of_all().generalized_force(&q[..n], &mut h, &mut work);
        forces.of_all().tip_displacements(&dz[..n], &mut dy, &mut work);
        let work_of = |forces: &[f64], displacements: &[f64]| -> f64 {
            forces.iter().zip(displacements).map(|(f, d)| f * d).sum()
        };
        prop_assert!((work_of(&h, &dz[..n]) - work_of(&q[..n], &dy)).abs() < 1e-9);
    }

    /// The object's motion is the mean of the tips', whatever the team.
    #[test]
    fn a_tree_has_one_nth_in_every_block_of_w_inverse(arms in arms_per_robot()) {
        let forces = InternalForces::balanced_tree(&team(&arms));
        let n = forces.arms();
        prop_assert!(forces.w_inverse().iter().all(|&weight| weight == 1.0 / n as f64));
        let inverse = forces.w_and_c().try_inverse().unwrap();
        prop_assert!(inverse.column(0).iter().all(|&weight| (weight - 1.0 / n as f64).abs() < 1e-12));
    }

    #[test]
    fn internal_rows_of_trees_and_chains_do_not_move_the_object(
        arms in arms_per_robot(), dz in prop::collection::vec(-1.0..1.0, 27)
    ) {
        for forces in [InternalForces::balanced_tree(&team(&arms)), InternalForces::chain(&team(&arms))] {
            let n = forces.arms();
            let rows: Vec<f64> = core::iter::once(0.0).chain(dz.iter().copied()).take(n).collect();
            let (mut dy, mut work) = (vec![0.0; n], vec![0.0; forces.work_len()]);
            forces.of_all().tip_displacements(&rows, &mut dy, &mut work);
            prop_assert!((dy.iter().sum::<f64>() / n as f64).abs() < 1e-12);
        }
    }

    /// So a force error along one row shows in no other.
    #[test]
    fn rows_of_a_tree_are_orthogonal(arms in arms_per_robot()) {
        let rows = InternalForces::balanced_tree(&team(&arms)).w_and_c();
        let products = &rows * rows.transpose();
        prop_assert!(is_close(&products, &DMatrix::from_diagonal(&products.diagonal())));
    }

    /// A matrix given is the matrix applied.
    #[test]
    fn from_matrix_keeps_its_rows(rows in matrix()) {
        let forces = InternalForces::from_matrix(&rows, rows.len() + 1).unwrap();
        for (kept, given) in forces.c().row_iter().zip(&rows) {
            prop_assert_eq!(kept.iter().copied().collect::<Vec<_>>(), given.clone());
        }
    }

    /// Eq. 18, and that no internal force is lost on the way.
    #[test]
    fn a_change_of_representation_gives_what_the_other_set_sees(
        arms in arms_per_robot(), q in prop::collection::vec(-10.0..10.0, 27)
    ) {
        let (tree, chain) = (InternalForces::balanced_tree(&team(&arms)), InternalForces::chain(&team(&arms)));
        let n = tree.arms();
        let q = column(&q[..n]);
        let change = change_of_representation(&tree, &chain).unwrap();
        prop_assert!(is_close(&(&change * tree.w_and_c() * &q), &(chain.w_and_c() * &q)));
        let internal = change.view((1, 1), (n - 1, n - 1)).into_owned();
        prop_assert!(is_close(&internal, &(chain.c() * tree.v())), "C₂ C₁⁻");
        prop_assert!(change.column(0).iter().skip(1).all(|value| value.abs() < 1e-12));
        let back = change_of_representation(&chain, &tree).unwrap();
        prop_assert!(is_close(&(back * change), &DMatrix::identity(n, n)));
    }

    /// Eqs. 13 to 16.
    #[test]
    fn pairwise_forces_are_half_of_g_times_q(q in prop::collection::vec(-10.0..10.0, 2..9)) {
        let n = q.len();
        let G = pair_matrix(n);
        prop_assert_eq!(G.shape(), (n * (n - 1) / 2, n));
        prop_assert_eq!(G.rank(1e-9), n - 1);
        let by_matrix = &G * column(&q) * 0.5;
        for (((i, j), force), expected) in pairwise_forces(&q).zip(by_matrix.iter()) {
            prop_assert!(i < j);
            prop_assert_eq!(force, 0.5 * (q[i] - q[j]));
            prop_assert!((force - expected).abs() < 1e-12);
        }
        prop_assert_eq!(pairwise_forces(&q).count(), G.nrows());
    }
}

#[test]
fn representations_for_different_numbers_of_arms_do_not_change_into_each_other() {
    let (two, three) = (InternalForces::chain(&team(&[2])), InternalForces::chain(&team(&[3])));
    assert_eq!(change_of_representation(&two, &three), None);
}

#[test]
fn a_thousand_robots_are_inverted_by_their_tree() {
    let forces = InternalForces::balanced_tree(&team(&[2; 1000]));
    let n = forces.arms();
    let q: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
    let (mut h, mut back, mut work) = (vec![0.0; n], vec![0.0; n], vec![0.0; forces.work_len()]);
    forces.of_all().generalized_force(&q, &mut h, &mut work);
    assert!((h[0] - q.iter().sum::<f64>()).abs() < 1e-10);
    forces.of_all().tip_forces(&h, &mut back, &mut work);
    assert!(q.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-12));
}

fn rows<const N: usize>(rows: &[[f64; N]]) -> Vec<Vec<f64>> {
    rows.iter().map(|row| row.to_vec()).collect()
}

#[test]
fn a_dependent_row_is_named_with_those_that_determine_it() {
    let c = rows(&[[0.5, -0.5, 0.0, 0.0], [0.0, 0.5, -0.5, 0.0], [1.0, -0.5, -0.5, 0.0]]);
    let error = InternalForces::from_matrix(&c, 4).unwrap_err();
    let BuildInternalForcesError::DependentRows(combinations) = &error else { panic!("{error}") };
    let [RowCombination { row, combination }] = combinations.as_slice() else { panic!("{error}") };
    let mut named: Vec<usize> = combination.iter().map(|(row, _)| *row).chain([*row]).collect();
    named.sort_unstable();
    assert_eq!(named, [1, 2, 3]);
    for (arm, dependent) in c[row - 1].iter().enumerate() {
        let sum: f64 = combination.iter().map(|(other, coefficient)| coefficient * c[other - 1][arm]).sum();
        assert!((sum - dependent).abs() < 1e-12);
    }
    // r3 = 2 r1 + r2, solved for whichever row the factorisation left over.
    let solved = ["r1 = -0.5 r2 + 0.5 r3", "r2 = -2 r1 + 1 r3", "r3 = 2 r1 + 1 r2"];
    assert!(solved.iter().any(|equation| error.to_string().ends_with(equation)), "{error}");
}

#[test]
fn a_row_that_measures_the_external_force_is_no_internal_force() {
    let error = InternalForces::from_matrix(&rows(&[[0.5, -0.5, 0.0], [0.1, 0.1, 0.1]]), 3).unwrap_err();
    let message = error.to_string();
    assert!(message.ends_with("r2 = 0.1 object") || message.ends_with("object = 10 r2"), "{message}");
}

#[test]
fn a_row_of_zeros_is_named() {
    let error = InternalForces::from_matrix(&rows(&[[0.0, 0.0, 0.0], [0.5, -0.5, 0.0]]), 3).unwrap_err();
    assert!(error.to_string().ends_with("r1 = 0"), "{error}");
}

#[test]
fn every_dependent_row_is_named() {
    let c = rows(&[[1.0, -1.0, 0.0, 0.0], [2.0, -2.0, 0.0, 0.0], [3.0, -3.0, 0.0, 0.0]]);
    let error = InternalForces::from_matrix(&c, 4).unwrap_err();
    let BuildInternalForcesError::DependentRows(combinations) = error else { panic!("{error}") };
    assert_eq!(combinations.len(), 2);
}

#[test]
fn rank_does_not_depend_on_the_size_of_coefficients() {
    for size in [1e-150, 1e-12, 1.0, 1e12, 1e150] {
        let independent = rows(&[[size, -size, 0.0], [0.0, 1.0, -1.0]]);
        assert!(InternalForces::from_matrix(&independent, 3).is_ok(), "{size}");
        let dependent = rows(&[[size, -size, 0.0], [1.0, -1.0, 0.0]]);
        assert!(InternalForces::from_matrix(&dependent, 3).is_err(), "{size}");
    }
}

#[test]
fn matrices_of_the_wrong_shape_or_with_values_that_are_no_number_are_rejected() {
    use BuildInternalForcesError::{NotFinite, RowCount, RowLength, TooFewArms};
    assert_eq!(InternalForces::from_matrix(&[], 1).unwrap_err(), TooFewArms(1));
    assert_eq!(InternalForces::from_matrix(&[], 3).unwrap_err(), RowCount { arms: 3, found: 0 });
    let ragged = vec![vec![1.0, -1.0, 0.0], vec![0.0, 1.0]];
    let error = RowLength { row: "r2".into(), arms: 3, found: 2 };
    assert_eq!(InternalForces::from_matrix(&ragged, 3).unwrap_err(), error);
    let infinite = rows(&[[1.0, f64::INFINITY]]);
    let error = NotFinite { row: "r1".into(), arm: 1, value: f64::INFINITY };
    assert_eq!(InternalForces::from_matrix(&infinite, 2).unwrap_err(), error);
    let nan = InternalForces::from_matrix(&rows(&[[f64::NAN, 1.0]]), 2);
    assert!(matches!(nan.unwrap_err(), NotFinite { arm: 0, .. }));
}

#[test]
fn rows_of_any_team_are_named_after_their_groups() {
    let names = |arms: &[usize]| InternalForces::balanced_tree(&team(arms)).names().to_vec();
    assert_eq!(names(&[2]), ["object", "A.right|A.left"]);
    assert_eq!(names(&[1, 1]), ["object", "A|B"]);
    assert_eq!(names(&[3, 1, 1])[1..], ["AB|C", "A|B", "A.right+left|A.arm3", "A.right|A.left"]);
    assert_eq!(names(&[1; 5])[1..], ["ABC|DE", "AB|C", "D|E", "A|B"]);
    assert_eq!(names(&[1; 16])[1..4], ["A..H|I..P", "ABCD|EFGH", "IJKL|MNOP"]);
    assert_eq!(names(&[5])[1], "A.right..arm3|A.arm4+arm5");
    let large = names(&[2; 1000]);
    assert_eq!(large[1], "A..R500|R501..R1000");
    assert!(large.iter().all(|name| name.len() < 32));
    let unique: std::collections::BTreeSet<_> = large.iter().collect();
    assert_eq!(unique.len(), 2000);
}

#[test]
fn long_names_of_robots_stay_apart() {
    let robot = |name: &str| RobotArms { robot: name.into(), hands: vec!["palm".into()] };
    let team = TeamArms::new(["ann", "bob", "cyd", "dan", "eve"].map(robot).to_vec()).unwrap();
    let forces = InternalForces::balanced_tree(&team);
    assert_eq!(forces.names()[1..], ["ann..cyd|dan+eve", "ann+bob|cyd", "dan|eve", "ann|bob"]);
}

#[test]
fn lists_of_robots_that_are_no_team_are_rejected() {
    use BuildTeamArmsError::{DuplicateHand, DuplicateRobot, RobotWithoutArm, TooFewArms};
    let robot = |name: &str, hands: &[&str]| RobotArms {
        robot: name.into(),
        hands: hands.iter().map(|&hand| hand.into()).collect(),
    };
    assert_eq!(TeamArms::new(vec![]).unwrap_err(), TooFewArms(0));
    assert_eq!(TeamArms::new(vec![robot("A", &["right"])]).unwrap_err(), TooFewArms(1));
    let idle = vec![robot("A", &["right", "left"]), robot("B", &[])];
    assert_eq!(TeamArms::new(idle).unwrap_err(), RobotWithoutArm("B".into()));
    let twins = vec![robot("A", &["right"]), robot("A", &["right"])];
    assert_eq!(TeamArms::new(twins).unwrap_err(), DuplicateRobot("A".into()));
    let error = DuplicateHand { robot: "A".into(), hand: "right".into() };
    assert_eq!(TeamArms::new(vec![robot("A", &["right", "right"])]).unwrap_err(), error);
}
