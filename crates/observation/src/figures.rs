//! The figures of a run, gathered tick by tick from ground truth.

use crate::canonical::Observation;
use crate::course::Course;
use crate::internal::{InternalFigures, raise};
use crate::load::LoadFigures;
use crate::members::MemberFigures;
use crate::summary::{
    InternalSummary, LoadSummary, MemberSummary, MinuteSummary, ModeSummary, ObjectSummary, RobotSummary,
};
use crate::truth::{FootTracker, ObjectTracker, TrackedObject};
use mikoshi_ipc_types::{MAX_FEET, MAX_JOINTS, ObjectTruth, RobotState, RobotTruth, mode};
use mikoshi_spatial::{Object, Pose, World};
use nalgebra::{Vector2, Vector3};
use std::collections::BTreeMap;

/// Length of the windows whose largest value counts.
pub(crate) const WINDOW_S: f64 = 0.2;
/// A drift is not divided by less.
const LEAST_WALK_M: f64 = 0.1;

/// What must be known of a robot to judge it.
#[derive(Clone, Debug)]
pub struct ObservedRobot {
    /// Its name.
    pub name: String,
    /// Its mass.
    pub mass_kg: f64,
    /// Hands that grasp.
    pub hands: usize,
    /// Name, position limits and torque limit of each joint.
    pub joints: Vec<ObservedJoint>,
}

/// A joint's limits.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub struct ObservedJoint {
    pub name: String,
    pub lower_rad: f64,
    pub upper_rad: f64,
    pub torque_limit_nm: f64,
}

/// What must be known of a run to judge it.
#[derive(Clone, Debug)]
pub struct ObservedRun {
    /// Period of a tick.
    pub control_period_s: f64,
    /// Number of ticks.
    pub ticks: u64,
    /// Whether the hybrid law is to start.
    pub is_controlled: bool,
    /// Where the object is to rest in the end, if it is to be set down.
    pub X_WBody_goal: Option<Pose<World, Object>>,
    /// The robots.
    pub robots: Vec<ObservedRobot>,
    /// Name and coefficients of each internal force (a row of C).
    pub internal_rows: Vec<(String, Vec<f64>)>,
}

/// Gathers a run's figures.
#[derive(Clone, Debug)]
pub struct Figures {
    run: ObservedRun,
    internal: InternalFigures,
    load: LoadFigures,
    members: MemberFigures,
    tracker: ObjectTracker,
    modes: Vec<(u64, u64)>,
    object: ObjectFigures,
    course: Course,
    robots: Vec<RobotFigures>,
    unintended_contact_ticks: u64,
}

/// What [`Figures`] come to.
#[derive(Clone, Debug, Default)]
#[allow(missing_docs)]
pub struct JudgedFigures {
    pub object: ObjectSummary,
    pub internal: Vec<InternalSummary>,
    pub internal_measurement_error_n: f64,
    pub internal_measurement_error_nm: f64,
    pub robots: Vec<RobotSummary>,
    pub fell: Vec<String>,
    pub unintended_contact_ticks: u64,
    pub drift_between_robots_m: f64,
    pub modes: Vec<ModeSummary>,
    pub minutes: Vec<MinuteSummary>,
    pub load: LoadSummary,
    pub members: Vec<MemberSummary>,
}

impl Figures {
    /// A zero moment point this near to the edge of the support is at the edge \[m\].
    pub const EDGE_M: f64 = 0.005;

    /// Nothing observed yet.
    pub fn new(run: ObservedRun) -> Self {
        let robots = run.robots.iter().map(RobotFigures::new).collect();
        Self {
            tracker: ObjectTracker::new(&run),
            internal: InternalFigures::new(&run),
            load: LoadFigures::default(),
            members: MemberFigures::new(
                run.control_period_s,
                run.robots.iter().map(|robot| (robot.name.clone(), robot.hands)),
            ),
            course: Course::new(run.control_period_s),
            run,
            modes: vec![],
            object: ObjectFigures::default(),
            robots,
            unintended_contact_ticks: 0,
        }
    }

    /// Takes in one tick. Ticks come in order.
    pub fn observe(&mut self, observation: &Observation) {
        let Some(object) = self.tracker.observe(observation) else {
            return;
        };
        self.object.observe(&object);
        self.course.observe(&object, observation);
        if self.is_end(observation.tick()) {
            self.object.observe_end(&observation.object_truth.payload);
        }
        let team_state = &observation.team_state.payload;
        self.members.observe(observation, &object);
        self.internal.observe(observation.tick(), object.internal, team_state);
        self.load.observe(observation.tick(), team_state);
        if self.modes.last().is_none_or(|(mode, _)| *mode != team_state.team_mode) {
            self.modes.push((team_state.team_mode, observation.tick()));
        }
        let seen = observation.robot_truth.iter().zip(&observation.robot_state);
        for (figures, (truth, state)) in self.robots.iter_mut().zip(seen) {
            figures.observe(&truth.payload, &state.payload);
            figures.note_edge(observation.tick(), &truth.payload);
        }
        if observation.object_truth.payload.unintended_contacts > 0 {
            self.unintended_contact_ticks += 1;
        }
    }

