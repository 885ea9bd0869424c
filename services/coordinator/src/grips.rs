//! Which hands hold the object, whatever their grippers say; and what becomes of the team when one does not.
//!
//! A hand is lost when it has slipped for some ticks ([`PartingLimits`]), or when its gripper says that it is open. From
//! then on it takes no part: internal forces are formed anew among the others ([`HybridLaw::reform`]), it is told to
//! open, and goes along with the object. Then the team stops, or carries on, as the scenario has it. Hands of one
//! robot, or fewer than two, do not carry on: between them there is nothing to share.

use crate::grasp::GraspCompliance;
use crate::tips::Tip;
use bytemuck::{Pod, Zeroable};
use mikoshi_config::scenario::{LostGrasp, Scenario};
use mikoshi_cooperation::{Gap, HandInput, HybridState, Parting, PartingLimits};
use mikoshi_ipc_types::{MAX_HANDS_OF_TEAM, MAX_ROBOTS, RobotState, stop_cause};
use mikoshi_spatial::{Object, Pose, Twist, World, Wrench};
use nalgebra::UnitQuaternion;

/// By how much a robot's odometry may be off: in ten minutes of walking robots are not off by half of it.
const ODOMETRY: Parting = Parting { m: 0.006, rad: 0.01 };
/// The part of what a grasp is thought to yield that it may not, or yield more.
const DOUBT: f64 = 0.5;
/// For how many ticks in a row a gripper must say that it is open.
const PATIENCE_TICKS: u64 = 5;

/// What is watched, and what it leads to. Immutable.
#[derive(Clone, Debug)]
pub(crate) struct Grips {
    limits: PartingLimits,
    slip_ticks: u64,
    compliance: GraspCompliance,
    /// Whether a team goes on without a hand.
    pub carries_on: bool,
    hands_of_robots: Vec<usize>,
}

/// What is remembered between ticks, by hand.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GripState {
    /// Where each tip had the object when the law started, in the object's axes.
    at_start: [[f64; 6]; MAX_HANDS_OF_TEAM],
    /// How far each grasp had yielded then, at the hand, in the object's axes.
    yielded_at_start: [[f64; 6]; MAX_HANDS_OF_TEAM],
    /// For how many ticks each hand has slipped.
    slipping: [u64; MAX_HANDS_OF_TEAM],
    /// For how many ticks each gripper has said that it is open.
    open: [u64; MAX_HANDS_OF_TEAM],
    /// Why the last hand was lost: one of [`stop_cause`], or 0.
    pub loss_cause: u64,
}

// SAFETY: zeros are a valid value of integers and floats.
unsafe impl Zeroable for GripState {}
// SAFETY: `repr(C)` over fields of 8-byte units and alignment only: no padding, any bit pattern valid.
unsafe impl Pod for GripState {}

/// The hands in a tick.
pub(crate) struct Seen<'a> {
    /// The object, as the law has it.
    pub X_WA: &'a Pose<World, Object>,
    /// All hands, in hand order.
    pub hands: &'a [HandInput],
    /// What each applies, filtered.
    pub hand_wrench: &'a [[f64; 6]],
}

/// Hands that were lost in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Loss {
    /// Bit i: hand i of the team.
    pub hands: u64,
    /// One of [`stop_cause`].
    pub cause: u64,
    /// Whose hand that was.
    pub robot: usize,
}

impl Grips {
    /// As the scenario has it.
    pub(crate) fn new(scenario: &Scenario, hands_of_robots: Vec<usize>) -> Self {
        let safety = &scenario.safety;
        Self {
            limits: PartingLimits {
                slip: Parting { m: safety.slip_m, rad: safety.slip_rad },
                odometry: ODOMETRY,
            },
            slip_ticks: safety.slip_ticks,
            compliance: GraspCompliance::at_least_of_a_hand(scenario),
            carries_on: safety.lost_grasp == LostGrasp::CarryOn,
            hands_of_robots,
        }
    }

