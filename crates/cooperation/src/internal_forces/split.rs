//! Splits: an internal force between two neighbouring groups of arms.

use crate::TeamArms;
use core::ops::Range;
use std::collections::VecDeque;

/// An internal force between two groups of arms, each a range of hand order.
#[derive(Clone, Debug)]
pub(super) struct Split {
    pub left: Range<usize>,
    pub right: Range<usize>,
    pub name: String,
}

impl Split {
    /// The left group's share |L| / (|L| + |R|) of the arms, and the right group's.
    pub fn shares(&self) -> (f64, f64) {
        let (left, right) = (self.left.len() as f64, self.right.len() as f64);
        (left / (left + right), right / (left + right))
    }

    /// The row of C, `|L||R|/(|L|+|R|) (mean of L − mean of R)`: the right share on every left arm, minus
    /// the left share on every right arm.
    pub fn coefficients(&self, arms: usize) -> Vec<f64> {
        let (left_share, right_share) = self.shares();
        let mut row = vec![0.0; arms];
        row[self.left.clone()].fill(right_share);
        row[self.right.clone()].fill(-left_share);
        row
    }
}

/// The rows of eq. 43, for any team: halving the robots level by level, then the arms of each robot.
pub(super) fn level_order(team: &TeamArms) -> Vec<Split> {
    let arms_by_robot = team.arms_by_robot();
    let mut splits: Vec<Split> =
        halvings(arms_by_robot.len()).map(|(left, right)| between_robots(team, left, right)).collect();
    for (robot, arms) in arms_by_robot.iter().enumerate() {
        splits.extend(halvings(arms.len()).map(|(left, right)| between_hands(team, robot, left, right)));
    }
    splits
}

/// The rows of eq. 24, for any team: neighbouring arms of each robot, then neighbouring robots.
pub(super) fn chain(team: &TeamArms) -> Vec<Split> {
    let links = |items: usize| (1..items).map(|i| (i - 1..i, i..i + 1));
    let arms_by_robot = team.arms_by_robot();
    let mut splits = Vec::with_capacity(team.arms() - 1);
    for (robot, arms) in arms_by_robot.iter().enumerate() {
        splits.extend(links(arms.len()).map(|(left, right)| between_hands(team, robot, left, right)));
    }
    splits.extend(links(arms_by_robot.len()).map(|(left, right)| between_robots(team, left, right)));
    splits
}

fn between_robots(team: &TeamArms, left: Range<usize>, right: Range<usize>) -> Split {
    let arms_by_robot = team.arms_by_robot();
    let arms = |robots: &Range<usize>| arms_by_robot[robots.start].start..arms_by_robot[robots.end - 1].end;
    Split {
        left: arms(&left),
        right: arms(&right),
        name: format!("{}|{}", team.name_of_robots(left), team.name_of_robots(right)),
    }
}

fn between_hands(team: &TeamArms, robot: usize, left: Range<usize>, right: Range<usize>) -> Split {
    let first = team.arms_by_robot()[robot].start;
    Split {
        left: first + left.start..first + left.end,
        right: first + right.start..first + right.end,
        name: format!("{}|{}", team.name_of_hands(robot, left), team.name_of_hands(robot, right)),
    }
}

/// The inner nodes of the balanced tree over `items`, in level order; the left half is the larger.
fn halvings(items: usize) -> impl Iterator<Item = (Range<usize>, Range<usize>)> {
    let mut groups = VecDeque::new();
    groups.push_back(0..items);
    core::iter::from_fn(move || {
        loop {
            let group = groups.pop_front()?;
            if group.len() < 2 {
                continue;
            }
            let middle = group.start + group.len().div_ceil(2);
            let (left, right) = (group.start..middle, middle..group.end);
            groups.extend([left.clone(), right.clone()]);
            return Some((left, right));
        }
    })
}
