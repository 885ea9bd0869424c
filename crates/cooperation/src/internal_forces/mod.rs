//! Internal forces: the matrices W, C and U = [W⁻ V] = [W; C]⁻¹ (sections 2.1 to 2.3).

mod analysis;
mod dense;
mod formation;
mod split;
mod tree;

pub use analysis::{change_of_representation, pair_matrix, pairwise_forces};
pub use dense::{BuildInternalForcesError, RowCombination};
pub use formation::{FormError, Formation, FormedForces};

use crate::TeamArms;
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
    map: Map,
    whole: Formation,
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
        let splits = level_order(team);
        let tree = GroupTree::new(team.arms(), &splits);
        Self { names: names_of(&splits), whole: tree.whole(), map: Map::Tree(tree) }
    }

    /// The chain of eq. 24 and fig. 3: each robot's neighbouring arms, then robot i against robot i + 1.
    ///
    /// Groups are weighted as in [`InternalForces::balanced_tree`], which for equal ones is eqs. 20 and 21.
    pub fn chain(team: &TeamArms) -> Self {
        let arms = team.arms();
        let splits = chain(team);
        let rows: Vec<Vec<f64>> = splits.iter().map(|split| split.coefficients(arms)).collect();
        let map = DenseMap::of_full_rank(&rows, arms);
        Self { names: names_of(&splits), whole: map.whole(), map: Map::Dense(map) }
    }

    /// Any C of full rank, given by its n − 1 rows of n coefficients; the rows are called r1, r2, …
    pub fn from_matrix(rows: &[Vec<f64>], arms: usize) -> Result<Self, BuildInternalForcesError> {
        let map = DenseMap::new(rows, arms)?;
        let names = (0..arms).map(dense::row_name).collect();
        Ok(Self { names, whole: map.whole(), map: Map::Dense(map) })
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

    /// Among all arms.
    pub fn of_all(&self) -> FormedForces<'_> {
        FormedForces { forces: self, formation: &self.whole }
    }

    /// Among the arms of a formation of this team.
    pub fn among<'a>(&'a self, formation: &'a Formation) -> FormedForces<'a> {
        FormedForces { forces: self, formation }
    }

    /// All arms.
    pub fn whole(&self) -> &Formation {
        &self.whole
    }

    /// Whether the team can do without some of its arms.
    pub fn can_re_form(&self) -> bool {
        matches!(self.map, Map::Tree(_))
    }

    /// Forms the arms that take part. O(n), no allocation.
    ///
    /// # Errors
    /// There is none, or C is a matrix and one is missing. Nothing has changed.
    pub fn form(
        &self,
        takes_part: impl Fn(usize) -> bool,
        formation: &mut Formation,
    ) -> Result<(), FormError> {
        if formation.w_inverse.len() != self.arms() {
            return Err(FormError::WrongSize);
        }
        if !(0..self.arms()).any(&takes_part) {
            return Err(FormError::NoArm);
        }
        match &self.map {
            Map::Tree(tree) => tree.form(takes_part, formation),
            Map::Dense(_) if !(0..self.arms()).all(&takes_part) => return Err(FormError::NotATree),
            Map::Dense(_) => {}
        }
        Ok(())
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
        self.whole.w_inverse()
    }

    /// [W; C] (eq. 11), n × n; row 0 is W. Made on demand.
    pub fn w_and_c(&self) -> DMatrix<f64> {
        self.of_all().w_and_c()
    }

    /// C (eq. 11), (n − 1) × n. Made on demand.
    pub fn c(&self) -> DMatrix<f64> {
        self.w_and_c().remove_row(0)
    }

    /// U = [W⁻ V] (eq. 12), n × n. Made on demand.
    pub fn u(&self) -> DMatrix<f64> {
        self.of_all().u()
    }

    /// V (eq. 4), n × (n − 1). Made on demand.
    pub fn v(&self) -> DMatrix<f64> {
        self.u().remove_column(0)
    }
}

fn names_of(splits: &[Split]) -> Vec<String> {
    let object = core::iter::once(OBJECT_ROW.to_owned());
    object.chain(splits.iter().map(|split| split.name.clone())).collect()
}
