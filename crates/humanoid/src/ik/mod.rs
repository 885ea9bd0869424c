//! Whole-body inverse kinematics (eq. 41), closed on the commanded state.
//!
//! Joint increments δΘ follow the references of centre of mass, waist attitude, swinging foot and
//! hands, with the stance foot as base. Departures from eq. 41, each with its reason:
//! - "current" is the commanded state, not the measured one: measured angles make the droop of the
//!   drives, divided by the position gain, a standing error.
//! - The pseudo-inverse becomes a damped least-squares problem in a box. Position and velocity limits
//!   of every joint hold exactly, and weights that lie orders of magnitude apart decide who gives way
//!   where not all can be had: posture before hands, hands before feet, feet before balance. Where the leg that stands
//!   has no room left, the waist gives way, too, before the hands do.
//! - What freedom is left returns to a preferred posture and away from limits.
//! - In double support the other foot has a reference too, where it stands: held "where it is" it would
//!   keep every small error of linearization.

mod bounded_quadratic;
mod rows;
mod settle;

pub use settle::SettlePostureError;

use crate::balance::{PerFoot, Side};
use crate::kinematics::Kinematics;
use crate::model::{FrameId, Joint, MAX_HANDS, MAX_JOINTS, Model};
use bounded_quadratic::{ActiveSet, BoundedQuadratic};
use mikoshi_spatial::{Base, Foot, Hand, Pose, Twist, World, log};
use nalgebra::{UnitQuaternion, Vector3};
use rows::TaskRows;
use serde::{Deserialize, Serialize};
use serde_big_array::BigArray;
use thiserror::Error;

/// Which frames the tasks of eq. 41 move, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct IkConfig {
    /// Palms, at most [`MAX_HANDS`], in the order of the robot's hands.
    pub hands: Vec<FrameId>,
    /// Soles.
    pub feet: PerFoot<FrameId>,
    /// The link whose attitude is controlled.
    pub waist: FrameId,
    /// The posture to which the null space returns \[rad or m\], in the order of the model.
    pub posture: Vec<f64>,
    /// Control period \[s\].
    pub period_s: f64,
    /// Weights, damping and limits.
    pub gains: IkGains,
}

/// Weights, damping and limits of [`WholeBodyIk`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IkGains {
    /// Weight of the centre of mass and of the waist's attitude, per m² and rad².
    pub balance_weight: f64,
    /// Weight of the waist's attitude while a joint of the leg that stands has no room.
    pub leaning_weight: f64,
    /// Room of that joint beyond its limit's margin below which the waist's attitude loses weight \[rad\].
    pub leaning_zone: f64,
    /// Weight of the trunk's increments meanwhile: it would bend as far as it can to spare the waist.
    pub leaning_trunk_weight: f64,
    /// Weight of the foot that is not the base.
    pub foot_weight: f64,
    /// Weight of each hand.
    pub hand_weight: f64,
    /// λ: damping of the least squares, and weight λ² of the posture.
    pub damping: f64,
    /// Share of the way to the preferred posture that the null space goes in a tick.
    pub posture_gain: f64,
    /// Largest part of a task's error that one tick answers \[m\]: beyond it the linearization fails.
    pub step_m: f64,
    /// The same for attitudes \[rad\].
    pub step_rad: f64,
    /// What one tick's linearization leaves of an error that it could undo \[m and rad\].
    pub linearization_error: f64,
    /// How far from their position limits joints stop \[rad or m\].
    pub limit_margin: f64,
    /// Share of the way to a position limit that a joint may go in a tick, so that it arrives slowly.
    pub limit_approach: f64,
    /// Distance from a limit's margin at which the null space begins to flee it \[rad or m\].
    pub repulsion_zone: f64,
    /// Null-space step of a joint that stands at the margin \[rad or m\].
    pub repulsion_step: f64,
    /// Speed limit of joints that move one hand and nothing else, where it is below the model's
    /// \[rad/s\].
    pub arm_speed: Option<f64>,
    /// Largest acceleration of joints that are neither a leg's nor one arm's \[rad/s²\]: trunk and head would be thrown about
    /// for the sake of a leg that can't follow.
    pub trunk_acceleration: f64,
}

