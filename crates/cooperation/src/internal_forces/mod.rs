//! Internal forces: the matrices W, C and U = [W⁻ V] = [W; C]⁻¹ (sections 2.1 to 2.3).

mod analysis;
mod dense;
mod split;
mod tree;

pub use analysis::{change_of_representation, pair_matrix, pairwise_forces};
pub use dense::{BuildInternalForcesError, RowCombination};

use crate::{Linear, TeamArms};
use dense::DenseMap;
use nalgebra::DMatrix;
use split::{Split, chain, level_order};
use tree::GroupTree;

/// The name of row 0.
pub const OBJECT_ROW: &str = "object";

/// Which internal forces describe the team's grasp: the coefficients of C, with the inverse of [W; C].
///
/// All blocks are multiples of I₆: the n × n scalar matrices act on six-vectors, scalars or whatever is
/// [`Linear`]. Applying them allocates nothing; a tree costs O(n), any other C costs O(n²).
#[derive(Clone, Debug)]
pub struct InternalForces {
    names: Vec<String>,
    w_inverse: Vec<f64>,
    map: Map,
}

#[derive(Clone, Debug)]
enum Map {
    Tree(GroupTree),
    Dense(DenseMap),
}

impl InternalForces {
    /// A balanced tree over the robots and, in each robot, over its arms, in level order.
    ///
    /// A node with left group L and right group R, counting arms, gives the row
    /// `|L||R|/(|L|+|R|) · (mean of L − mean of R)`. For equal groups that is eqs. 20, 21 and 43; for
    /// unequal ones it keeps every block of W⁻ at 1/n, so the object's motion is the mean of the tips'.
    pub fn balanced_tree(team: &TeamArms) -> Self {
        let arms = team.arms();
        let splits = level_order(team);
        Self {
            names: names_of(&splits),
            w_inverse: vec![1.0 / arms as f64; arms],
            map: Map::Tree(GroupTree::new(arms, &splits)),
        }
    }

    /// The chain of eq. 24 and fig. 3: each robot's neighbouring arms, then robot i against robot i + 1.
    ///
    /// Groups are weighted as in [`InternalForces::balanced_tree`], which for equal ones is eqs. 20 and 21.
    pub fn chain(team: &TeamArms) -> Self {
        let arms = team.arms();
        let splits = chain(team);
        let rows: Vec<Vec<f64>> = splits.iter().map(|split| split.coefficients(arms)).collect();
        let map = DenseMap::of_full_rank(&rows, arms);
        Self { names: names_of(&splits), w_inverse: map.w_inverse(), map: Map::Dense(map) }
    }

    /// Any C of full rank, given by its n − 1 rows of n coefficients; the rows are called r1, r2, …
    pub fn from_matrix(rows: &[Vec<f64>], arms: usize) -> Result<Self, BuildInternalForcesError> {
        let map = DenseMap::new(rows, arms)?;
        let names = (0..arms).map(dense::row_name).collect();
        Ok(Self { names, w_inverse: map.w_inverse(), map: Map::Dense(map) })
    }

    /// Number n of arms, and of rows.
    pub fn arms(&self) -> usize {
        self.names.len()
    }

    /// Names of the rows, `object` first: `AB|CD`, `A|B`, `A.right|A.left`.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The row of this name.
    pub fn row(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }

    /// h = [W; C] q_b (eq. 11): n rows from n tip wrenches. `work` holds [`InternalForces::work_len`].
    pub fn generalized_force<T: Linear>(&self, tips: &[T], rows: &mut [T], work: &mut [T]) {
        match &self.map {
            Map::Tree(tree) => tree.generalized_force(tips, rows, work),
            Map::Dense(dense) => dense.generalized_force(tips, rows),
        }
    }

    /// q_b = U h (eq. 7), the inverse of [`InternalForces::generalized_force`].
    pub fn tip_forces<T: Linear>(&self, rows: &[T], tips: &mut [T], work: &mut [T]) {
        match &self.map {
            Map::Tree(tree) => tree.tip_forces(rows, tips, work),
            Map::Dense(dense) => dense.tip_forces(rows, tips),
        }
    }

    /// z = Uᵀ y_b (eq. 27): n rows from n tip positions.
    pub fn generalized_position<T: Linear>(&self, tips: &[T], rows: &mut [T], work: &mut [T]) {
        match &self.map {
            Map::Tree(tree) => tree.generalized_position(tips, rows, work),
            Map::Dense(dense) => dense.generalized_position(tips, rows),
        }
    }

    /// δy_b = [W; C]ᵀ δz, the inverse of eq. 27 and the dual of eq. 11: `h · δz = q_b · δy_b`.
    pub fn tip_displacements<T: Linear>(&self, rows: &[T], tips: &mut [T], work: &mut [T]) {
        match &self.map {
            Map::Tree(tree) => tree.tip_displacements(rows, tips, work),
            Map::Dense(dense) => dense.tip_displacements(rows, tips),
        }
    }

    /// Elements of `work` that the four maps need.
    pub fn work_len(&self) -> usize {
        match &self.map {
            Map::Tree(tree) => tree.work_len(),
            Map::Dense(_) => 0,
        }
    }

    /// W⁻ (eq. 6): n weights, of sum one, with which the tips make up the object's position.
    pub fn w_inverse(&self) -> &[f64] {
        &self.w_inverse
    }

    /// [W; C] (eq. 11), n × n; row 0 is W. Made on demand.
    pub fn w_and_c(&self) -> DMatrix<f64> {
        self.columns(Self::generalized_force)
    }

    /// C (eq. 11), (n − 1) × n. Made on demand.
    pub fn c(&self) -> DMatrix<f64> {
        self.w_and_c().remove_row(0)
    }

    /// U = [W⁻ V] (eq. 12), n × n. Made on demand.
    pub fn u(&self) -> DMatrix<f64> {
        self.columns(Self::tip_forces)
    }

    /// V (eq. 4), n × (n − 1). Made on demand.
    pub fn v(&self) -> DMatrix<f64> {
        self.u().remove_column(0)
    }

    /// The matrix of a map, by its action on unit vectors.
    fn columns(&self, map: impl Fn(&Self, &[f64], &mut [f64], &mut [f64])) -> DMatrix<f64> {
        let n = self.arms();
        let mut matrix = DMatrix::zeros(n, n);
        let (mut unit, mut work) = (vec![0.0; n], vec![0.0; self.work_len()]);
        for column in 0..n {
            unit[column] = 1.0;
            map(self, &unit, matrix.column_mut(column).as_mut_slice(), &mut work);
            unit[column] = 0.0;
        }
        matrix
    }
}

fn names_of(splits: &[Split]) -> Vec<String> {
    let object = core::iter::once(OBJECT_ROW.to_owned());
    object.chain(splits.iter().map(|split| split.name.clone())).collect()
}