    /// Whether this is one of the last ticks, over which the end is judged.
    fn is_end(&self, tick: u64) -> bool {
        let window = (WINDOW_S / self.run.control_period_s).round() as u64;
        tick + window >= self.run.ticks
    }

    /// The largest difference between two robots' drifts.
    fn drift_between_robots_m(&self) -> f64 {
        let drifts = || self.robots.iter().map(RobotFigures::drift_m);
        drifts().flat_map(|a| drifts().map(move |b| (a - b).norm())).fold(0.0, f64::max)
    }

    /// The figures of all ticks observed.
    pub fn finish(self) -> JudgedFigures {
        let period_s = self.run.control_period_s;
        let (measurement_error_n, measurement_error_nm) = self.internal.measurement_error();
        let drift_between_robots_m = self.drift_between_robots_m();
        let robots = self.run.robots.iter().zip(&self.robots);
        JudgedFigures {
            object: self.object.finish(&self.run, self.tracker.X_BodyA()),
            internal_measurement_error_n: measurement_error_n,
            internal_measurement_error_nm: measurement_error_nm,
            fell: robots.clone().filter(|(_, f)| f.has_fallen).map(|(robot, _)| robot.name.clone()).collect(),
            robots: robots.map(|(robot, figures)| figures.finish(robot, period_s)).collect(),
            drift_between_robots_m,
            minutes: self.course.finish(),
            modes: self
                .modes
                .iter()
                .map(|(mode, tick)| ModeSummary {
                    mode: mode::name(*mode).to_owned(),
                    start_s: *tick as f64 * period_s,
                })
                .collect(),
            internal: self.internal.finish(),
            load: self.load.finish(period_s),
            members: self.members.finish(),
            unintended_contact_ticks: self.unintended_contact_ticks,
        }
    }
}

#[derive(Clone, Debug, Default)]
struct ObjectFigures {
    first: Option<Pose<World, Object>>,
    last: Option<Pose<World, Object>>,
    samples: u64,
    squares: [f64; 6],
    peaks: [f64; 6],
    end_samples: u64,
    support_force_end_sum_n: [f64; 3],
    speed_end_m_s: f64,
}

impl ObjectFigures {
    fn observe(&mut self, object: &TrackedObject) {
        self.first.get_or_insert(object.X_WBody);
        self.last = Some(object.X_WBody);
        let Some(X_WA_ref) = object.X_WA_ref else {
            return;
        };
        self.samples += 1;
        let error = X_WA_ref.displacement_to(&object.X_WA).to_array();
        for ((square, peak), error) in self.squares.iter_mut().zip(&mut self.peaks).zip(error) {
            *square += error * error;
            *peak = peak.max(error.abs());
        }
    }

    fn observe_end(&mut self, truth: &ObjectTruth) {
        self.end_samples += 1;
        for (sum, force) in self.support_force_end_sum_n.iter_mut().zip(truth.support_wrench) {
            *sum += force;
        }
        let [x, y, z, ..] = truth.twist;
        raise(&mut self.speed_end_m_s, Vector3::new(x, y, z).norm());
    }

    fn finish(&self, run: &ObservedRun, X_BodyA: Option<&Pose<Object, Object>>) -> ObjectSummary {
        let rms = self.squares.map(|sum| (sum / self.samples.max(1) as f64).sqrt());
        let travel = match (&self.first, &self.last) {
            (Some(first), Some(last)) => first.displacement_to(last).to_array(),
            _ => [0.0; 6],
        };
        let split = |v: [f64; 6]| ([v[0], v[1], v[2]], [v[3], v[4], v[5]]);
        let ((position_rms_m, attitude_rms_rad), (position_peak_m, attitude_peak_rad)) =
            (split(rms), split(self.peaks));
        let (travel_m, travel_rad) = split(travel);
        let goal_error = self.last.zip(run.X_WBody_goal).map(|(last, goal)| goal.displacement_to(&last));
        let (goal_error_m, goal_error_rad) = goal_error.map(|error| split(error.to_array())).unzip();
        ObjectSummary {
            position_rms_m,
            position_peak_m,
            attitude_rms_rad,
            attitude_peak_rad,
            travel_m,
            travel_rad,
            goal_error_m,
            goal_error_rad,
            speed_end_m_s: self.speed_end_m_s,
            support_force_end_n: self.support_force_end_sum_n.map(|sum| sum / self.end_samples.max(1) as f64),
            frame_offset_m: X_BodyA.map_or([0.0; 3], |X_BodyA| X_BodyA.translation.into()),
        }
    }
}

