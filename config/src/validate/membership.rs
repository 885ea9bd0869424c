//! Who leaves and joins, and when: one after the other, and never so many that nobody is left to carry.

use super::checks::Checks;
use crate::scenario::{InternalForces, Membership, Policy, Scenario};
use std::collections::{BTreeMap, BTreeSet};

/// Fewer robots share nothing.
const FEWEST: usize = 2;

pub(super) fn membership(checks: &mut Checks, scenario: &Scenario) {
    if scenario.membership.is_empty() {
        return;
    }
    let is_tree = scenario.hybrid.internal_forces == InternalForces::BalancedTree;
    let expected = "balanced-tree: internal forces that are no tree are not formed anew";
    checks.require(is_tree, "hybrid.internal_forces", "another choice with a membership", expected);
    let is_by_symmetry = scenario.coordination.policy == Policy::Symmetry;
    let expected = "symmetry: a leader does not share what it carries";
    checks.require(is_by_symmetry, "coordination.policy", "leader-follower with a membership", expected);
    let expected = "a time, or a job: without the hybrid law nobody carries";
    checks.require(scenario.is_controlled(), "hybrid.start_s", "none with a membership", expected);

    for (index, entry) in scenario.membership.iter().enumerate() {
        let expected = "leave_s first: in a job all hands grasp";
        let is_first = scenario.membership_of(&entry.robot).next().is_some_and(|first| first == entry);
        let begins_away = is_first && entry.begins_away() && scenario.job.is_some();
        checks.require(!begins_away, format_args!("membership.{index}.join_s"), "no leave_s", expected);
    }
    for (index, axis) in scenario.hybrid.axes.iter().enumerate() {
        let expected = "the object: what hands do to each other goes to zero before one leaves";
        let key = format!("hybrid.axes.{index}.row");
        checks.require(axis.row == "object", key, format_args!("{:?}", axis.row), expected);
    }

    let mut last_s = BTreeMap::new();
    for (index, entry) in scenario.membership.iter().enumerate() {
        times(checks, index, entry, scenario, &mut last_s);
        let key = |name: &str| format!("membership.{index}.{name}");
        for (name, value, most, unit) in [
            ("distance_m", entry.distance_m, Membership::MAX_DISTANCE_M, "m"),
            ("speed_m_s", entry.speed_m_s, Membership::MAX_SPEED_M_S, "m/s"),
            ("draw_back_m", entry.draw_back_m, Membership::MAX_DRAW_BACK_M, "m"),
        ] {
            let expected = format!("more than 0, at most {most} {unit}");
            checks.require(value > 0.0 && value <= most, key(name), value, expected);
        }
    }
    those_left(checks, scenario);
}

/// Each time is finite and later than the last one of its robot, which is known, and goes and comes by turns.
fn times<'a>(
    checks: &mut Checks,
    index: usize,
    entry: &'a Membership,
    scenario: &Scenario,
    last_s: &mut BTreeMap<&'a str, (f64, bool)>,
) {
    let key = |name: &str| format!("membership.{index}.{name}");
    let names: Vec<_> = scenario.robots.iter().map(|member| member.name.as_str()).collect();
    let expected = format!("a robot of the team: {}", names.join(", "));
    let is_known = names.contains(&entry.robot.as_str());
    checks.require(is_known, key("robot"), format_args!("{:?}", entry.robot), expected);
    let is_any = entry.leave_s.is_some() || entry.join_s.is_some();
    checks.require(is_any, key("leave_s"), "neither leave_s nor join_s", "a time to leave, to join, or both");
    let first = (f64::NEG_INFINITY, entry.begins_away());
    let (time_s, is_away) = last_s.entry(entry.robot.as_str()).or_insert(first);
    for (name, time, leaves) in [("leave_s", entry.leave_s, true), ("join_s", entry.join_s, false)] {
        let Some(time) = time else { continue };
        checks.not_negative(key(name), time);
        let expected = format!("a time later than {} has left or joined before", entry.robot);
        checks.require(time > *time_s, key(name), time, expected);
        let state = if *is_away { "away" } else { "in the team" };
        let found = format_args!("a time at which {} is {state} already", entry.robot).to_string();
        checks.require(leaves != *is_away, key(name), found, "leaving and joining by turns");
        (*time_s, *is_away) = (time, leaves);
    }
}

/// At no time so many are asked to be away that fewer than two robots are left.
fn those_left(checks: &mut Checks, scenario: &Scenario) {
    let first = |robot: &&str| scenario.begins_away(robot);
    let robots: Vec<_> = scenario.robots.iter().map(|member| member.name.as_str()).collect();
    let mut away: BTreeSet<_> = robots.iter().copied().filter(first).collect();
    let mut changes = vec![];
    for (index, entry) in scenario.membership.iter().enumerate() {
        changes.extend(entry.leave_s.map(|time_s| (time_s, index, "leave_s")));
        changes.extend(entry.join_s.map(|time_s| (time_s, index, "join_s")));
    }
    changes.sort_by(|(a, ..), (b, ..)| a.total_cmp(b));
    let expected = format!("at least {FEWEST}");
    let left = robots.len().saturating_sub(away.len());
    checks.require(left >= FEWEST, "membership", format_args!("{left} robots at the start"), &expected);
    for (_, index, name) in changes {
        let robot = scenario.membership[index].robot.as_str();
        match name {
            "leave_s" => away.insert(robot),
            _ => away.remove(robot),
        };
        let left = robots.len().saturating_sub(away.len());
        let key = format!("membership.{index}.{name}");
        checks.require(left >= FEWEST, key, format_args!("{left} robots that are left"), &expected);
    }
}
