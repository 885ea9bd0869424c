//! Internal forces as a tree of groups, applied in O(n).

use super::formation::Formation;
use super::split::Split;
use crate::Linear;
use std::collections::HashMap;

/// A binary tree whose leaves are the arms and whose inner nodes are the rows 1 to n − 1.
///
/// A *group* is a leaf or a node: groups 0 to n − 1 are the arms, group n + k is node k. Node 0 is the
/// root, and children come after their parents, so a sweep up goes backwards over the nodes.
#[derive(Clone, Debug)]
pub(super) struct GroupTree {
    arms: usize,
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    left: usize,
    right: usize,
}

/// How the arms of a node are dealt out to its two groups.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Share {
    /// |L| / (|L| + |R|).
    left: f64,
    /// |R| / (|L| + |R|).
    right: f64,
}

impl Share {
    pub const NAN: Self = Self { left: f64::NAN, right: f64::NAN };

    /// Both groups have arms, so that there is a force between them.
    pub fn is_split(&self) -> bool {
        self.left > 0.0 && self.right > 0.0
    }

    fn of_row<T: Linear>(&self, row: T) -> T {
        if self.is_split() { row } else { T::default() }
    }
}

impl GroupTree {
    /// From splits that form a tree, parents first.
    pub fn new(arms: usize, splits: &[Split]) -> Self {
        let span = |split: &Split| (split.left.start, split.right.end);
        let leaves = (0..arms).map(|arm| ((arm, arm + 1), arm));
        let groups: HashMap<_, _> =
            leaves.chain(splits.iter().enumerate().map(|(k, split)| (span(split), arms + k))).collect();
        let node = |split: &Split| Node {
            left: groups[&(split.left.start, split.left.end)],
            right: groups[&(split.right.start, split.right.end)],
        };
        Self { arms, nodes: splits.iter().map(node).collect() }
    }

    pub fn work_len(&self) -> usize {
        self.arms + self.nodes.len()
    }

    /// Of the whole team.
    pub fn whole(&self) -> Formation {
        let mut formation = Formation {
            w_inverse: vec![0.0; self.arms],
            shares: vec![Share::default(); self.nodes.len()],
            counts: vec![0; self.work_len()],
            arms: 0,
        };
        self.form(|_| true, &mut formation);
        formation
    }

    /// Upwards, numbers of arms. Whoever takes part bears 1/n'.
    pub fn form(&self, takes_part: impl Fn(usize) -> bool, formation: &mut Formation) {
        let Formation { w_inverse, shares, counts, arms } = formation;
        for (arm, count) in counts.iter_mut().enumerate().take(self.arms) {
            *count = u32::from(takes_part(arm));
        }
        for ((k, node), share) in self.nodes.iter().enumerate().zip(shares).rev() {
            let (left, right) = (get(counts, node.left), get(counts, node.right));
            let both = f64::from((left + right).max(1));
            *share = Share { left: f64::from(left) / both, right: f64::from(right) / both };
            set(counts, self.arms + k, left + right);
        }
        let all = get(counts, self.arms);
        *arms = all as usize;
        for (weight, count) in w_inverse.iter_mut().zip(counts.iter()) {
            *weight = f64::from(*count) / f64::from(all.max(1));
        }
    }

    /// Upwards, sums of groups: a row is `right share · sum of L − left share · sum of R`.
    pub fn generalized_force<T: Linear>(
        &self,
        formation: &Formation,
        tips: &[T],
        rows: &mut [T],
        sums: &mut [T],
    ) {
        self.sweep_up(formation, tips, rows, sums, |share, left, right| {
            (left + right, left * share.right - right * share.left)
        });
    }

    /// Upwards, means of groups: a row is `mean of L − mean of R`.
    pub fn generalized_position<T: Linear>(
        &self,
        formation: &Formation,
        tips: &[T],
        rows: &mut [T],
        means: &mut [T],
    ) {
        self.sweep_up(formation, tips, rows, means, |share, left, right| {
            (left * share.left + right * share.right, share.of_row(left - right))
        });
    }

    /// Downwards, sums of groups: the inverse of [`GroupTree::generalized_force`].
    pub fn tip_forces<T: Linear>(&self, formation: &Formation, rows: &[T], tips: &mut [T], sums: &mut [T]) {
        self.sweep_down(formation, rows, tips, sums, |share, sum, row| {
            (sum * share.left + row, sum * share.right - row)
        });
    }

    /// Downwards, means of groups: the inverse of [`GroupTree::generalized_position`].
    pub fn tip_displacements<T: Linear>(
        &self,
        formation: &Formation,
        rows: &[T],
        tips: &mut [T],
        means: &mut [T],
    ) {
        self.sweep_down(formation, rows, tips, means, |share, mean, row| {
            (mean + row * share.right, mean - row * share.left)
        });
    }

    /// `merge(share, left, right)` gives the node's own value and its row; row 0 is the root's value.
    fn sweep_up<T: Linear>(
        &self,
        formation: &Formation,
        tips: &[T],
        rows: &mut [T],
        groups: &mut [T],
        merge: impl Fn(&Share, T, T) -> (T, T),
    ) {
        for ((leaf, tip), count) in groups.iter_mut().zip(tips).zip(&formation.counts) {
            *leaf = if *count > 0 { *tip } else { T::default() };
        }
        for ((k, node), share) in self.nodes.iter().enumerate().zip(&formation.shares).rev() {
            let (value, row) = merge(share, get(groups, node.left), get(groups, node.right));
            set(groups, self.arms + k, value);
            set(rows, 1 + k, row);
        }
        set(rows, 0, get(groups, self.arms));
    }

    /// `divide(share, value, row)` gives the values of the node's left and right group.
    fn sweep_down<T: Linear>(
        &self,
        formation: &Formation,
        rows: &[T],
        tips: &mut [T],
        groups: &mut [T],
        divide: impl Fn(&Share, T, T) -> (T, T),
    ) {
        set(groups, self.arms, get(rows, 0));
        for ((k, node), share) in self.nodes.iter().enumerate().zip(&formation.shares) {
            let row = share.of_row(get(rows, 1 + k));
            let (left, right) = divide(share, get(groups, self.arms + k), row);
            set(groups, node.left, left);
            set(groups, node.right, right);
        }
        for (tip, leaf) in tips.iter_mut().zip(groups.iter()) {
            *tip = *leaf;
        }
    }
}

/// `values[index]`. Construction bounds every index; zero stands in for the panic that can't happen.
fn get<T: Copy + Default>(values: &[T], index: usize) -> T {
    debug_assert!(index < values.len());
    values.get(index).copied().unwrap_or_default()
}

/// `values[index] = value`, likewise.
fn set<T>(values: &mut [T], index: usize, value: T) {
    debug_assert!(index < values.len());
    if let Some(slot) = values.get_mut(index) {
        *slot = value;
    }
}