#[derive(Clone, Debug)]
struct RobotFigures {
    weight_n: f64,
    limits_rad: Vec<(f64, f64)>,
    feet: [FootTracker; MAX_FEET],
    walked_m: f64,
    /// Base's estimate minus truth at tick 0 and last.
    base_error_m: Option<(Vector2<f64>, Vector2<f64>)>,
    zmp_margin_min_m: f64,
    edge_tick: Option<u64>,
    foot_slip_max_m: f64,
    tilt_max_rad: f64,
    steps: u64,
    saturated_ticks: u64,
    torque_peak_nm: [f64; MAX_JOINTS],
    joint_margin_min_rad: (f64, usize),
    has_fallen: bool,
}

impl RobotFigures {
    fn new(robot: &ObservedRobot) -> Self {
        Self {
            weight_n: robot.weight_n(),
            limits_rad: robot.joints.iter().map(|joint| (joint.lower_rad, joint.upper_rad)).collect(),
            feet: [FootTracker::default(); MAX_FEET],
            walked_m: 0.0,
            base_error_m: None,
            zmp_margin_min_m: f64::INFINITY,
            edge_tick: None,
            foot_slip_max_m: 0.0,
            tilt_max_rad: 0.0,
            steps: 0,
            saturated_ticks: 0,
            torque_peak_nm: [0.0; MAX_JOINTS],
            joint_margin_min_rad: (f64::INFINITY, 0),
            has_fallen: false,
        }
    }

    fn observe(&mut self, truth: &RobotTruth, state: &RobotState) {
        self.zmp_margin_min_m = self.zmp_margin_min_m.min(truth.zmp_margin_m);
        self.tilt_max_rad = self.tilt_max_rad.max(truth.tilt_rad);
        self.has_fallen |= truth.fallen != 0;
        self.saturated_ticks += u64::from(truth.saturated_joints != 0);
        for (peak, torque) in self.torque_peak_nm.iter_mut().zip(truth.joint_torque_peak_nm) {
            *peak = peak.max(torque);
        }
        for (joint, (lower, upper)) in self.limits_rad.iter().enumerate() {
            let q = truth.joint_position_rad[joint];
            let margin = (q - lower).min(upper - q);
            if margin < self.joint_margin_min_rad.0 {
                self.joint_margin_min_rad = (margin, joint);
            }
        }
        for (index, foot) in self.feet.iter_mut().enumerate() {
            let step_m = foot.observe(truth, index, self.weight_n);
            self.steps += u64::from(step_m.is_some());
            // Two feet take two steps to bring the robot one step on.
            self.walked_m += step_m.unwrap_or(0.0) / 2.0;
            self.foot_slip_max_m = self.foot_slip_max_m.max(foot.slip_m());
        }
        let horizontal = |pose: &[f64; 7]| Vector2::new(pose[0], pose[1]);
        let error = horizontal(&state.base_pose) - horizontal(&truth.base_pose);
        self.base_error_m = Some((self.base_error_m.map_or(error, |(first, _)| first), error));
    }

    fn note_edge(&mut self, tick: u64, truth: &RobotTruth) {
        if truth.zmp_margin_m < Figures::EDGE_M {
            self.edge_tick.get_or_insert(tick);
        }
    }

    /// How far the base's estimate has moved against the truth.
    fn drift_m(&self) -> Vector2<f64> {
        self.base_error_m.map_or_else(Vector2::zeros, |(first, last)| last - first)
    }

    fn finish(&self, robot: &ObservedRobot, control_period_s: f64) -> RobotSummary {
        let by_name = |value: &dyn Fn(usize, &ObservedJoint) -> f64| -> BTreeMap<String, f64> {
            robot.joints.iter().enumerate().map(|(i, joint)| (joint.name.clone(), value(i, joint))).collect()
        };
        let (joint_margin_min_rad, nearest) = self.joint_margin_min_rad;
        RobotSummary {
            name: robot.name.clone(),
            zmp_margin_min_m: self.zmp_margin_min_m,
            zmp_edge_s: self.edge_tick.map(|tick| tick as f64 * control_period_s),
            foot_slip_max_m: self.foot_slip_max_m,
            tilt_max_rad: self.tilt_max_rad,
            steps: self.steps,
            walked_m: self.walked_m,
            drift_m: self.drift_m().norm(),
            drift_m_per_m: self.drift_m().norm() / self.walked_m.max(LEAST_WALK_M),
            joint_margin_min_rad,
            joint_margin_joint: robot.joints.get(nearest).map(|j| j.name.clone()).unwrap_or_default(),
            saturated_ticks: self.saturated_ticks,
            torque_peak_nm: by_name(&|i, _| self.torque_peak_nm[i]),
            torque_limit_nm: by_name(&|_, joint| joint.torque_limit_nm),
        }
    }
}
