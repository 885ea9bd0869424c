//! Strictly convex quadratic programs in a box, solved by an active set without allocation.

use crate::kinematics::joints_of;
use crate::model::MAX_JOINTS;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// The program has no solution: its matrix is not positive definite, or something is not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SolveQuadraticError;

/// Variables held at a bound.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct ActiveSet {
    pub lower: u64,
    pub upper: u64,
}

/// Minimize ½ xᵀ H x − gᵀ x within `lower` ≤ x ≤ `upper`, for n ≤ 64 variables.
#[derive(Clone, Debug)]
pub(super) struct BoundedQuadratic {
    /// H, of which only the lower triangle is read.
    pub hessian: DMatrix<f64>,
    pub linear: [f64; MAX_JOINTS],
    pub lower: [f64; MAX_JOINTS],
    pub upper: [f64; MAX_JOINTS],
    pub solution: [f64; MAX_JOINTS],
    factor: DMatrix<f64>,
    free: [usize; MAX_JOINTS],
    candidate: [f64; MAX_JOINTS],
}

impl BoundedQuadratic {
    pub fn new(n: usize) -> Self {
        Self {
            hessian: DMatrix::zeros(n, n),
            linear: [0.0; MAX_JOINTS],
            lower: [0.0; MAX_JOINTS],
            upper: [0.0; MAX_JOINTS],
            solution: [0.0; MAX_JOINTS],
            factor: DMatrix::zeros(n, n),
            free: [0; MAX_JOINTS],
            candidate: [0.0; MAX_JOINTS],
        }
    }

    pub fn fill_with_nan(&mut self) {
        self.hessian.fill(f64::NAN);
        self.factor.fill(f64::NAN);
        self.free.fill(usize::MAX);
        for values in
            [&mut self.linear, &mut self.lower, &mut self.upper, &mut self.solution, &mut self.candidate]
        {
            values.fill(f64::NAN);
        }
    }

    /// Writes `solution`. `active` is where to start, and becomes the set at the solution: from one tick
    /// to the next it hardly changes, and then one factorization suffices.
    ///
    /// The primal active-set method (Nocedal and Wright, Numerical Optimization, algorithm 16.3) with
    /// bounds as the only constraints. Each pass solves for the free variables, then either goes there,
    /// or as far as the first bound, or releases the bound that is most in the way. The number of
    /// passes is limited; what the limit leaves is feasible and no worse than the start.
    pub fn minimize(&mut self, active: &mut ActiveSet) -> Result<(), SolveQuadraticError> {
        let n = self.hessian.nrows();
        // Where every variable stands at a bound no factorization would notice.
        if self.linear[..n].iter().any(|value| !value.is_finite()) {
            return Err(SolveQuadraticError);
        }
        active.upper &= !active.lower;
        for i in 0..n {
            self.solution[i] = if active.lower >> i & 1 == 1 {
                self.lower[i]
            } else if active.upper >> i & 1 == 1 {
                self.upper[i]
            } else {
                self.lower[i].max(0.0).min(self.upper[i])
            };
        }
        for _ in 0..4 * n + 4 {
            self.solve_free(*active)?;
            match self.first_bound(*active) {
                Some((i, fraction)) => {
                    for j in joints_of(!(active.lower | active.upper) & mask(n)) {
                        self.solution[j] += fraction * (self.candidate[j] - self.solution[j]);
                    }
                    let is_lower = self.candidate[i] < self.lower[i];
                    let (set, bound) = if is_lower {
                        (&mut active.lower, self.lower[i])
                    } else {
                        (&mut active.upper, self.upper[i])
                    };
                    *set |= 1 << i;
                    self.solution[i] = bound;
                }
                None => {
                    for j in joints_of(!(active.lower | active.upper) & mask(n)) {
                        self.solution[j] = self.candidate[j];
                    }
                    match self.most_obstructive_bound(*active) {
                        Some(i) => {
                            active.lower &= !(1 << i);
                            active.upper &= !(1 << i);
                        }
                        None => return Ok(()),
                    }
                }
            }
        }
        Ok(())
    }

