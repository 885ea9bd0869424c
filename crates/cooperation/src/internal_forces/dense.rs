//! Internal forces by any matrix of full rank, applied in O(n²).

use super::OBJECT_ROW;
use super::formation::Formation;
use crate::Linear;
use core::fmt;
use faer::Mat;
use faer::linalg::solvers::DenseSolveCore;

/// What remains of a row of unit norm beyond the rows before it, below which it counts as dependent.
const RANK_TOLERANCE: f64 = 1e-9;

/// [W; C] and its inverse U, row by row.
#[derive(Clone, Debug)]
pub(super) struct DenseMap {
    arms: usize,
    w_and_c: Vec<f64>,
    u: Vec<f64>,
}

/// Why a matrix is no C.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum BuildInternalForcesError {
    #[error("internal forces need at least two arms; there are {0}")]
    TooFewArms(usize),
    #[error("{arms} arms have {} internal forces; the matrix has {found} rows", arms - 1)]
    RowCount { arms: usize, found: usize },
    #[error("row {row} must have {arms} coefficients, one for each arm; it has {found}")]
    RowLength { row: String, arms: usize, found: usize },
    #[error("row {row}, arm {arm}: the coefficient {value} is not finite")]
    NotFinite { row: String, arm: usize, value: f64 },
    #[error("the internal forces are not independent of each other and of the object's: {}", join(.0))]
    DependentRows(Vec<RowCombination>),
}

/// A row that the others determine; displayed as `r3 = 1 r1 - 0.5 r2`.
#[derive(Clone, Debug, PartialEq)]
pub struct RowCombination {
    /// The row, as in [`InternalForces::names`](super::InternalForces::names): 0 is the object's.
    pub row: usize,
    /// The rows that add up to it, each with its coefficient; none if the row is zero.
    pub combination: Vec<(usize, f64)>,
}

impl fmt::Display for RowCombination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} =", row_name(self.row))?;
        if self.combination.is_empty() {
            return f.write_str(" 0");
        }
        for (position, (row, coefficient)) in self.combination.iter().enumerate() {
            let sign = match (position, *coefficient < 0.0) {
                (0, false) => "",
                (0, true) => "-",
                (_, false) => "+ ",
                (_, true) => "- ",
            };
            // Four digits say which rows meet, without the rounding errors of finding out.
            let size = (coefficient.abs() * 1e4).round() / 1e4;
            write!(f, " {sign}{size} {}", row_name(*row))?;
        }
        Ok(())
    }
}

fn join(combinations: &[RowCombination]) -> String {
    combinations.iter().map(RowCombination::to_string).collect::<Vec<_>>().join("; ")
}

/// What the rows of a matrix are called: the paper's f_r1, f_r2, …, after the object's.
pub(super) fn row_name(row: usize) -> String {
    if row == 0 { OBJECT_ROW.to_owned() } else { format!("r{row}") }
}

impl DenseMap {
    /// From the n − 1 rows of C.
    pub fn new(c: &[Vec<f64>], arms: usize) -> Result<Self, BuildInternalForcesError> {
        check_shape(c, arms)?;
        check_rank(c, arms)?;
        Ok(Self::of_full_rank(c, arms))
    }

    /// From the rows of a C that is known to be one.
    pub fn of_full_rank(c: &[Vec<f64>], arms: usize) -> Self {
        let w_and_c = w_and_c(c, arms);
        let u = w_and_c.partial_piv_lu().inverse();
        let row_by_row = |matrix: &Mat<f64>| {
            (0..arms).flat_map(|row| (0..arms).map(move |arm| matrix[(row, arm)])).collect::<Vec<_>>()
        };
        Self { arms, w_and_c: row_by_row(&w_and_c), u: row_by_row(&u) }
    }

    /// Of the whole team: W⁻ is the first column of U.
    pub fn whole(&self) -> Formation {
        let w_inverse = self.u.iter().step_by(self.arms).copied().collect();
        Formation { w_inverse, shares: vec![], counts: vec![], arms: self.arms }
    }

    pub fn generalized_force<T: Linear>(&self, tips: &[T], rows: &mut [T]) {
        multiply(&self.w_and_c, self.arms, tips, rows);
    }

