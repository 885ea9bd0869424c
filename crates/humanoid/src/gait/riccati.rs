//! The discrete algebraic Riccati equation.

use nalgebra::{Const, DimMin, RowSVector, SMatrix, SVector};

/// 2⁴⁰ steps are more than any horizon: what has not settled by then never will.
const MAX_DOUBLINGS: usize = 40;

/// The stabilising solution P of `P = Aᵀ P A − Aᵀ P B (R + Bᵀ P B)⁻¹ Bᵀ P A + Q` for one input.
///
/// A (N, N), B (N), Q (N, N) symmetric and positive semidefinite, R > 0. By the structure-preserving
/// doubling algorithm (Chu, Fan, Lin, Wang 2004), which doubles the horizon in each iteration and so
/// converges quadratically:
/// - Aₖ₊₁ = Aₖ (I + Gₖ Hₖ)⁻¹ Aₖ
/// - Gₖ₊₁ = Gₖ + Aₖ (I + Gₖ Hₖ)⁻¹ Gₖ Aₖᵀ, G₀ = B R⁻¹ Bᵀ
/// - Hₖ₊₁ = Hₖ + Aₖᵀ Hₖ (I + Gₖ Hₖ)⁻¹ Aₖ, H₀ = Q, H∞ = P
///
/// then by Newton's method (Kleinman), which sums only positive terms and takes away what rounding the
/// inverses left: I + G H is badly conditioned where R is small.
///
/// `None` if (A, B) can't be stabilised by this input or the numbers are not finite.
pub fn solve_discrete_riccati<const N: usize>(
    A: &SMatrix<f64, N, N>,
    B: &SVector<f64, N>,
    Q: &SMatrix<f64, N, N>,
    R: f64,
) -> Option<SMatrix<f64, N, N>>
where
    Const<N>: DimMin<Const<N>, Output = Const<N>>,
{
    let mut p = doubled(A, B, Q, R)?;
    for _ in 0..3 {
        let gain = feedback_gain(A, B, &p, R);
        p = cost_to_go(A - B * gain, Q + gain.transpose() * gain * R)?;
    }
    Some(p)
}

/// K = (R + Bᵀ P B)⁻¹ Bᵀ P A, a row of N: u = −K x.
pub(super) fn feedback_gain<const N: usize>(
    A: &SMatrix<f64, N, N>,
    B: &SVector<f64, N>,
    P: &SMatrix<f64, N, N>,
    R: f64,
) -> RowSVector<f64, N> {
    B.transpose() * P * A / (R + B.dot(&(P * B)))
}

fn doubled<const N: usize>(
    A: &SMatrix<f64, N, N>,
    B: &SVector<f64, N>,
    Q: &SMatrix<f64, N, N>,
    R: f64,
) -> Option<SMatrix<f64, N, N>>
where
    Const<N>: DimMin<Const<N>, Output = Const<N>>,
{
    let mut a = *A;
    let mut g = B * B.transpose() / R;
    let mut h = *Q;
    for _ in 0..MAX_DOUBLINGS {
        let w = (SMatrix::identity() + g * h).lu().try_inverse()?;
        let step = a.transpose() * h * w * a;
        g += a * w * g * a.transpose();
        h += step;
        // The recursion keeps both symmetric but for rounding, which would grow.
        g = (g + g.transpose()) * 0.5;
        h = (h + h.transpose()) * 0.5;
        a = a * w * a;
        if !h.iter().all(|value| value.is_finite()) {
            return None;
        }
        // a is the closed loop's transition over the horizon: it dies out if and only if that is stable.
        if step.norm() <= 1e-12 * h.norm() && a.norm() < 1e-6 {
            return Some(h);
        }
    }
    None
}

/// Σ (Aᵀ)ⁱ Q Aⁱ over all i ≥ 0, by doubling; `None` unless A is stable.
fn cost_to_go<const N: usize>(
    mut a: SMatrix<f64, N, N>,
    mut sum: SMatrix<f64, N, N>,
) -> Option<SMatrix<f64, N, N>> {
    for _ in 0..MAX_DOUBLINGS {
        let step = a.transpose() * sum * a;
        sum += step;
        a *= a;
        if step.norm() <= 1e-17 * sum.norm() {
            return sum.iter().all(|value| value.is_finite()).then_some(sum);
        }
    }
    None
}