    /// `candidate`: the minimum over the free variables, the others at their bounds.
    fn solve_free(&mut self, active: ActiveSet) -> Result<(), SolveQuadraticError> {
        let n = self.hessian.nrows();
        let fixed = active.lower | active.upper;
        let mut m = 0;
        for i in joints_of(!fixed & mask(n)) {
            self.free[m] = i;
            m += 1;
        }
        let free = &self.free[..m];
        for (column, &j) in free.iter().enumerate() {
            let (from, to) = (j * n..(j + 1) * n, column * n..column * n + m);
            let from = &self.hessian.as_slice()[from];
            let to = &mut self.factor.as_mut_slice()[to];
            for (value, &i) in to[column..].iter_mut().zip(&free[column..]) {
                *value = from[i];
            }
            let at_bounds: f64 = joints_of(fixed).map(|k| self.entry(j, k) * self.solution[k]).sum();
            self.candidate[column] = self.linear[j] - at_bounds;
        }
        cholesky_solve(self.factor.as_mut_slice(), n, &mut self.candidate[..m])?;
        // From positions in the list of free variables to the variables: backwards, for none lies before
        // its position.
        for column in (0..m).rev() {
            self.candidate[self.free[column]] = self.candidate[column];
        }
        Ok(())
    }

    /// The free variable that meets a bound first on the way to the candidate, and after which
    /// fraction of that way.
    fn first_bound(&self, active: ActiveSet) -> Option<(usize, f64)> {
        let mut first = None;
        let mut smallest = 1.0;
        for i in joints_of(!(active.lower | active.upper) & mask(self.hessian.nrows())) {
            let (from, to) = (self.solution[i], self.candidate[i]);
            let bound = to.max(self.lower[i]).min(self.upper[i]);
            if bound != to {
                let fraction = ((bound - from) / (to - from)).clamp(0.0, 1.0);
                if fraction < smallest || first.is_none() {
                    (first, smallest) = (Some((i, fraction)), fraction);
                }
            }
        }
        first
    }

    /// The variable at a bound that the objective pulls away from it the most.
    fn most_obstructive_bound(&self, active: ActiveSet) -> Option<usize> {
        /// Pulls below this are rounding.
        const TOLERANCE: f64 = 1e-9;
        let n = self.hessian.nrows();
        let mut most = (None, TOLERANCE);
        for i in joints_of((active.lower | active.upper) & mask(n)) {
            if self.lower[i] >= self.upper[i] {
                continue; // no room to be released into
            }
            let descent: f64 =
                self.linear[i] - (0..n).map(|k| self.entry(i, k) * self.solution[k]).sum::<f64>();
            let inwards = if active.lower >> i & 1 == 1 { descent } else { -descent };
            if inwards > most.1 {
                most = (Some(i), inwards);
            }
        }
        most.0
    }

    fn entry(&self, i: usize, j: usize) -> f64 {
        self.hessian[(i.max(j), i.min(j))]
    }
}

/// The set of the first n variables.
fn mask(n: usize) -> u64 {
    if n >= MAX_JOINTS { u64::MAX } else { (1 << n) - 1 }
}

/// Solves A x = b in place for symmetric positive definite A, given by its lower triangle in the leading
/// rows and columns of a column-major matrix of `stride` rows; the size is b's. By columns, so that the
/// inner loops run over independent entries.
fn cholesky_solve(a: &mut [f64], stride: usize, b: &mut [f64]) -> Result<(), SolveQuadraticError> {
    let m = b.len();
    for k in 0..m {
        let (left, right) = a.split_at_mut(k * stride);
        let column = &mut right[k..m];
        subtract_outer_products(left, stride, k, column);
        let pivot = column[0];
        // Written so that NaN fails as well.
        if !(pivot > 0.0 && pivot < f64::INFINITY) {
            return Err(SolveQuadraticError);
        }
        let scale = 1.0 / pivot.sqrt();
        column.iter_mut().for_each(|value| *value *= scale);
        let solved = b[k] / column[0];
        b[k] = solved;
        for (value, l) in b[k + 1..].iter_mut().zip(&column[1..]) {
            *value -= solved * l;
        }
    }
    for k in (0..m).rev() {
        let column = &a[k * stride..k * stride + m];
        let known: f64 = b[k + 1..].iter().zip(&column[k + 1..]).map(|(x, l)| x * l).sum();
        b[k] = (b[k] - known) / column[k];
    }
    Ok(())
}

