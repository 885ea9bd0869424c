//! Internal forces as a tree of groups, applied in O(n).

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
    /// |L| / (|L| + |R|).
    left_share: f64,
    /// |R| / (|L| + |R|).
    right_share: f64,
}

impl GroupTree {
    /// From splits that form a tree, parents first.
    pub fn new(arms: usize, splits: &[Split]) -> Self {
        let span = |split: &Split| (split.left.start, split.right.end);
        let leaves = (0..arms).map(|arm| ((arm, arm + 1), arm));
        let groups: HashMap<_, _> =
            leaves.chain(splits.iter().enumerate().map(|(k, split)| (span(split), arms + k))).collect();
        let node = |split: &Split| {
            let (left_share, right_share) = split.shares();
            Node {
                left: groups[&(split.left.start, split.left.end)],
                right: groups[&(split.right.start, split.right.end)],
                left_share,
                right_share,
            }
        };
        Self { arms, nodes: splits.iter().map(node).collect() }
    }

    pub fn work_len(&self) -> usize {
        self.arms + self.nodes.len()
    }

    /// Upwards, sums of groups: a row is `right share · sum of L − left share · sum of R`.
    pub fn generalized_force<T: Linear>(&self, tips: &[T], rows: &mut [T], sums: &mut [T]) {
        self.sweep_up(tips, rows, sums, |node, left, right| {
            (left + right, left * node.right_share - right * node.left_share)
        });
    }

    /// Upwards, means of groups: a row is `mean of L − mean of R`.
    pub fn generalized_position<T: Linear>(&self, tips: &[T], rows: &mut [T], means: &mut [T]) {
        self.sweep_up(tips, rows, means, |node, left, right| {
            (left * node.left_share + right * node.right_share, left - right)
        });
    }

    /// Downwards, sums of groups: the inverse of [`GroupTree::generalized_force`].
    pub fn tip_forces<T: Linear>(&self, rows: &[T], tips: &mut [T], sums: &mut [T]) {
        self.sweep_down(rows, tips, sums, |node, sum, row| {
            (sum * node.left_share + row, sum * node.right_share - row)
        });
    }

    /// Downwards, means of groups: the inverse of [`GroupTree::generalized_position`].
    pub fn tip_displacements<T: Linear>(&self, rows: &[T], tips: &mut [T], means: &mut [T]) {
        self.sweep_down(rows, tips, means, |node, mean, row| {
            (mean + row * node.right_share, mean - row * node.left_share)
        });
    }

    /// `merge(node, left, right)` gives the node's own value and its row; row 0 is the root's value.
    fn sweep_up<T: Linear>(
        &self,
        tips: &[T],
        rows: &mut [T],
        groups: &mut [T],
        merge: impl Fn(&Node, T, T) -> (T, T),
    ) {
        for (leaf, tip) in groups.iter_mut().zip(tips) {
            *leaf = *tip;
        }
        for (k, node) in self.nodes.iter().enumerate().rev() {
            let (value, row) = merge(node, get(groups, node.left), get(groups, node.right));
            set(groups, self.arms + k, value);
            set(rows, 1 + k, row);
        }
        set(rows, 0, get(groups, self.arms));
    }

    /// `divide(node, value, row)` gives the values of the node's left and right group.
    fn sweep_down<T: Linear>(
        &self,
        rows: &[T],
        tips: &mut [T],
        groups: &mut [T],
        divide: impl Fn(&Node, T, T) -> (T, T),
    ) {
        set(groups, self.arms, get(rows, 0));
        for (k, node) in self.nodes.iter().enumerate() {
            let (left, right) = divide(node, get(groups, self.arms + k), get(rows, 1 + k));
            set(groups, node.left, left);
            set(groups, node.right, right);
        }
        for (tip, leaf) in tips.iter_mut().zip(groups.iter()) {
            *tip = *leaf;
        }
    }
}

/// `values[index]`. Construction bounds every index; zero stands in for the panic that can't happen.
fn get<T: Linear>(values: &[T], index: usize) -> T {
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