    pub fn tip_forces<T: Linear>(&self, rows: &[T], tips: &mut [T]) {
        multiply(&self.u, self.arms, rows, tips);
    }

    pub fn generalized_position<T: Linear>(&self, tips: &[T], rows: &mut [T]) {
        multiply_transposed(&self.u, self.arms, tips, rows);
    }

    pub fn tip_displacements<T: Linear>(&self, rows: &[T], tips: &mut [T]) {
        multiply_transposed(&self.w_and_c, self.arms, rows, tips);
    }
}

/// `out = M x`.
fn multiply<T: Linear>(matrix: &[f64], columns: usize, x: &[T], out: &mut [T]) {
    for (row, out) in matrix.chunks_exact(columns).zip(out) {
        *out = row.iter().zip(x).fold(T::default(), |sum, (coefficient, x)| sum + *x * *coefficient);
    }
}

/// `out = Mᵀ x`.
fn multiply_transposed<T: Linear>(matrix: &[f64], columns: usize, x: &[T], out: &mut [T]) {
    out.fill(T::default());
    for (row, x) in matrix.chunks_exact(columns).zip(x) {
        for (coefficient, out) in row.iter().zip(out.iter_mut()) {
            *out = *out + *x * *coefficient;
        }
    }
}

fn check_shape(c: &[Vec<f64>], arms: usize) -> Result<(), BuildInternalForcesError> {
    use BuildInternalForcesError::{NotFinite, RowCount, RowLength, TooFewArms};
    if arms < 2 {
        return Err(TooFewArms(arms));
    }
    if c.len() != arms - 1 {
        return Err(RowCount { arms, found: c.len() });
    }
    for (coefficients, row) in c.iter().zip((1..).map(row_name)) {
        if coefficients.len() != arms {
            return Err(RowLength { row, arms, found: coefficients.len() });
        }
        if let Some((arm, &value)) = coefficients.iter().enumerate().find(|(_, value)| !value.is_finite()) {
            return Err(NotFinite { row, arm, value });
        }
    }
    Ok(())
}

/// W above C.
fn w_and_c(c: &[Vec<f64>], arms: usize) -> Mat<f64> {
    Mat::from_fn(arms, arms, |row, arm| if row == 0 { 1.0 } else { c[row - 1][arm] })
}

/// Names every row that depends on others, by column-pivoted QR of [W; C]ᵀ with its columns scaled to
/// unit norm: `[W; C]ᵀ P = Q [R₁ R₂; 0 0]`, and the rows behind R₂ are R₁⁻¹ R₂ times those behind R₁.
fn check_rank(c: &[Vec<f64>], n: usize) -> Result<(), BuildInternalForcesError> {
    let mut columns = w_and_c(c, n).transpose().to_owned();
    // faer's norm neither overflows nor vanishes where squares would.
    let norms: Vec<f64> = columns.col_iter().map(|column| column.norm_l2()).collect();
    for (mut column, norm) in columns.col_iter_mut().zip(&norms).filter(|(_, norm)| **norm > 0.0) {
        column /= faer::Scale(*norm);
    }
    let qr = columns.col_piv_qr();
    let r = qr.R();
    let rank = (0..n).take_while(|&k| r[(k, k)].abs() > RANK_TOLERANCE).count();
    if rank == n {
        return Ok(());
    }
    let order = qr.P().arrays().0;
    let mut coefficients = Mat::from_fn(rank, n - rank, |i, j| r[(i, rank + j)]);
    faer::linalg::triangular_solve::solve_upper_triangular_in_place(
        r.get(..rank, ..rank),
        coefficients.as_mut(),
        faer::Par::Seq,
    );
    let combination = |j: usize| {
        let row = order[rank + j];
        let mut combination: Vec<(usize, f64)> = (0..rank)
            .filter(|&i| coefficients[(i, j)].abs() > RANK_TOLERANCE.sqrt())
            .map(|i| (order[i], coefficients[(i, j)] * norms[row] / norms[order[i]]))
            .collect();
        combination.sort_by_key(|(other, _)| *other);
        RowCombination { row, combination }
    };
    Err(BuildInternalForcesError::DependentRows((0..n - rank).map(combination).collect()))
}