/// Subtracts from the entries of column k, from the diagonal down, what the columns to its left make of them, one
/// column after the other: four at a time, so that an entry is fetched and put back a quarter as often.
fn subtract_outer_products(left: &[f64], stride: usize, k: usize, column: &mut [f64]) {
    let mut fours = left.chunks_exact(4 * stride);
    let size = column.len();
    for four in fours.by_ref() {
        let part = |index: usize| &four[index * stride + k..index * stride + k + size];
        let (l0, l1, l2, l3) = (part(0), part(1), part(2), part(3));
        let (f0, f1, f2, f3) = (l0[0], l1[0], l2[0], l3[0]);
        for ((((value, l0), l1), l2), l3) in column.iter_mut().zip(l0).zip(l1).zip(l2).zip(l3) {
            *value = *value - f0 * l0 - f1 * l1 - f2 * l2 - f3 * l3;
        }
    }
    for one in fours.remainder().chunks_exact(stride) {
        let l = &one[k..k + size];
        let factor = l[0];
        for (value, l) in column.iter_mut().zip(l) {
            *value -= factor * l;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;
    use proptest::prelude::*;

    fn program(n: usize, seed: &[f64], width: f64) -> BoundedQuadratic {
        let mut next = seed.iter().copied().cycle();
        let root = DMatrix::from_fn(n, n, |i, j| next.next().unwrap() + f64::from(u8::from(i == j)));
        let mut program = BoundedQuadratic::new(n);
        program.fill_with_nan();
        program.hessian = &root * root.transpose() + DMatrix::identity(n, n) * 1e-3;
        for i in 0..n {
            program.linear[i] = 3.0 * next.next().unwrap();
            let middle = 0.2 * next.next().unwrap();
            (program.lower[i], program.upper[i]) = (middle - width, middle + width);
        }
        program
    }

    /// The conditions that are necessary and, for a convex program, sufficient: gradient zero where the
    /// variable is free, and pushing outwards where it stands at a bound.
    fn assert_optimal(program: &BoundedQuadratic) {
        let n = program.hessian.nrows();
        let x = DVector::from_column_slice(&program.solution[..n]);
        let descent = DVector::from_column_slice(&program.linear[..n]) - &program.hessian * &x;
        for i in 0..n {
            let (lower, upper) = (program.lower[i], program.upper[i]);
            assert!(lower <= x[i] && x[i] <= upper, "{i}: {lower} {} {upper}", x[i]);
            if x[i] > lower {
                assert!(descent[i] > -1e-7, "{i} at {}: descent {}", x[i], descent[i]);
            }
            if x[i] < upper {
                assert!(descent[i] < 1e-7, "{i} at {}: descent {}", x[i], descent[i]);
            }
        }
    }

    proptest! {
        #[test]
        fn the_solution_is_optimal_from_any_start(
            n in 1usize..12,
            seed in prop::collection::vec(-1.0f64..1.0, 200),
            width in 1e-3f64..1.0,
            start in any::<[u64; 2]>(),
        ) {
            let mut program = program(n, &seed, width);
            let mut active = ActiveSet { lower: start[0] & mask(n), upper: start[1] & mask(n) };
            program.minimize(&mut active).unwrap();
            assert_optimal(&program);
        }

        #[test]
        fn a_start_at_the_solutions_own_active_set_gives_the_same_solution(
            seed in prop::collection::vec(-1.0f64..1.0, 200),
        ) {
            let mut program = program(9, &seed, 0.1);
            let mut active = ActiveSet::default();
            program.minimize(&mut active).unwrap();
            let (solution, set) = (program.solution, active);
            program.minimize(&mut active).unwrap();
            prop_assert_eq!(active, set);
            for (again, first) in program.solution[..9].iter().zip(&solution) {
                prop_assert!((again - first).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_program_of_64_variables_is_solved() {
        let seed: Vec<f64> = (0..6000).map(|i| (f64::from(i) * 0.77).sin() * 0.3).collect();
        let mut program = program(64, &seed, 0.3);
        program.minimize(&mut ActiveSet::default()).unwrap();
        assert_optimal(&program);
    }

    #[test]
    fn a_variable_without_room_stays_where_it_is() {
        let mut program = program(3, &[0.3, -0.2, 0.9, 0.4, -0.7], 1.0);
        (program.lower[1], program.upper[1]) = (0.05, 0.05);
        program.minimize(&mut ActiveSet::default()).unwrap();
        assert_eq!(program.solution[1], 0.05);
    }

    #[test]
    fn what_is_not_a_number_is_an_error() {
        let mut program = program(3, &[0.3, -0.2, 0.9, 0.4, -0.7], 1.0);
        program.hessian[(2, 1)] = f64::NAN;
        assert_eq!(program.minimize(&mut ActiveSet::default()), Err(SolveQuadraticError));

        let mut program = self::program(3, &[0.3, -0.2, 0.9, 0.4, -0.7], 1.0);
        program.linear[1] = f64::NAN;
        let mut all_at_bounds = ActiveSet { lower: mask(3), upper: 0 };
        assert_eq!(program.minimize(&mut all_at_bounds), Err(SolveQuadraticError));
    }
}
