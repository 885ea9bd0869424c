//! When the team stops for safety's sake, and when it may go on.
//!
//! ```text
//!              the operator, or something wrong with a robot
//!   Going on ──────────────────────────────────────────────▶ Stopped { cause }
//!      ▲                                                          │
//!      └───── the operator, once nothing is wrong and all stand ──┘
//! ```
//!
//! A stopped team is in one mode whatever it did before: the object's reference comes to rest within its limits
//! of acceleration, feet take the steps that brings with it and then stand, and hands go on to do what they do.
//! Where what is measured can't be believed any more, they do so without force control. What went wrong first is
//! remembered.

use crate::operator::Says;
use bytemuck::{Pod, Zeroable};
use mikoshi_config::scenario::{Safety as SafetyConfig, Scenario};
use mikoshi_ipc_types::{MAX_ROBOTS, PoseWire, RobotState, flag, stop_cause};
use mikoshi_spatial::{Hand, Pose, World};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// For how many ticks in a row something must be wrong: one wild reading is none. Less than the twenty ticks
/// within which a team must react.
const PATIENCE_TICKS: u64 = 5;

/// What is watched. Immutable.
#[derive(Clone, Debug)]
pub(crate) struct Safety {
    limits: SafetyConfig,
    torque_ticks: u64,
}

/// What is remembered between ticks.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SafetyState {
    /// Why the team is stopped: one of [`stop_cause`]; 0 if it is not.
    pub cause: u64,
    /// Whose fault that is: the robot plus one.
    pub robot: u64,
    /// Not 0 where the team is stopped and its hands' wrenches mean nothing to it any more.
    blind: u64,
    /// For how many ticks each cause has been there, by robot.
    lasted: [[u64; CAUSES]; MAX_ROBOTS],
}

/// Causes that a robot may give.
const CAUSES: usize = stop_cause::ALL.len();

// SAFETY: zeros are a valid value of integers.
unsafe impl Zeroable for SafetyState {}
// SAFETY: `repr(C)` over integers of one size only: no padding, any bit pattern valid.
unsafe impl Pod for SafetyState {}

impl Default for SafetyState {
    fn default() -> Self {
        Self { cause: 0, robot: 0, blind: 0, lasted: [[0; CAUSES]; MAX_ROBOTS] }
    }
}

impl SafetyState {
    /// Whether the team is stopped.
    pub(crate) fn is_stopped(&self) -> bool {
        self.cause != 0
    }

    /// Whether it is because what is measured can't be believed: then nothing may be controlled by it.
    pub(crate) fn is_blind(&self) -> bool {
        self.blind != 0 || matches!(self.cause, stop_cause::INPUT | stop_cause::STALE)
    }

    /// Whether somebody's drives are at their limits, and not for a moment: sooner than the team stops for it.
    pub(crate) fn is_strained(&self) -> bool {
        let torque = stop_cause::ALL.iter().position(|cause| *cause == stop_cause::TORQUE);
        let for_ticks =
            |lasted: &[u64; CAUSES]| torque.and_then(|cause| lasted.get(cause).copied()).unwrap_or(0);
        self.lasted.iter().any(|lasted| for_ticks(lasted) >= PATIENCE_TICKS)
    }

    /// Stops a team that has lost a hand of this robot; `is_blind` if it can't go on without that hand. What
    /// stopped it before stays.
    pub(crate) fn stop(&mut self, cause: u64, robot: usize, is_blind: bool) {
        if !self.is_stopped() {
            (self.cause, self.robot) = (cause, robot as u64 + 1);
        }
        self.blind |= u64::from(is_blind);
    }
}

impl Safety {
    /// As the scenario has it.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let limits = scenario.safety.clone();
        Self { torque_ticks: scenario.tick_at(limits.torque_limit_s).max(1), limits }
    }

    /// One tick: what robots say of themselves, each with the set of its hands that take part; whether
    /// nobody steps; and what the operator says.
    pub(crate) fn look<'a>(
        &self,
        state: &mut SafetyState,
        robots: impl Iterator<Item = (&'a RobotState, u64)>,
        stands: bool,
        says: Says,
    ) {
        let mut first = None;
        for (index, ((robot, hands), lasted)) in robots.zip(&mut state.lasted).enumerate() {
            for (cause, ticks) in stop_cause::ALL.into_iter().zip(lasted) {
                *ticks = if self.is_wrong(cause, robot, hands) { ticks.saturating_add(1) } else { 0 };
                let patience = match cause {
                    stop_cause::TORQUE => self.torque_ticks,
                    stop_cause::STALE => self.limits.stale_limit_ticks,
                    _ => PATIENCE_TICKS,
                };
                if *ticks >= patience && first.is_none() {
                    first = Some((cause, index as u64 + 1));
                }
            }
        }
        if first.is_none() && says.stop {
            first = Some((stop_cause::OPERATOR, 0));
        }
        match first {
            Some((cause, robot)) if !state.is_stopped() => (state.cause, state.robot) = (cause, robot),
            None if stands && says.resume => (state.cause, state.robot, state.blind) = (0, 0, 0),
            _ => {}
        }
    }

    fn is_wrong(&self, cause: u64, robot: &RobotState, hands: u64) -> bool {
        let limits = &self.limits;
        match cause {
            stop_cause::INPUT => robot.flags & flag::INPUT_REJECTED != 0,
            stop_cause::HAND_WRENCH => robot.hand_wrench.iter().enumerate().any(|(hand, wrench)| {
                let [fx, fy, fz, nx, ny, nz] = *wrench;
                let is_too_much = Vector3::new(fx, fy, fz).norm() > limits.hand_force_max_n
                    || Vector3::new(nx, ny, nz).norm() > limits.hand_moment_max_nm;
                is_too_much && hands & 1 << hand != 0
            }),
            stop_cause::BALANCE => robot.zmp_margin_m < limits.zmp_margin_min_m,
            stop_cause::TILT => tilt(robot) > limits.tilt_max_rad,
            stop_cause::TORQUE => robot.flags & flag::TORQUE_LIMIT != 0,
            stop_cause::STALE => robot.flags & flag::INPUT_MISSING != 0,
            // Hands that are lost are found in `grips.rs`.
            _ => false,
        }
    }
}