impl Default for IkGains {
    fn default() -> Self {
        Self {
            balance_weight: 1e5,
            leaning_weight: 0.1,
            leaning_zone: 0.06,
            leaning_trunk_weight: 100.0,
            foot_weight: 1e3,
            hand_weight: 1.0,
            damping: 0.02,
            posture_gain: 0.02,
            step_m: 0.02,
            step_rad: 0.05,
            linearization_error: 5e-5,
            limit_margin: 0.05,
            limit_approach: 0.2,
            repulsion_zone: 0.15,
            repulsion_step: 0.005,
            arm_speed: None,
            trunk_acceleration: 5.0,
        }
    }
}

/// A configuration that does not fit the model.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ConfigureIkError {
    /// More hands than fit on the wire.
    #[error("{0} hands; expected at most {MAX_HANDS}")]
    TooManyHands(usize),
    /// A posture of another robot.
    #[error("the posture has {found} joints; the model has {expected}")]
    PostureSize {
        /// Of the posture.
        found: usize,
        /// Of the model.
        expected: usize,
    },
    /// A number that has to be positive and finite.
    #[error("{name} is {value}; expected a positive number")]
    NotPositive {
        /// Which.
        name: &'static str,
        /// The value.
        value: f64,
    },
}

/// A tick without a solution: a reference or the state is not finite. The state is as before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("a reference or the commanded state is not finite")]
pub struct SolveIkError;

/// The commanded posture, and what the next tick starts from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct IkState {
    /// Commanded joint positions \[rad or m\]; zero past the model's joints.
    #[serde(with = "BigArray")]
    pub joint_position: [f64; MAX_JOINTS],
    /// The last tick's increment per period \[rad/s or m/s\].
    #[serde(with = "BigArray")]
    pub joint_velocity: [f64; MAX_JOINTS],
    active: ActiveSet,
    residual: Residual,
}

impl IkConfig {
    /// The same for ticks that are `times` as long: what is done in a tick is what was done in so many, and the null
    /// space pulls as strongly at what tasks hold.
    pub fn with_longer_ticks(&self, times: u64) -> Self {
        let count = times as f64;
        let compound = |share: f64| 1.0 - (1.0 - share).powf(count);
        let gains = &self.gains;
        let ratio = compound(gains.posture_gain) / gains.posture_gain;
        Self {
            period_s: self.period_s * count,
            gains: IkGains {
                posture_gain: compound(gains.posture_gain),
                step_m: gains.step_m * count,
                step_rad: gains.step_rad * count,
                // As the square of what joints move in a tick.
                linearization_error: gains.linearization_error * count * count,
                limit_approach: compound(gains.limit_approach),
                repulsion_step: gains.repulsion_step * ratio,
                damping: gains.damping / ratio.sqrt(),
                ..*gains
            },
            ..self.clone()
        }
    }
}

impl IkState {
    /// At rest in a posture, given in the order of the model.
    pub fn at_rest(posture: &[f64]) -> Self {
        let mut joint_position = [0.0; MAX_JOINTS];
        for (position, value) in joint_position.iter_mut().zip(posture) {
            *position = *value;
        }
        Self {
            joint_position,
            joint_velocity: [0.0; MAX_JOINTS],
            active: ActiveSet::default(),
            residual: Residual::default(),
        }
    }
}

/// What each task lacked after the last tick, at most one step of each: linear \[m\], angular \[rad\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Residual {
    com: [f64; 2],
    waist: [f64; 2],
    foot: [f64; 2],
    hands: [[f64; 2]; MAX_HANDS],
}

/// References of one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IkTargets {
    /// The foot that is the base.
    pub stance: Side,
    /// Poses of both soles. The stance foot's is exact by construction.
    pub feet: PerFoot<Pose<World, Foot>>,
    /// Centre of mass \[m\].
    pub com: Vector3<f64>,
    /// Attitude of the waist.
    pub waist_attitude: UnitQuaternion<f64>,
    /// Poses of the hands; one without is left to the posture.
    pub hands: [Option<Pose<World, Hand>>; MAX_HANDS],
}

