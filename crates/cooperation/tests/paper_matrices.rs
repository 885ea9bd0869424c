//! The paper's own matrices: eqs. 24, 43 to 46.

use mikoshi_cooperation::{InternalForces, TeamArms};
use nalgebra::{DMatrix, dmatrix};
use num_rational::Ratio;

type Rational = Ratio<i64>;

/// C of eq. 44, in halves.
#[rustfmt::skip]
const EQ_44_HALVES: [[i64; 8]; 7] = [
    [1,  1,  1,  1, -1, -1, -1, -1],
    [1,  1, -1, -1,  0,  0,  0,  0],
    [0,  0,  0,  0,  1,  1, -1, -1],
    [1, -1,  0,  0,  0,  0,  0,  0],
    [0,  0,  1, -1,  0,  0,  0,  0],
    [0,  0,  0,  0,  1, -1,  0,  0],
    [0,  0,  0,  0,  0,  0,  1, -1],
];

/// V of eq. 45, in quarters.
#[rustfmt::skip]
const EQ_45_QUARTERS: [[i64; 7]; 8] = [
    [ 1,  2,  0,  4,  0,  0,  0],
    [ 1,  2,  0, -4,  0,  0,  0],
    [ 1, -2,  0,  0,  4,  0,  0],
    [ 1, -2,  0,  0, -4,  0,  0],
    [-1,  0,  2,  0,  0,  4,  0],
    [-1,  0,  2,  0,  0, -4,  0],
    [-1,  0, -2,  0,  0,  0,  4],
    [-1,  0, -2,  0,  0,  0, -4],
];

fn eq_44() -> DMatrix<f64> {
    DMatrix::from_fn(7, 8, |row, arm| EQ_44_HALVES[row][arm] as f64 / 2.0)
}

fn eq_45() -> DMatrix<f64> {
    DMatrix::from_fn(8, 7, |arm, row| EQ_45_QUARTERS[arm][row] as f64 / 4.0)
}

/// Gauss-Jordan elimination.
fn inverse(mut m: Vec<Vec<Rational>>) -> Vec<Vec<Rational>> {
    let n = m.len();
    for (i, row) in m.iter_mut().enumerate() {
        row.extend((0..n).map(|j| Rational::from_integer((i == j).into())));
    }
    for k in 0..n {
        let pivot = (k..n).find(|&row| m[row][k] != Rational::ZERO).expect("a regular matrix");
        m.swap(k, pivot);
        let scale = m[k][k];
        m[k].iter_mut().for_each(|value| *value /= scale);
        let pivot_row = m[k].clone();
        for (_, row) in m.iter_mut().enumerate().filter(|(row, _)| *row != k) {
            let factor = row[k];
            row.iter_mut().zip(&pivot_row).for_each(|(value, pivot)| *value -= factor * pivot);
        }
    }
    m.into_iter().map(|row| row[n..].to_vec()).collect()
}

#[test]
fn inverse_of_eq_44_is_exactly_eq_45() {
    let ones = vec![Rational::ONE; 8];
    let c = EQ_44_HALVES.iter().map(|row| row.iter().map(|&half| Rational::new(half, 2)).collect());
    let u = inverse(core::iter::once(ones).chain(c).collect());
    for (row, quarters) in u.iter().zip(&EQ_45_QUARTERS) {
        assert_eq!(row[0], Rational::new(1, 8), "W⁻ is one eighth in every block");
        let expected: Vec<_> = quarters.iter().map(|&quarter| Rational::new(quarter, 4)).collect();
        assert_eq!(row[1..], expected);
    }
}

#[test]
fn balanced_tree_of_four_robots_is_exactly_eqs_44_and_45() {
    let tree = InternalForces::balanced_tree(&TeamArms::numbered(&[2; 4]).unwrap());
    assert_eq!(tree.c(), eq_44());
    assert_eq!(tree.v(), eq_45());
    assert_eq!(tree.w_inverse(), [0.125; 8]);
    assert_eq!(tree.u().column(0).as_slice(), [0.125; 8]);
}

#[test]
fn rows_of_four_robots_are_named_in_the_order_of_eq_43() {
    let tree = InternalForces::balanced_tree(&TeamArms::numbered(&[2; 4]).unwrap());
    let expected = [
        "object",
        "AB|CD",
        "A|B",
        "C|D",
        "A.right|A.left",
        "B.right|B.left",
        "C.right|C.left",
        "D.right|D.left",
    ];
    assert_eq!(tree.names(), expected);
    assert_eq!(tree.row("C|D"), Some(3));
    assert_eq!(tree.row("A|C"), None);
}

#[test]
fn eq_44_given_as_a_matrix_is_the_balanced_tree() {
    let rows: Vec<Vec<f64>> = eq_44().row_iter().map(|row| row.iter().copied().collect()).collect();
    let given = InternalForces::from_matrix(&rows, 8).unwrap();
    assert_eq!(given.c(), eq_44());
    assert_eq!(given.v(), eq_45());
    assert_eq!(given.w_inverse(), [0.125; 8]);
}

/// Eq. 46 with its erratum: Δp_r3 ends in − ½ p_b8, where the paper prints p_b7 twice.
#[test]
fn relative_positions_of_four_robots_are_those_of_eq_46() {
    let tree = InternalForces::balanced_tree(&TeamArms::numbered(&[2; 4]).unwrap());
    let tips: Vec<f64> = (1..=8).map(|i| f64::from(1 << i)).collect();
    let [p1, p2, p3, p4, p5, p6, p7, p8] = tips[..] else { unreachable!() };
    let (mut z, mut work) = (vec![0.0; 8], vec![0.0; tree.work_len()]);
    tree.of_all().generalized_position(&tips, &mut z, &mut work);
    let expected = [
        (p1 + p2 + p3 + p4 + p5 + p6 + p7 + p8) / 8.0,
        (p1 + p2 + p3 + p4 - p5 - p6 - p7 - p8) / 4.0,
        (p1 + p2 - p3 - p4) / 2.0,
        (p5 + p6 - p7 - p8) / 2.0,
        p1 - p2,
        p3 - p4,
        p5 - p6,
        p7 - p8,
    ];
    assert_eq!(z, expected);
}

#[test]
fn chain_of_three_robots_is_exactly_eq_24() {
    let chain = InternalForces::chain(&TeamArms::numbered(&[2; 3]).unwrap());
    #[rustfmt::skip]
    let eq_24_halves = dmatrix![
        1.0, -1.0, 0.0,  0.0,  0.0,  0.0;
        0.0,  0.0, 1.0, -1.0,  0.0,  0.0;
        0.0,  0.0, 0.0,  0.0,  1.0, -1.0;
        1.0,  1.0, -1.0, -1.0, 0.0,  0.0;
        0.0,  0.0, 1.0,  1.0, -1.0, -1.0;
    ];
    assert_eq!(chain.c(), eq_24_halves / 2.0);
    assert_eq!(chain.names()[4..], ["A|B", "B|C"]);
}
