//! Hands that part from what they hold. Beyond the paper, whose hands hold.
//!
//! A hand that holds moves with the object, but for what its grasp yields to its wrench. With g_i the displacement from the
//! team's object (eq. 27) to where the tip of arm i has it, less what its grasp yields, less what that was when the sticks
//! were made, all against their mean, a hand has left its grip by g_i at its own origin, but for three things:
//!
//! - Of n arms each has a part in the mean: one that is off by s is seen off by (n − 1)/n s.
//! - What a robot says of its hands is in the world of its odometry, which errs a little with every step
//!   ([`Landmark`](crate::Landmark)). All its hands have that in common. Between k hands of one robot, those of whom
//!   b_i = k/(k − 1) (g_i − mean of g over its hands) is left, odometry explains nothing.
//!
//! - How much a grasp yields is known as well as it has been calibrated: what is less by a part of that is in doubt.
//!
//! So a hand has parted if it has from its robot's other hands, and is the one of them that is off the team's object the
//! most; or if it is off the team's object by more than odometry explains.

use mikoshi_spatial::{Twist, World};
use nalgebra::Vector3;

/// How far a hand has parted from its grip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parting {
    /// \[m\]
    pub m: f64,
    /// \[rad\]
    pub rad: f64,
}

/// What is no slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartingLimits {
    /// What holds may be off by.
    pub slip: Parting,
    /// By how much a robot's odometry may be off.
    pub odometry: Parting,
}

/// Where an arm's tip has the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// g_i, at the object's origin.
    pub tip: Twist<World>,
    /// From there to the hand's origin \[m\].
    pub lever: Vector3<f64>,
    /// By how much of it the grasp may have yielded otherwise than it was thought to, at the hand.
    pub doubt: Parting,
}

impl PartingLimits {
    /// How far each arm has parted, as a multiple of what it may: it slips from 1 on. Arms without a gap take no part.
    /// `hands_of_robots` counts the arms of each robot, in the order of `gaps`. No allocation, no panic; O(n).
    pub fn slips(&self, gaps: &[Option<Gap>], hands_of_robots: &[usize], slips: &mut [f64]) {
        let n = gaps.iter().flatten().count();
        let whole = share_of_others(n);
        let mut arms = 0..0;
        for &count in hands_of_robots {
            arms = arms.end..arms.end + count;
            let (Some(of_robot), Some(slips)) = (gaps.get(arms.clone()), slips.get_mut(arms.clone())) else {
                return;
            };
            self.slips_of_robot(of_robot, whole, slips);
        }
    }

    fn slips_of_robot(&self, gaps: &[Option<Gap>], whole: f64, slips: &mut [f64]) {
        let present = gaps.iter().flatten();
        let k = present.clone().count();
        let mean = present.fold(Twist::zero(), |sum, gap| sum + gap.tip) * (1.0 / k.max(1) as f64);
        let among = share_of_others(k);
        let doubt = gaps.iter().flatten().fold(Parting::NONE, |most, gap| most.or(&gap.doubt));
        let (mut farthest, mut suspect) = (0.0, None);
        for (arm, (gap, slip)) in gaps.iter().zip(slips.iter_mut()).enumerate() {
            let Some(gap) = gap else {
                *slip = 0.0;
                continue;
            };
            let off_team = gap.at_hand(gap.tip * whole);
            *slip = self.slip.multiple(&off_team.less(&self.odometry).less(&gap.doubt));
            let off = self.slip.multiple(&off_team);
            if off > farthest {
                let off_robot = gap.at_hand((gap.tip - mean) * among).less(&gap.doubt).less(&doubt);
                (farthest, suspect) = (off, Some((arm, self.slip.multiple(&off_robot))));
            }
        }
        if let Some((slip, off)) = suspect.and_then(|(arm, off)| Some((slips.get_mut(arm)?, off))) {
            *slip = slip.max(off);
        }
    }
}

/// By what the displacement from a mean that one has a part in is to be multiplied; 0 for who is alone.
fn share_of_others(count: usize) -> f64 {
    if count > 1 { count as f64 / (count - 1) as f64 } else { 0.0 }
}

impl Gap {
    fn at_hand(&self, tip: Twist<World>) -> Parting {
        let at_hand = tip.shifted(&self.lever);
        Parting { m: at_hand.linear.norm(), rad: at_hand.angular.norm() }
    }
}

impl Parting {
    /// None.
    pub const NONE: Self = Self { m: 0.0, rad: 0.0 };

    fn or(&self, other: &Self) -> Self {
        Self { m: self.m.max(other.m), rad: self.rad.max(other.rad) }
    }

    fn less(&self, explained: &Self) -> Self {
        Self { m: (self.m - explained.m).max(0.0), rad: (self.rad - explained.rad).max(0.0) }
    }

    fn multiple(&self, of: &Self) -> f64 {
        (of.m / self.m).max(of.rad / self.rad)
    }
}
