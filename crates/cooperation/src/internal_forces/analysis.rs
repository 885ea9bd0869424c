//! Pairwise internal forces, and one set of internal forces in terms of another.

use super::InternalForces;
use crate::Linear;
use nalgebra::DMatrix;

/// G (eqs. 15, 16), ½n(n − 1) × n: one row with 1 and −1 for each pair of arms, in lexical order.
///
/// Its rank is n − 1: the pairwise forces determine each other.
pub fn pair_matrix(arms: usize) -> DMatrix<f64> {
    let pairs: Vec<_> = pairs(arms).collect();
    DMatrix::from_fn(pairs.len(), arms, |pair, arm| match pairs[pair] {
        (i, _) if i == arm => 1.0,
        (_, j) if j == arm => -1.0,
        _ => 0.0,
    })
}

/// ½ (f_bi − f_bj) of every pair of tips (eqs. 13, 14), in lexical order.
pub fn pairwise_forces<T: Linear>(tips: &[T]) -> impl Iterator<Item = ((usize, usize), T)> {
    pairs(tips.len()).map(|(i, j)| ((i, j), (tips[i] - tips[j]) * 0.5))
}

fn pairs(arms: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..arms).flat_map(move |i| (i + 1..arms).map(move |j| (i, j)))
}

/// [W; C₂] U₁, n × n: it takes h by the first set to h by the second.
///
/// Its block of rows and columns 1.. is the C₂ C₁⁻ of eq. 18. The first row is (1, 0, …); the rest of
/// the first column is C₂ W₁⁻, which eq. 18 leaves out, and which is zero where all rows of C₂ sum to
/// zero and W₁⁻ is uniform. `None` if the two are not for the same number of arms.
pub fn change_of_representation(from: &InternalForces, to: &InternalForces) -> Option<DMatrix<f64>> {
    (from.arms() == to.arms()).then(|| to.w_and_c() * from.u())
}
