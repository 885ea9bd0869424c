//! Internal forces among some of a team's arms: W, C and their inverse when arms leave or come back.

use super::{InternalForces, Map, tree::Share};
use crate::Linear;
use nalgebra::DMatrix;

/// Which arms take part, and the coefficients of [W; C] and U = [W; C]⁻¹ for them alone. Workspace of an
/// [`InternalForces`]: what it holds is a function of the set of arms.
///
/// The tree stays, without the branches that nobody is left on: a node with left group L and right group R,
/// counting arms that take part, still gives the row `|L||R|/(|L|+|R|) · (mean of L − mean of R)`, and where one
/// group is empty it gives none. Each arm that leaves takes exactly one row with it, that of the node where it was the
/// last of its group; n' arms keep n' − 1 rows, all others mean what they meant, W⁻ is 1/n' in every block, and on
/// what is left both maps are inverse to each other as before (eqs. 6, 7, 12).
#[derive(Clone, Debug, PartialEq)]
pub struct Formation {
    pub(super) w_inverse: Vec<f64>,
    /// By node of the tree; none where C is a matrix.
    pub(super) shares: Vec<Share>,
    /// Arms that take part, by group of the tree.
    pub(super) counts: Vec<u32>,
    pub(super) arms: usize,
}

/// Why arms can't be formed. The formation is as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FormError {
    /// Nobody takes part.
    #[error("no arm takes part")]
    NoArm,
    /// C is a matrix, and nobody has said what its rows mean without some of their arms.
    #[error("internal forces that are no tree are for the whole team only")]
    NotATree,
    /// The formation is for another number of arms.
    #[error("the formation is for another team")]
    WrongSize,
}

impl Formation {
    /// Number n' of arms that take part.
    pub fn arms(&self) -> usize {
        self.arms
    }

    /// Whether an arm takes part.
    pub fn takes_part(&self, arm: usize) -> bool {
        self.counts.get(arm).is_none_or(|count| *count > 0)
    }

    /// W⁻ (eq. 6): the arms' weights in the object's position and in what they bear; 0 for those that take no part.
    pub fn w_inverse(&self) -> &[f64] {
        &self.w_inverse
    }

    /// Overwrites every number: the next [`InternalForces::form`] makes all of them anew.
    pub fn poison(&mut self) {
        // Where C is a matrix nothing is ever formed.
        if !self.counts.is_empty() {
            self.w_inverse.fill(f64::NAN);
            self.shares.fill(Share::NAN);
            self.counts.fill(u32::MAX);
        }
    }

    /// Whether there is a row: the object's, or an internal force both of whose sides have arms.
    pub fn has_row(&self, row: usize) -> bool {
        match row.checked_sub(1) {
            None => true,
            Some(_) if self.shares.is_empty() => true,
            Some(node) => self.shares.get(node).is_some_and(Share::is_split),
        }
    }
}

/// [`InternalForces`] among the arms of a [`Formation`]. Rows that there are not are read as zero and written as
/// zero; so are the wrenches of arms that take no part. As the object and rows move, such an arm's tip moves
/// with the smallest group around it that has arms.
#[derive(Clone, Copy, Debug)]
pub struct FormedForces<'a> {
    pub(super) forces: &'a InternalForces,
    pub(super) formation: &'a Formation,
}

impl FormedForces<'_> {
    /// The formation.
    pub fn formation(&self) -> &Formation {
        self.formation
    }

    /// h = [W; C] q_b (eq. 11): n rows from n tip wrenches. `work` holds [`InternalForces::work_len`].
    pub fn generalized_force<T: Linear>(&self, tips: &[T], rows: &mut [T], work: &mut [T]) {
        match &self.forces.map {
            Map::Tree(tree) => tree.generalized_force(self.formation, tips, rows, work),
            Map::Dense(dense) => dense.generalized_force(tips, rows),
        }
    }

    /// q_b = U h (eq. 7), the inverse of [`FormedForces::generalized_force`].
    pub fn tip_forces<T: Linear>(&self, rows: &[T], tips: &mut [T], work: &mut [T]) {
        match &self.forces.map {
            Map::Tree(tree) => tree.tip_forces(self.formation, rows, tips, work),
            Map::Dense(dense) => dense.tip_forces(rows, tips),
        }
    }

    /// z = Uᵀ y_b (eq. 27): n rows from n tip positions.
    pub fn generalized_position<T: Linear>(&self, tips: &[T], rows: &mut [T], work: &mut [T]) {
        match &self.forces.map {
            Map::Tree(tree) => tree.generalized_position(self.formation, tips, rows, work),
            Map::Dense(dense) => dense.generalized_position(tips, rows),
        }
    }

    /// δy_b = [W; C]ᵀ δz, the inverse of eq. 27 and the dual of eq. 11: `h · δz = q_b · δy_b`.
    pub fn tip_displacements<T: Linear>(&self, rows: &[T], tips: &mut [T], work: &mut [T]) {
        match &self.forces.map {
            Map::Tree(tree) => tree.tip_displacements(self.formation, rows, tips, work),
            Map::Dense(dense) => dense.tip_displacements(rows, tips),
        }
    }

    /// [W; C] (eq. 11), n × n, with zeros where there is no row or no arm. Made on demand.
    pub fn w_and_c(&self) -> DMatrix<f64> {
        self.columns(|unit, out, work| self.generalized_force(unit, out, work))
    }

    /// U = [W⁻ V] (eq. 12), n × n, with zeros likewise. Made on demand.
    pub fn u(&self) -> DMatrix<f64> {
        self.columns(|unit, out, work| self.tip_forces(unit, out, work))
    }

    /// The matrix of a map, by its action on unit vectors.
    fn columns(&self, map: impl Fn(&[f64], &mut [f64], &mut [f64])) -> DMatrix<f64> {
        let n = self.forces.arms();
        let mut matrix = DMatrix::zeros(n, n);
        let (mut unit, mut work) = (vec![0.0; n], vec![0.0; self.forces.work_len()]);
        for column in 0..n {
            unit[column] = 1.0;
            map(&unit, matrix.column_mut(column).as_mut_slice(), &mut work);
            unit[column] = 0.0;
        }
        matrix
    }
}