/// What no hand can apply, a thousand times what the largest carried object weighs: whoever says so is mistaken.
const ABSURD_WRENCH: f64 = 1e4;
/// How far a hand may come in a tick by its robot's word; forty metres a second are a mistake.
const ABSURD_STEP_M: f64 = 0.2;

/// Whether a robot may be believed that says `robot` and said `last` before; the first word is taken as it is.
pub(crate) fn is_credible(robot: &RobotState, last: Option<&RobotState>, hands: usize) -> bool {
    let poses = robot.hand_pose.iter().zip(&robot.hand_pose_commanded).take(hands);
    let are_poses =
        poses.flat_map(|(pose, commanded)| [pose, commanded]).all(is_pose) && is_pose(&robot.base_pose);
    let is_step =
        |(pose, before): (&PoseWire, &PoseWire)| (position(pose) - position(before)).norm() <= ABSURD_STEP_M;
    let is_continuous =
        last.is_none_or(|last| robot.hand_pose.iter().zip(&last.hand_pose).take(hands).all(is_step));
    let wrenches = robot.hand_wrench.iter().take(hands).flatten();
    are_poses && is_continuous && wrenches.fold(0.0, |most: f64, part| most.max(part.abs())) < ABSURD_WRENCH
}

fn is_pose(pose: &PoseWire) -> bool {
    Pose::<World, Hand>::from_array(pose).is_some()
}

fn position(pose: &PoseWire) -> Vector3<f64> {
    let [x, y, z, ..] = *pose;
    Vector3::new(x, y, z)
}

