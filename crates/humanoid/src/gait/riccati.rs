//! The discrete algebraic Riccati equation.

use nalgebra::{SMatrix, SVector};

/// The stabilising solution P of `P = Aᵀ P A − Aᵀ P B (R + Bᵀ P B)⁻¹ Bᵀ P A + Q` for one input.
///
/// A (N, N), B (N), Q (N, N) symmetric and positive semidefinite, R > 0. By the structure-preserving
/// doubling algorithm (Chu, Fan, Lin, Wang 2004), which doubles the horizon in each iteration and so
/// converges quadratically:
/// - Aₖ₊₁ = Aₖ (I + Gₖ Hₖ)⁻¹ Aₖ
/// - Gₖ₊₁ = Gₖ + Aₖ (I + Gₖ Hₖ)⁻¹ Gₖ Aₖᵀ, G₀ = B R⁻¹ Bᵀ
/// - Hₖ₊₁ = Hₖ + Aₖᵀ Hₖ (I + Gₖ Hₖ)⁻¹ Aₖ, H₀ = Q, H∞ = P
///
/// `None` if (A, B) can't be stabilised by this input or the numbers are not finite.
pub fn solve_discrete_riccati<const N: usize>(
    A: &SMatrix<f64, N, N>,
    B: &SVector<f64, N>,
    Q: &SMatrix<f64, N, N>,
    R: f64,
) -> Option<SMatrix<f64, N, N>> {
    // 2⁴⁰ steps are more than any horizon: what has not settled by then never will.
    const MAX_DOUBLINGS: usize = 40;
    let mut a = *A;
    let mut g = B * B.transpose() / R;
    let mut h = *Q;
    for _ in 0..MAX_DOUBLINGS {
        let w = (SMatrix::identity() + g * h).try_inverse()?;
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
        if step.norm() <= 1e-15 * h.norm() {
            return Some(h);
        }
    }
    None
}