    /// Hands that take part, as a set for each robot.
    pub(crate) fn present(&self, hybrid: &HybridState<MAX_HANDS_OF_TEAM>) -> [u64; MAX_ROBOTS] {
        let (mut sets, mut arm) = ([0; MAX_ROBOTS], 0);
        for (set, &count) in sets.iter_mut().zip(&self.hands_of_robots) {
            for hand in 0..count {
                *set |= u64::from(hybrid.takes_part(arm)) << hand;
                arm += 1;
            }
        }
        sets
    }

    /// The law has started, or starts anew: all that take part hold now.
    pub(crate) fn begin(
        &self,
        state: &mut GripState,
        hybrid: &HybridState<MAX_HANDS_OF_TEAM>,
        seen: &Seen<'_>,
    ) {
        (state.slipping, state.open) = ([0; MAX_HANDS_OF_TEAM], [0; MAX_HANDS_OF_TEAM]);
        let R_AW = seen.X_WA.rotation.inverse();
        let of_hands = seen.hand_wrench.iter().take(seen.hands.len());
        for (slot, wrench) in state.yielded_at_start.iter_mut().zip(of_hands) {
            *slot = self.yielded(&R_AW, wrench).to_array();
        }
        self.remember(state, hybrid, seen, &[Twist::zero(); MAX_HANDS_OF_TEAM]);
    }

    /// Hands that have come: they hold now, and their grasps have yielded as they have.
    pub(crate) fn take_in(&self, state: &mut GripState, came: u64, seen: &Seen<'_>) {
        let R_AW = seen.X_WA.rotation.inverse();
        let hands = state.yielded_at_start.iter_mut().zip(&mut state.slipping).zip(&mut state.open);
        for (arm, (((yielded, slipping), open), wrench)) in hands.zip(seen.hand_wrench).enumerate() {
            if came & 1 << arm != 0 {
                *yielded = self.yielded(&R_AW, wrench).to_array();
                (*slipping, *open) = (0, 0);
            }
        }
    }

    /// The law was formed anew: what hands are off their grips by, in the world, is `gaps`.
    pub(crate) fn remember(
        &self,
        state: &mut GripState,
        hybrid: &HybridState<MAX_HANDS_OF_TEAM>,
        seen: &Seen<'_>,
        gaps: &[Twist<World>; MAX_HANDS_OF_TEAM],
    ) {
        let X_AW = seen.X_WA.inverse();
        let hands = seen.hands.iter().zip(seen.hand_wrench);
        let of_hands = state.at_start.iter_mut().zip(gaps).zip(hands);
        for (arm, ((at_start, gap), (hand, wrench))) in of_hands.enumerate() {
            if let Some(tip) = Tip::of(hybrid, arm, hand, seen.X_WA) {
                *at_start = (self.off(&tip, wrench) - *gap).expressed_in(&X_AW).to_array();
            }
        }
    }

    /// Where each hand's tip has the object, less where it had it at the start, against the mean of all: what they apply to
    /// something that holds the object displaces all alike. `gaps` has one for each hand of the team.
    pub(crate) fn find_gaps(
        &self,
        state: &GripState,
        tips: &[Option<Tip>],
        seen: &Seen<'_>,
        gaps: &mut [Option<Gap>],
    ) {
        let R_AW = seen.X_WA.rotation.inverse();
        let hands = tips.iter().zip(seen.hands).zip(seen.hand_wrench);
        let at_start = state.at_start.iter().zip(&state.yielded_at_start);
        for (gap, ((at_start, yielded_at_start), ((tip, hand), wrench))) in
            gaps.iter_mut().zip(at_start.zip(hands))
        {
            *gap = tip.as_ref().map(|tip| {
                let at_start = Twist::<Object>::from_array(at_start).expressed_in(seen.X_WA);
                let doubt = (self.yielded(&R_AW, wrench) - Twist::from_array(yielded_at_start)) * DOUBT;
                Gap {
                    tip: self.off(tip, wrench) - at_start,
                    lever: hand.pose.translation - seen.X_WA.translation,
                    doubt: Parting { m: doubt.linear.norm(), rad: doubt.angular.norm() },
                }
            });
        }
        let count = gaps.iter().flatten().count().max(1) as f64;
        let mean = gaps.iter().flatten().fold(Twist::zero(), |sum, gap| sum + gap.tip) * (1.0 / count);
        gaps.iter_mut().flatten().for_each(|gap| gap.tip = gap.tip - mean);
    }