/// What the commanded state is after a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IkReport {
    /// Commanded pose of the root link.
    pub base_pose: Pose<World, Base>,
    /// Commanded pose of each hand; the identity past their number.
    pub hand_poses: [Pose<World, Hand>; MAX_HANDS],
    /// Distance of each hand from its reference \[m\].
    pub hand_error_m: [f64; MAX_HANDS],
    /// Angle of each hand from its reference \[rad\].
    pub hand_error_rad: [f64; MAX_HANDS],
    /// Distance of the centre of mass from its reference \[m\].
    pub com_error_m: f64,
    /// Angle of the waist from its reference \[rad\].
    pub waist_error_rad: f64,
    /// Distance of the foot that is not the base from its reference \[m\].
    pub foot_error_m: f64,
    /// Angle of that foot from its reference \[rad\].
    pub foot_error_rad: f64,
    /// Smallest distance of a joint from its position limits \[rad or m\].
    pub joint_margin: f64,
    /// Joints whose position limit bounded this tick: bit j for joint j.
    pub at_position_limit: u64,
    /// Joints whose velocity limit bounded this tick.
    pub at_velocity_limit: u64,
}

/// Whole-body inverse kinematics of one robot (eq. 41). Immutable.
#[derive(Clone, Debug, PartialEq)]
pub struct WholeBodyIk {
    config: IkConfig,
    /// Largest increment of each joint in a tick.
    speed_step: [f64; MAX_JOINTS],
    /// Joints of the trunk.
    trunk: u64,
    /// Joints of each leg.
    legs: PerFoot<u64>,
}

/// Workspace of [`WholeBodyIk`]; it allocates at construction and never after.
#[derive(Clone, Debug)]
pub struct IkScratch {
    /// Of the commanded state; after [`WholeBodyIk::solve`] that of the tick's end.
    pub kinematics: Kinematics,
    rows: TaskRows,
    program: BoundedQuadratic,
}

impl IkScratch {
    /// A workspace for a robot.
    pub fn new(model: &Model) -> Self {
        Self {
            kinematics: Kinematics::new(model),
            rows: TaskRows::default(),
            program: BoundedQuadratic::new(model.joint_count()),
        }
    }

    /// Overwrites the workspace with NaN, for tests that nothing survives from tick to tick.
    pub fn fill_with_nan(&mut self) {
        self.kinematics.fill_with_nan();
        self.rows.fill_with_nan();
        self.program.fill_with_nan();
    }
}

/// One block of rows of eq. 41.
struct Task {
    /// What is missing, linear before angular.
    error: Twist<World>,
    /// What was missing after the last tick.
    residual: [f64; 2],
    /// Weight of the linear and of the angular rows.
    weight: [f64; 2],
}

