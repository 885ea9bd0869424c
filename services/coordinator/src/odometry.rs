//! Where each robot's odometry has Σo, as the object that all hold tells.
//!
//! All that a robot says is in its own frame O, and so is all that it is told; `X_WO` leads across, and nothing
//! else in the coordinator knows of O. When `X_WO` moves, so do the stored references of its robot's hands, so
//! that what the robot is told stays where it is: a correction moves no hand and no foot, and the mean of all
//! hands, where the object is, stays too. What changes is the way from then on: which way the robot is told to
//! go, and how far from its hands the object turns.
//!
//! On ground that is not flat a robot that lands has its height from a foot that comes to rest while it bears: heights
//! part as well, by a millimetre with a step.
//!
//! Odometry errs by steps, so frames move while the team steps, and rest while it stands. Where an internal row
//! is under position control, hands are asked to part, and nothing tells that from odometry: frames rest.

use crate::build::BuildCoordinatorError;
use crate::grasp::GraspCompliance;
use crate::tips::Tip;
use bytemuck::{Pod, Zeroable};
use mikoshi_config::scenario::Scenario;
use mikoshi_cooperation::{Control, HybridLaw, HybridState, Landmark, LandmarkParameters, Sighting};
use mikoshi_ipc_types::{MAX_HANDS_OF_TEAM, MAX_ROBOTS};
use mikoshi_spatial::{Hand, Odometry, Pose, Twist, World, Wrench, exp};
use nalgebra::Vector3;

/// Robots that walk with .04 m/s part by .25 mm/s, and by four times that where feet are believed to stand where
/// they were sent: this leaves them 1 mm off, or 4. Their sway of some millimetres comes and goes with every second
/// step of .8 s, and is averaged.
const TIME_CONSTANT_S: f64 = 4.0;
/// On boards robots part by 1 mm/s in height, step for step. They hardly sway up and down.
const HEIGHT_TIME_CONSTANT_S: f64 = 1.0;
/// Heights that differ by less are how legs and grasps yield: on flat ground no frame is raised.
const HEIGHT_TOLERANCE_M: f64 = 0.002;
/// Several times what a robot that walks fast drifts.
const LIMIT_M_S: f64 = 0.01;
const LIMIT_RAD_S: f64 = 0.02;

/// Keeps the robots' odometries together. Immutable.
#[derive(Clone, Debug)]
pub(crate) struct OdometryFrames {
    /// Absent where the scenario turns it off, or nothing would tell drift from what is asked for.
    landmark: Option<Landmark>,
}

/// O in Σo, robot by robot.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OdometryState {
    frames: [LevelFrame; MAX_ROBOTS],
}

/// A level frame: what is stored can't tilt.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct LevelFrame {
    x_m: f64,
    y_m: f64,
    z_m: f64,
    yaw_rad: f64,
}

// SAFETY: zeros are a valid value of floats.
unsafe impl Zeroable for LevelFrame {}
// SAFETY: `repr(C)` over floats only: no padding, any bit pattern valid.
unsafe impl Pod for LevelFrame {}
// SAFETY: as above.
unsafe impl Zeroable for OdometryState {}
// SAFETY: as above.
unsafe impl Pod for OdometryState {}

impl Default for OdometryState {
    /// As long as nobody has walked all agree.
    fn default() -> Self {
        Self { frames: [LevelFrame::default(); MAX_ROBOTS] }
    }
}

impl OdometryState {
    /// `X_WO` of each of so many robots; `None` if one is none.
    pub(crate) fn frames(&self, robots: usize) -> Option<[Pose<World, Odometry>; MAX_ROBOTS]> {
        let mut poses = [Pose::identity(); MAX_ROBOTS];
        for (pose, frame) in poses.iter_mut().zip(&self.frames).take(robots) {
            *pose = frame.pose()?;
        }
        Some(poses)
    }
}

impl LevelFrame {
    fn pose(&self) -> Option<Pose<World, Odometry>> {
        let Self { x_m, y_m, z_m, yaw_rad } = *self;
        let is_valid = [x_m, y_m, z_m, yaw_rad].iter().all(|value| value.is_finite());
        is_valid.then(|| Pose::new(Vector3::new(x_m, y_m, z_m), exp(&Vector3::new(0.0, 0.0, yaw_rad))))
    }