    /// How far a grasp yields to a wrench, at the hand, in the object's axes.
    fn yielded(&self, R_AW: &UnitQuaternion<f64>, wrench: &[f64; 6]) -> Twist<Object> {
        let in_world = self.compliance.grip_yield(&Wrench::from_array(wrench));
        Twist::new(R_AW * in_world.linear, R_AW * in_world.angular)
    }

    /// Where this tip has the object, less what its grasp yields, from where the team has it.
    fn off(&self, tip: &Tip, wrench: &[f64; 6]) -> Twist<World> {
        tip.off + self.compliance.tip_yield(&tip.lever, &Wrench::from_array(wrench))
    }

    /// How far each hand has parted from its grip, as a multiple of what it may.
    pub(crate) fn find_slips(&self, gaps: &[Option<Gap>], slips: &mut [f64; MAX_HANDS_OF_TEAM]) {
        self.limits.slips(gaps, &self.hands_of_robots, slips);
    }

    /// One tick of hands that shall hold: which of those that take part are lost from now on.
    pub(crate) fn find_loss<'a>(
        &self,
        state: &mut GripState,
        hybrid: &HybridState<MAX_HANDS_OF_TEAM>,
        slips: &[f64; MAX_HANDS_OF_TEAM],
        robots: impl Iterator<Item = &'a RobotState>,
    ) -> Option<Loss> {
        let mut loss: Option<Loss> = None;
        let mut hands = state.slipping.iter_mut().zip(&mut state.open).zip(slips).enumerate();
        for ((robot, said), &count) in robots.enumerate().zip(&self.hands_of_robots) {
            for (hand, (arm, ((slipping, open), slip))) in hands.by_ref().take(count).enumerate() {
                let counted = |ticks: u64, is_so| if is_so { ticks.saturating_add(1) } else { 0 };
                *slipping = counted(*slipping, *slip >= 1.0);
                *open = counted(*open, said.holding_hands & 1 << hand == 0);
                let cause = match (*open >= PATIENCE_TICKS, *slipping >= self.slip_ticks) {
                    (true, _) => stop_cause::GRASP,
                    (false, true) => stop_cause::SLIP,
                    (false, false) => continue,
                };
                if hybrid.takes_part(arm) {
                    let loss = loss.get_or_insert(Loss { hands: 0, cause, robot });
                    loss.hands |= 1 << arm;
                }
            }
        }
        loss
    }

    /// Whether hands that take part, but for those lost, are too few to carry anything between them.
    pub(crate) fn are_too_few(&self, hybrid: &HybridState<MAX_HANDS_OF_TEAM>, gone: u64) -> bool {
        let mut arms = 0..0;
        let holds = |count: &&usize| {
            arms = arms.end..arms.end + **count;
            arms.clone().any(|arm| hybrid.takes_part(arm) && gone & 1 << arm == 0)
        };
        self.hands_of_robots.iter().filter(holds).count() < 2
    }
}

/// Whether of a robot all hands that take part hold.
pub(crate) fn all_hold(robot: &RobotState, present: u64) -> bool {
    robot.holding_hands & present == present
}

/// The hands that take no part, in hand order.
pub(crate) fn absent(hybrid: &HybridState<MAX_HANDS_OF_TEAM>) -> u64 {
    let arms = hybrid.is_absent.iter().enumerate();
    arms.fold(0, |set, (arm, is_absent)| set | u64::from(*is_absent != 0) << arm)
}