impl WholeBodyIk {
    /// # Errors
    /// The configuration does not fit the model.
    pub fn new(model: &Model, config: IkConfig) -> Result<Self, ConfigureIkError> {
        let n = model.joint_count();
        if config.hands.len() > MAX_HANDS {
            return Err(ConfigureIkError::TooManyHands(config.hands.len()));
        }
        if config.posture.len() != n {
            return Err(ConfigureIkError::PostureSize { found: config.posture.len(), expected: n });
        }
        let gains = &config.gains;
        for (name, value) in [
            ("period_s", config.period_s),
            ("balance_weight", gains.balance_weight),
            ("leaning_weight", gains.leaning_weight),
            ("leaning_zone", gains.leaning_zone),
            ("leaning_trunk_weight", gains.leaning_trunk_weight),
            ("foot_weight", gains.foot_weight),
            ("hand_weight", gains.hand_weight),
            ("damping", gains.damping),
            ("step_m", gains.step_m),
            ("step_rad", gains.step_rad),
            ("limit_approach", gains.limit_approach),
            ("repulsion_zone", gains.repulsion_zone),
            ("arm_speed", gains.arm_speed.unwrap_or(1.0)),
            ("trunk_acceleration", gains.trunk_acceleration),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(ConfigureIkError::NotPositive { name, value });
            }
        }
        let (arms, trunk) = arm_and_trunk_joints(model, &config);
        let mut speed_step = [0.0; MAX_JOINTS];
        for (j, joint) in model.joints().iter().enumerate() {
            let cap = gains.arm_speed.filter(|_| arms >> j & 1 == 1).unwrap_or(f64::INFINITY);
            speed_step[j] = joint.velocity.min(cap) * config.period_s;
        }
        let legs = PerFoot::from_fn(|side| model.path(model.frame(config.feet[side]).body));
        Ok(Self { config, speed_step, trunk, legs })
    }

    /// What it was made from.
    pub fn config(&self) -> &IkConfig {
        &self.config
    }

    /// Pose of the root link while the stance foot of `targets` stands where it should, for joint
    /// positions in the order of the model: X_WB = X_WS X_BS⁻¹.
    pub fn base_pose(&self, model: &Model, joint_position: &[f64], targets: &IkTargets) -> Pose<World, Base> {
        let stance = targets.stance;
        let X_BS: Pose<Base, Foot> = model.pose_in_base(self.config.feet[stance], joint_position);
        targets.feet[stance] * X_BS.inverse()
    }

    /// One tick: moves the commanded state towards the references.
    ///
    /// # Errors
    /// A reference or the state is not finite; the state is left as it was.
    pub fn solve(
        &self,
        model: &Model,
        state: &mut IkState,
        scratch: &mut IkScratch,
        targets: &IkTargets,
    ) -> Result<IkReport, SolveIkError> {
        let gain = self.config.gains.trunk_acceleration * self.config.period_s;
        self.step(model, state, scratch, targets, (&self.speed_step, gain))
    }

    fn step(
        &self,
        model: &Model,
        state: &mut IkState,
        scratch: &mut IkScratch,
        targets: &IkTargets,
        limits: (&[f64; MAX_JOINTS], f64),
    ) -> Result<IkReport, SolveIkError> {
        let X_WB = self.base_pose(model, &state.joint_position, targets);
        scratch.kinematics.update(model, &X_WB, &state.joint_position);
        self.pose_tasks(model, state, scratch, targets);
        let at_position_bound = self.pose_bounds(model, state, scratch, limits);

        let mut active = state.active;
        scratch.program.minimize(&mut active).map_err(|_| SolveIkError)?;
        let mut next = *state;
        next.active = active;
        for (j, joint) in model.joints().iter().enumerate() {
            let increment = scratch.program.solution[j];
            next.joint_position[j] = (state.joint_position[j] + increment).clamp(joint.lower, joint.upper);
            next.joint_velocity[j] = increment / self.config.period_s;
        }

        let base_pose = self.base_pose(model, &next.joint_position, targets);
        scratch.kinematics.update(model, &base_pose, &next.joint_position);
        let active = active.lower | active.upper;
        let mut report = IkReport {
            base_pose,
            hand_poses: [Pose::identity(); MAX_HANDS],
            hand_error_m: [0.0; MAX_HANDS],
            hand_error_rad: [0.0; MAX_HANDS],
            com_error_m: 0.0,
            waist_error_rad: 0.0,
            foot_error_m: 0.0,
            foot_error_rad: 0.0,
            joint_margin: joint_margin(model, &next.joint_position),
            at_position_limit: active & at_position_bound,
            at_velocity_limit: active & !at_position_bound,
        };
        self.measure(model, &scratch.kinematics, targets, &mut report, &mut next.residual);
        *state = next;
        Ok(report)
    }

    /// Normal equations of all tasks, damping and posture.
    fn pose_tasks(&self, model: &Model, state: &IkState, scratch: &mut IkScratch, targets: &IkTargets) {
        let IkScratch { kinematics, rows, program } = scratch;
        let (config, gains, residual) = (&self.config, &self.config.gains, &state.residual);
        let stance = config.feet[targets.stance];

        for (j, mut column) in program.hessian.column_iter_mut().enumerate() {
            column.as_mut_slice()[j..].fill(0.0);
        }
        program.linear = [0.0; MAX_JOINTS];
        let damping = gains.damping * gains.damping;
        let leans = self.lack_of_room(model, state, targets.stance);
        for (j, joint) in model.joints().iter().enumerate() {
            let q = state.joint_position[j];
            let room = gains.limit_margin + gains.repulsion_zone;
            let nearness = |distance: f64| ((room - distance) / gains.repulsion_zone).clamp(0.0, 1.0);
            let flee = nearness(q - joint.lower).powi(2) - nearness(joint.upper - q).powi(2);
            let posture_step = gains.posture_gain * (config.posture[j] - q) + gains.repulsion_step * flee;
            let is_trunk = self.trunk >> j & 1 == 1;
            program.hessian[(j, j)] =
                if is_trunk { damping + gains.leaning_trunk_weight * leans } else { damping };
            program.linear[j] = damping * posture_step;
        }

        rows.pose_linear(kinematics.stance_com_columns(model, stance));
        self.add_task(
            program,
            rows,
            &Task {
                error: Twist::new(targets.com - kinematics.com(), Vector3::zeros()),
                residual: residual.com,
                weight: [gains.balance_weight, 0.0],
            },
        );

        let waist: Pose<World, Base> = kinematics.frame_pose(model, config.waist);
        rows.pose(kinematics.stance_columns(model, config.waist, stance));
        self.add_task(
            program,
            rows,
            &Task {
                error: Twist::new(Vector3::zeros(), attitude_error(&waist.rotation, &targets.waist_attitude)),
                residual: residual.waist,
                weight: [
                    0.0,
                    gains.balance_weight * (gains.leaning_weight / gains.balance_weight).powf(leans),
                ],
            },
        );

        let swing = targets.stance.opposite();
        let foot: Pose<World, Foot> = kinematics.frame_pose(model, config.feet[swing]);
        rows.pose(kinematics.stance_columns(model, config.feet[swing], stance));
        self.add_task(
            program,
            rows,
            &Task {
                error: foot.displacement_to(&targets.feet[swing]),
                residual: residual.foot,
                weight: [gains.foot_weight; 2],
            },
        );

        for ((&frame, target), &residual) in config.hands.iter().zip(&targets.hands).zip(&residual.hands) {
            let Some(target) = target else { continue };
            let hand: Pose<World, Hand> = kinematics.frame_pose(model, frame);
            rows.pose(kinematics.stance_columns(model, frame, stance));
            self.add_task(
                program,
                rows,
                &Task { error: hand.displacement_to(target), residual, weight: [gains.hand_weight; 2] },
            );
        }
    }

    /// How little room the leg that stands has left, 0 to 1: `ν = 1 − (r / r₀)²` with r the least room of one of its joints
    /// between its position and its limit's margin, and zone r₀. A joint that comes fast to its limit is slowed down before it
    /// is there.
    ///
    /// A leg with a joint at its limit has five left: what stands on it can't have centre of mass, height and attitude all
    /// as they are asked for. The centre of mass is balance itself, and hands would have to be moved by ten times what it
    /// lacks. The body leans on its hip for a third of it: of the weight w of the waist's attitude `w (w₀ / w)^ν` is left.
    fn lack_of_room(&self, model: &Model, state: &IkState, stance: Side) -> f64 {
        let zone = self.config.gains.leaning_zone;
        let room = |j: usize| {
            let (joint, q) = (&model.joints()[j], state.joint_position[j]);
            (q - joint.lower).min(joint.upper - q) - self.limit_margin(joint)
        };
        let leg = (0..model.joint_count()).filter(|j| self.legs[stance] >> j & 1 == 1);
        let share = leg.map(room).fold(zone, f64::min).max(0.0) / zone;
        1.0 - share * share
    }

    /// How far from its limits this joint stops: never so much that no room would be left.
    fn limit_margin(&self, joint: &Joint) -> f64 {
        self.config.gains.limit_margin.min(0.25 * (joint.upper - joint.lower))
    }

    /// Adds Jᵀ W J to the matrix and Jᵀ W e to the vector of the program, and damping for what the task
    /// lacks.
    ///
    /// Gauss-Newton leaves out the curvature of a task, about weight × residual × lever for each joint.
    /// Where a reference is out of reach the residual stays, and near a stretched limb the steps would
    /// overshoot and chatter; damping of that size prevents it (compare Sugihara, "Solvability-
    /// unconcerned inverse kinematics by the Levenberg-Marquardt method", 2011). A residual that this
    /// tick can undo adds nothing, so what is followed is followed without lag.
    fn add_task(&self, program: &mut BoundedQuadratic, rows: &mut TaskRows, task: &Task) {
        let gains = &self.config.gains;
        let error = Twist::<World>::new(
            shortened(task.error.linear, gains.step_m),
            shortened(task.error.angular, gains.step_rad),
        );
        rows.add_to(program, task.weight, &error.to_vector().into());
        if task.residual != [0.0; 2] {
            rows.add_damping(program, [0, 1].map(|half| 2.0 * (task.weight[half] * task.residual[half])));
        }
    }

    /// Bounds of every joint's increment; the set of joints of which the nearer bound is the position
    /// limit's.
    fn pose_bounds(
        &self,
        model: &Model,
        state: &IkState,
        scratch: &mut IkScratch,
        (speed_step, trunk_gain): (&[f64; MAX_JOINTS], f64),
    ) -> u64 {
        let gains = &self.config.gains;
        let program = &mut scratch.program;
        let mut by_position = 0;
        for (j, (joint, &speed)) in model.joints().iter().zip(speed_step).enumerate() {
            let q = state.joint_position[j];
            let margin = self.limit_margin(joint);
            let to_upper = gains.limit_approach * (joint.upper - margin - q);
            let to_lower = gains.limit_approach * (joint.lower + margin - q);
            if to_upper < speed || to_lower > -speed {
                by_position |= 1 << j;
            }
            // A joint beyond its margin comes back, as fast as its speed limit allows.
            program.upper[j] = to_upper.clamp(-speed, speed);
            program.lower[j] = to_lower.clamp(-speed, speed);
            if self.trunk >> j & 1 == 1 {
                // Limits of position go before.
                let (lower, upper) = (program.lower[j], program.upper[j]);
                let period_s = self.config.period_s;
                let around = |gain: f64| (state.joint_velocity[j] + gain) * period_s;
                program.lower[j] = around(-trunk_gain).clamp(lower, upper);
                program.upper[j] = around(trunk_gain).clamp(lower, upper);
            }
        }
        by_position
    }

    /// How far the commanded state is from the references.
    fn measure(
        &self,
        model: &Model,
        kinematics: &Kinematics,
        targets: &IkTargets,
        report: &mut IkReport,
        residual: &mut Residual,
    ) {
        let (config, gains) = (&self.config, &self.config.gains);
        let capped = |linear: f64, angular: f64| {
            let beyond = |error: f64, step: f64| (error.min(step) - gains.linearization_error).max(0.0);
            [beyond(linear, gains.step_m), beyond(angular, gains.step_rad)]
        };
        let distances = |error: Twist<World>| (error.linear.norm(), error.angular.norm());

        report.com_error_m = (targets.com - kinematics.com()).norm();
        residual.com = capped(report.com_error_m, 0.0);

        let waist: Pose<World, Base> = kinematics.frame_pose(model, config.waist);
        report.waist_error_rad = attitude_error(&waist.rotation, &targets.waist_attitude).norm();
        residual.waist = capped(0.0, report.waist_error_rad);

        let swing = targets.stance.opposite();
        let foot: Pose<World, Foot> = kinematics.frame_pose(model, config.feet[swing]);
        (report.foot_error_m, report.foot_error_rad) = distances(foot.displacement_to(&targets.feet[swing]));
        residual.foot = capped(report.foot_error_m, report.foot_error_rad);

        residual.hands = [[0.0; 2]; MAX_HANDS];
        for (i, &frame) in config.hands.iter().enumerate().take(MAX_HANDS) {
            report.hand_poses[i] = kinematics.frame_pose(model, frame);
            if let Some(target) = &targets.hands[i] {
                let (linear, angular) = distances(report.hand_poses[i].displacement_to(target));
                (report.hand_error_m[i], report.hand_error_rad[i]) = (linear, angular);
                residual.hands[i] = capped(linear, angular);
            }
        }
    }
}