/// Angle between a robot's base and upright.
fn tilt(robot: &RobotState) -> f64 {
    let [_, _, _, w, x, y, z] = robot.base_pose;
    let up = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)) * Vector3::z();
    up.z.clamp(-1.0, 1.0).acos()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SILENCE: Says = Says { stop: false, resume: false };
    const STOP: Says = Says { stop: true, resume: false };
    const RESUME: Says = Says { stop: false, resume: true };

    fn safety() -> Safety {
        let limits = SafetyConfig::default();
        Safety { limits, torque_ticks: 100 }
    }

    fn well() -> RobotState {
        RobotState {
            base_pose: [0.0, 0.0, 0.7, 1.0, 0.0, 0.0, 0.0],
            zmp_margin_m: 0.04,
            holding_hands: 0b11,
            ..RobotState::zeroed()
        }
    }

    /// The first tick after which a team of two is stopped, if its second robot is as told from tick 10 on.
    fn stopped_at(spoil: impl Fn(&mut RobotState)) -> Option<(u64, u64, u64)> {
        let (safety, mut state) = (safety(), SafetyState::default());
        (0..200).find_map(|tick| {
            let mut robots = [well(), well()];
            if tick >= 10 {
                spoil(&mut robots[1]);
            }
            safety.look(&mut state, robots.iter().map(|robot| (robot, 0b11)), true, SILENCE);
            state.is_stopped().then_some((tick, state.cause, state.robot))
        })
    }

    #[test]
    fn a_team_with_which_all_is_well_goes_on() {
        assert_eq!(stopped_at(|_| ()), None);
    }

    #[test]
    fn whatever_is_wrong_stops_the_team_within_twenty_ticks_and_is_named() {
        type Spoil = fn(&mut RobotState);
        let spoils: [(u64, Spoil); 5] = [
            (stop_cause::INPUT, |robot| robot.flags |= flag::INPUT_REJECTED),
            (stop_cause::HAND_WRENCH, |robot| robot.hand_wrench[1][2] = -301.0),
            (stop_cause::HAND_WRENCH, |robot| robot.hand_wrench[0][4] = 101.0),
            (stop_cause::BALANCE, |robot| robot.zmp_margin_m = -0.001),
            (stop_cause::TILT, |robot| robot.base_pose[3..].copy_from_slice(&[0.99, 0.14, 0.0, 0.0])),
        ];
        for (cause, spoil) in spoils {
            assert_eq!(stopped_at(spoil), Some((10 + PATIENCE_TICKS - 1, cause, 2)));
        }
        let torque = |robot: &mut RobotState| robot.flags |= flag::TORQUE_LIMIT;
        assert_eq!(stopped_at(torque), Some((109, stop_cause::TORQUE, 2)));
        let (safety, mut state, mut robot) = (safety(), SafetyState::default(), well());
        torque(&mut robot);
        let strained_after = (1..).find(|_| {
            safety.look(&mut state, core::iter::once((&robot, 0b11)), true, SILENCE);
            state.is_strained()
        });
        assert_eq!(
            (strained_after, state.is_stopped()),
            (Some(PATIENCE_TICKS), false),
            "long before the team stops"
        );
        let stale = |robot: &mut RobotState| robot.flags |= flag::INPUT_MISSING;
        assert_eq!(stopped_at(stale), Some((24, stop_cause::STALE, 2)));
        const { assert!(PATIENCE_TICKS < 20) };
    }

    #[test]
    fn a_wild_reading_is_nothing() {
        let (safety, mut state) = (safety(), SafetyState::default());
        for tick in 1000..2000 {
            let mut robot = well();
            if tick % PATIENCE_TICKS != 0 {
                robot.zmp_margin_m = -1.0;
            }
            safety.look(&mut state, core::iter::once((&robot, 0b11)), true, SILENCE);
            assert!(!state.is_stopped());
        }
    }

    #[test]
    fn the_operator_stops_the_team_and_lets_it_go_on() {
        let (safety, mut state) = (safety(), SafetyState::default());
        let mut look = |says| {
            safety.look(&mut state, core::iter::once((&well(), 0b11)), true, says);
            state.cause
        };
        assert_eq!([SILENCE, STOP, SILENCE, RESUME, SILENCE].map(&mut look), [0, 1, 1, 0, 0]);
        let both = Says { stop: true, resume: true };
        assert_eq!(look(both), stop_cause::OPERATOR, "a stop counts more");
    }

    #[test]
    fn nobody_goes_on_while_something_is_wrong() {
        let (safety, mut state) = (safety(), SafetyState::default());
        let fallen = RobotState { zmp_margin_m: -0.1, ..well() };
        for _ in 0..20 {
            safety.look(&mut state, core::iter::once((&fallen, 0b11)), true, RESUME);
        }
        assert_eq!((state.cause, state.robot), (stop_cause::BALANCE, 1));
        safety.look(&mut state, core::iter::once((&well(), 0b11)), false, RESUME);
        assert!(state.is_stopped(), "it still steps");
        safety.look(&mut state, core::iter::once((&well(), 0b11)), true, RESUME);
        assert!(!state.is_stopped());
    }

    #[test]
    fn a_hand_that_takes_no_part_may_feel_what_it_will() {
        let (safety, mut state) = (safety(), SafetyState::default());
        let mut robot = well();
        robot.hand_wrench[1][2] = -301.0;
        for _ in 0..20 {
            safety.look(&mut state, core::iter::once((&robot, 0b01)), true, SILENCE);
        }
        assert!(!state.is_stopped());
    }

    #[test]
    fn a_team_that_has_lost_a_hand_stops_until_the_operator_lets_it_go_on_and_says_what_came_first() {
        let (safety, mut state) = (safety(), SafetyState::default());
        state.stop(stop_cause::SLIP, 1, false);
        assert!(!state.is_blind());
        state.stop(stop_cause::TOO_FEW_HANDS, 0, true);
        assert_eq!((state.cause, state.robot, state.is_blind()), (stop_cause::SLIP, 2, true));
        safety.look(&mut state, core::iter::once((&well(), 0b11)), true, RESUME);
        assert!(!state.is_stopped() && !state.is_blind());
    }

    #[test]
    fn nobody_is_believed_who_says_what_can_not_be() {
        let upright = [0.3, 0.1, 0.8, 1.0, 0.0, 0.0, 0.0];
        let last = RobotState { hand_pose: [upright; 4], hand_pose_commanded: [upright; 4], ..well() };
        let is_believed = |spoil: fn(&mut RobotState)| {
            let mut robot = last;
            spoil(&mut robot);
            is_credible(&robot, Some(&last), 2)
        };
        assert!(is_believed(|_| ()));
        assert!(is_believed(|robot| robot.hand_pose[1][0] += 0.1));
        assert!(is_believed(|robot| robot.hand_wrench[1][2] = -2000.0));
        assert!(is_believed(|robot| robot.hand_pose[2] = [0.0; 7]), "it has two hands");
        assert!(!is_believed(|robot| robot.hand_pose[1][0] += 0.3));
        assert!(!is_believed(|robot| robot.hand_pose[0][3] = 3.0));
        assert!(!is_believed(|robot| robot.hand_pose_commanded[0] = [0.0; 7]));
        assert!(!is_believed(|robot| robot.base_pose = [0.0; 7]));
        assert!(!is_believed(|robot| robot.hand_wrench[0][3] = 1e9));
    }
}
