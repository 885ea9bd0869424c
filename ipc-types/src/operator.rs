//! What the operator says: words, each of which is said once, and how the object shall move, which is said again
//! and again.
//!
//! A word carries its command in the lowest eight bits, in the next eight how often "stop" was said, and above them a
//! number that changes with every word: a stop is heard though another word follows it in the same tick.

use crate::TwistWire;
use bytemuck::{Pod, Zeroable};

/// Stop the team.
pub const STOP: u64 = 1;
/// Go on after a safe stop.
pub const RESUME: u64 = 2;
/// Approach the object, and grasp it.
pub const GRASP: u64 = 3;
/// Lift it.
pub const LIFT: u64 = 4;
/// Set it down.
pub const LOWER: u64 = 5;
/// Let it go.
pub const RELEASE: u64 = 6;

/// What people call a command.
pub const fn name(command: u64) -> &'static str {
    match command {
        STOP => "stop",
        RESUME => "resume",
        GRASP => "grasp",
        LIFT => "lift",
        LOWER => "lower",
        RELEASE => "release",
        _ => "unknown",
    }
}

/// The word that says this after `last`.
pub const fn word_after(last: u64, command: u64) -> u64 {
    let stops = (stops_of(last) + (command == STOP) as u64) & 0xff;
    ((last >> 16).wrapping_add(1) << 16) | (stops << 8) | (command & 0xff)
}

/// What a word says.
pub const fn command_of(word: u64) -> u64 {
    word & 0xff
}

/// How often "stop" was said up to a word, modulo 256.
pub const fn stops_of(word: u64) -> u64 {
    word >> 8 & 0xff
}

/// What whoever drives wants.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Drive {
    /// Changes with every message; 0 before the first.
    pub number: u64,
    /// Twist of the object, of its origin, in its heading: x ahead, y to the left, z up.
    pub twist: TwistWire,
    /// How much harder the hands shall press \[N\].
    pub squeeze_n: f64,
}

impl Drive {
    /// Whether it is made of numbers.
    pub fn is_finite(&self) -> bool {
        self.squeeze_n.is_finite() && self.twist.iter().all(|rate| rate.is_finite())
    }
}

/// What pushes a body of the simulated world for a while.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Push {
    /// Changes with every push; 0: none.
    pub number: u64,
    /// The object, or the base of robot r for r + 1.
    pub target: u64,
    /// At the body's centre of mass, in the world.
    pub force_n: [f64; 3],
    /// For how long.
    pub ticks: u64,
}

impl Push {
    /// Nobody pushes harder by intention.
    pub const MAX_FORCE_N: f64 = 1000.0;

    /// Whether it can be meant.
    pub fn is_credible(&self) -> bool {
        self.force_n.iter().all(|force| force.abs() <= Self::MAX_FORCE_N)
    }
}

/// All that the operator says, as it stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OperatorInput {
    /// The last word; 0 before the first.
    pub word: u64,
    /// The last message of whoever drives.
    pub drive: Drive,
    /// The last push. It disturbs the world, and is no control's business.
    pub push: Push,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_is_heard_whatever_is_said_after_it() {
        let stop = word_after(0, STOP);
        assert_eq!((command_of(stop), stops_of(stop)), (STOP, 1));
        let resume = word_after(stop, RESUME);
        assert_eq!((command_of(resume), stops_of(resume)), (RESUME, 1));
        assert_ne!(word_after(resume, RESUME), resume);
        let many = (0..300).fold(0, |word, _| word_after(word, STOP));
        assert_eq!((command_of(many), stops_of(many)), (STOP, 300 % 256));
    }
}
