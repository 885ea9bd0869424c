//! The rows of one task of eq. 41, and what they add to the normal equations.

use super::bounded_quadratic::BoundedQuadratic;
use crate::model::MAX_JOINTS;
use nalgebra::{Vector3, Vector6};

/// Columns that are computed at once: as many as registers of any processor take in.
const LANES: usize = 4;

/// A row over the columns that a task has.
type Row = [[f64; LANES]; MAX_JOINTS / LANES];

/// The Jacobian of a task, without the columns of joints that have no part in it, row by row: what is added up runs
/// over joints, each by itself. Past the last column is nothing.
#[derive(Clone, Debug)]
pub(super) struct TaskRows {
    /// The joint of each column, in ascending order.
    joints: [usize; MAX_JOINTS],
    columns: usize,
    jacobian: [Row; 6],
    /// W J, of the rows that have a weight.
    weighted: [Row; 6],
}

impl Default for TaskRows {
    fn default() -> Self {
        let rows = [[[0.0; LANES]; MAX_JOINTS / LANES]; 6];
        Self { joints: [0; MAX_JOINTS], columns: 0, jacobian: rows, weighted: rows }
    }
}

impl TaskRows {
    pub fn fill_with_nan(&mut self) {
        let rows = [[[f64::NAN; LANES]; MAX_JOINTS / LANES]; 6];
        *self =
            Self { joints: [usize::MAX; MAX_JOINTS], columns: usize::MAX, jacobian: rows, weighted: rows };
    }

    /// Of a frame: the joints that move it, and how.
    pub fn pose(&mut self, columns: impl Iterator<Item = (usize, Vector6<f64>)>) {
        self.columns = 0;
        for (k, (joint, column)) in columns.take(MAX_JOINTS).enumerate() {
            self.joints[k] = joint;
            for (row, value) in self.jacobian.iter_mut().zip(column.iter()) {
                row.as_flattened_mut()[k] = *value;
            }
            self.columns = k + 1;
        }
    }

    /// Of a point that all joints move.
    pub fn pose_linear(&mut self, columns: impl Iterator<Item = Vector3<f64>>) {
        self.columns = 0;
        for (k, column) in columns.take(MAX_JOINTS).enumerate() {
            self.joints[k] = k;
            for (row, value) in self.jacobian.iter_mut().zip(column.iter()) {
                row.as_flattened_mut()[k] = *value;
            }
            self.columns = k + 1;
        }
    }

    /// Adds Jᵀ W J and Jᵀ W e, for the weights of linear and angular rows.
    pub fn add_to(&mut self, program: &mut BoundedQuadratic, weight: [f64; 2], error: &[f64; 6]) {
        let [linear, angular] = weight;
        let [x, y, z, rx, ry, rz] = *error;
        if angular == 0.0 {
            self.add_rows(program, 0, [linear; 3], [x, y, z]);
        } else if linear == 0.0 {
            self.add_rows(program, 3, [angular; 3], [rx, ry, rz]);
        } else {
            self.add_rows(program, 0, [linear, linear, linear, angular, angular, angular], *error);
        }
    }

    /// The same for R rows from the `first` on.
    fn add_rows<const R: usize>(
        &mut self,
        program: &mut BoundedQuadratic,
        first: usize,
        weight: [f64; R],
        error: [f64; R],
    ) {
        let columns = self.columns.min(MAX_JOINTS);
        let Some(jacobian) = self.jacobian.get(first..first + R) else { return };
        let chunks = columns.div_ceil(LANES);
        for ((weighted, row), w) in self.weighted.iter_mut().zip(jacobian).zip(weight) {
            for (weighted, row) in weighted.iter_mut().zip(row).take(chunks) {
                *weighted = row.map(|value| value * w);
            }
        }
        let weighted: [&Row; R] = core::array::from_fn(|row| &self.weighted[row]);
        let joints = &self.joints[..columns];

        let mut sums: Row = [[0.0; LANES]; MAX_JOINTS / LANES];
        dot(&weighted, &error, 0..chunks, &mut sums);
        for (&j, sum) in joints.iter().zip(sums.as_flattened()) {
            program.linear[j] += sum;
        }
        let n = program.hessian.nrows();
        let matrix = program.hessian.as_mut_slice();
        for (k, &j) in joints.iter().enumerate() {
            let column: [f64; R] = core::array::from_fn(|row| jacobian[row].as_flattened()[k]);
            dot(&weighted, &column, k / LANES..chunks, &mut sums);
            let target = &mut matrix[j * n..(j + 1) * n];
            for (&i, sum) in joints[k..].iter().zip(&sums.as_flattened()[k..]) {
                target[i] += sum;
            }
        }
    }

    /// Adds to the diagonal the length of each column's linear and angular half, `factor` times.
    pub fn add_damping(&self, program: &mut BoundedQuadratic, factor: [f64; 2]) {
        for (k, &j) in self.joints[..self.columns.min(MAX_JOINTS)].iter().enumerate() {
            let half =
                |first: usize| Vector3::from_fn(|row, _| self.jacobian[first + row].as_flattened()[k]).norm();
            program.hessian[(j, j)] += factor[0] * half(0) + factor[1] * half(3);
        }
    }
}

/// For each column of these chunks the sum of its entries, each times its row's factor.
#[inline(always)]
fn dot<const R: usize>(
    rows: &[&Row; R],
    factors: &[f64; R],
    chunks: core::ops::Range<usize>,
    sums: &mut Row,
) {
    for chunk in chunks {
        let mut sum = [0.0; LANES];
        for (row, factor) in rows.iter().zip(factors) {
            for (sum, value) in sum.iter_mut().zip(&row[chunk]) {
                *sum += value * factor;
            }
        }
        sums[chunk] = sum;
    }
}