/// Rotation vector from one attitude to another, in world axes.
fn attitude_error(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>) -> Vector3<f64> {
    log(&(to * from.inverse()))
}

/// The vector, or the part of it that has length `longest`.
fn shortened(vector: Vector3<f64>, longest: f64) -> Vector3<f64> {
    let norm = vector.norm();
    if norm > longest { vector * (longest / norm) } else { vector }
}

/// Smallest distance of a joint from its position limits; negative beyond them.
pub fn joint_margin(model: &Model, joint_position: &[f64]) -> f64 {
    let margins = model.joints().iter().zip(joint_position);
    margins.map(|(joint, q)| (q - joint.lower).min(joint.upper - q)).fold(f64::INFINITY, f64::min)
}

/// The joints that move exactly one hand and no foot, and those that are neither such nor move a foot.
fn arm_and_trunk_joints(model: &Model, config: &IkConfig) -> (u64, u64) {
    let path = |&frame: &FrameId| model.path(model.frame(frame).body);
    let feet = Side::BOTH.iter().fold(0, |set, &side| set | path(&config.feet[side]));
    let (mut once, mut more) = (0, 0);
    for hand in config.hands.iter().map(path) {
        more |= once & hand;
        once |= hand;
    }
    let arms = once & !more & !feet;
    (arms, !arms & !feet)
}