    fn moved(&self, motion: &Pose<World, World>, yaw_rad: f64) -> Self {
        let moved = motion.transform_point(&Vector3::new(self.x_m, self.y_m, self.z_m));
        Self { x_m: moved.x, y_m: moved.y, z_m: moved.z, yaw_rad: self.yaw_rad + yaw_rad }
    }
}

impl OdometryFrames {
    /// Of this scenario's team under this law.
    pub(crate) fn new(scenario: &Scenario, law: &HybridLaw) -> Result<Self, BuildCoordinatorError> {
        let mut internal = law.parameters().selection.rows().iter().skip(1);
        let parts_hands = internal.any(|row| row.contains(&Control::Position));
        let landmark = Landmark::new(&LandmarkParameters {
            period_s: scenario.control_period_s,
            time_constant_s: TIME_CONSTANT_S,
            height_time_constant_s: HEIGHT_TIME_CONSTANT_S,
            height_tolerance_m: HEIGHT_TOLERANCE_M,
            limit_m_s: LIMIT_M_S,
            limit_rad_s: LIMIT_RAD_S,
        })?;
        Ok(Self { landmark: (scenario.odometry.landmark && !parts_hands).then_some(landmark) })
    }

    /// One tick of a team that steps with its object in its hands.
    pub(crate) fn correct(
        &self,
        state: &mut OdometryState,
        hybrid: &mut HybridState<MAX_HANDS_OF_TEAM>,
        seen: &Seen<'_>,
    ) {
        let Some(landmark) = &self.landmark else { return };
        let mut sightings = [Sighting::default(); MAX_ROBOTS];
        let mut arms = 0..0;
        for (sighting, &count) in sightings.iter_mut().zip(seen.hands_of_robots) {
            arms = arms.end..arms.end + count;
            *sighting = seen.sighting(arms.clone());
        }
        let mut references = hybrid.hand_pose_ref.iter_mut();
        let robots = state.frames.iter_mut().zip(seen.hands_of_robots);
        let (sightings, _) = sightings.split_at(seen.hands_of_robots.len().min(MAX_ROBOTS));
        let corrections = landmark.corrections(sightings).zip(sightings);
        for ((frame, &count), (correction, sighting)) in robots.zip(corrections) {
            let references = references.by_ref().take(count);
            // Whoever doesn't hold the object sees nothing.
            if sighting.weight == 0.0 {
                references.for_each(drop);
                continue;
            }
            let motion = correction.motion();
            *frame = frame.moved(&motion, correction.yaw);
            for array in references {
                // Where they are none the law says so in the next tick.
                if let Some(X_WH) = Pose::<World, Hand>::from_array(array) {
                    *array = (motion * X_WH).to_array();
                }
            }
        }
    }
}

/// What the team sees of the object in a tick.
pub(crate) struct Seen<'a> {
    /// Where each hand has the object, in hand order.
    pub tips: &'a [Option<Tip>],
    /// What each applies, filtered.
    pub hand_wrench: &'a [[f64; 6]],
    /// Weight of each tip in the mean of all (W⁻).
    pub shares: &'a [f64],
    /// Hands of each robot.
    pub hands_of_robots: &'a [usize],
    /// How grasps yield.
    pub compliance: &'a GraspCompliance,
}

impl Seen<'_> {
    /// Of the robot whose arms these are.
    fn sighting(&self, arms: core::ops::Range<usize>) -> Sighting {
        let (mut weight, mut tips, mut deviation) = (0.0, Vector3::zeros(), Twist::zero());
        let hands = self.tips.iter().zip(self.hand_wrench).zip(self.shares);
        let hands = hands.skip(arms.start).take(arms.len());
        let holding = hands.filter_map(|((tip, wrench), share)| Some((tip.as_ref()?, wrench, share)));
        let each = 1.0 / holding.clone().count().max(1) as f64;
        for (tip, wrench, share) in holding {
            weight += share;
            tips += tip.position * each;
            deviation +=
                (tip.off + self.compliance.tip_yield(&tip.lever, &Wrench::from_array(wrench))) * each;
        }
        Sighting { weight, tips, deviation }
    }
}
