//! A run's figures minute by minute: what grows, shows.

use crate::canonical::Observation;
use crate::internal::{JUDGED_AFTER_S, raise};
use crate::summary::MinuteSummary;
use crate::truth::TrackedObject;
use mikoshi_ipc_types::{MAX_ROBOTS, RobotState, RobotTruth, mode};
use mikoshi_spatial::{Base, Odometry, Pose, World};
use nalgebra::{Vector2, Vector3};

/// Length of what is summed up.
const WINDOW_S: f64 = 60.0;

/// Gathers a run's figures by the minute. Ticks come in order.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    period_s: f64,
    hybrid_since: Option<u64>,
    window: Window,
    done: Vec<MinuteSummary>,
}

#[derive(Clone, Debug, Default)]
struct Window {
    samples: u64,
    squares: [f64; 3],
    internal_sum_n: Vec<f64>,
    internal_samples: u64,
    /// What only grows or is overwritten.
    so_far: MinuteSummary,
}

impl Course {
    pub(crate) fn new(period_s: f64) -> Self {
        Self { period_s, hybrid_since: None, window: Window::at(0.0), done: vec![] }
    }

    pub(crate) fn observe(&mut self, object: &TrackedObject, observation: &Observation) {
        let tick = observation.tick();
        let time_s = tick as f64 * self.period_s;
        if time_s >= self.window.so_far.start_s + WINDOW_S {
            let next = Window::at(self.window.so_far.start_s + WINDOW_S);
            self.done.push(core::mem::replace(&mut self.window, next).finish());
        }
        let is_hybrid = mode::is_hybrid(observation.team_state.payload.team_mode);
        let since = is_hybrid.then(|| *self.hybrid_since.get_or_insert(tick));
        let is_judged = since.is_some_and(|since| (tick - since) as f64 * self.period_s >= JUDGED_AFTER_S);
        self.window.observe(object, observation, is_judged);
    }

    pub(crate) fn finish(mut self) -> Vec<MinuteSummary> {
        if self.window.samples > 0 {
            self.done.push(self.window.finish());
        }
        self.done
    }
}

impl Window {
    fn at(start_s: f64) -> Self {
        let zmp_margin_min_m = f64::INFINITY;
        Self { so_far: MinuteSummary { start_s, zmp_margin_min_m, ..Default::default() }, ..Self::default() }
    }

    fn observe(&mut self, object: &TrackedObject, observation: &Observation, is_judged: bool) {
        self.samples += 1;
        let so_far = &mut self.so_far;
        if let Some(X_WA_ref) = &object.X_WA_ref {
            let error = X_WA_ref.displacement_to(&object.X_WA).linear;
            for (square, error) in self.squares.iter_mut().zip(&error) {
                *square += error * error;
                raise(&mut so_far.object_peak_m, error.abs());
            }
        }
        if is_judged {
            self.internal_samples += 1;
            self.internal_sum_n.resize(object.internal.len(), 0.0);
            for (sum, row) in self.internal_sum_n.iter_mut().zip(&object.internal) {
                *sum += row.force.norm();
                raise(&mut so_far.internal_peak_n, row.force.norm());
            }
        }
        for truth in &observation.robot_truth {
            so_far.zmp_margin_min_m = so_far.zmp_margin_min_m.min(truth.payload.zmp_margin_m);
        }
        let at = object.X_WBody.translation;
        let odometry = [Pose::<World, Odometry>::identity().to_array(); MAX_ROBOTS];
        (so_far.odometry_apart_m, so_far.odometry_apart_rad) = apart(observation, &odometry, &at);
        let frames = &observation.team_state.payload.odometry_pose;
        (so_far.frames_apart_m, so_far.frames_apart_rad) = apart(observation, frames, &at);
    }

    fn finish(self) -> MinuteSummary {
        let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        MinuteSummary {
            object_rms_m: (largest(&self.squares) / self.samples.max(1) as f64).sqrt(),
            internal_mean_n: largest(&self.internal_sum_n) / self.internal_samples.max(1) as f64,
            ..self.so_far
        }
    }
}

/// How far two robots are apart about where a point of the world is, at most: level distance and angle, if
/// each robot's own world lies where `frames` have it.
fn apart(observation: &Observation, frames: &[[f64; 7]], at: &Vector3<f64>) -> (f64, f64) {
    let robots = observation.robot_truth.iter().zip(&observation.robot_state).zip(frames);
    let seen =
        robots.filter_map(|((truth, state), X_WO)| misplaced(&truth.payload, &state.payload, X_WO, at));
    let seen: Vec<_> = seen.collect();
    let pairs = || seen.iter().flat_map(|one| seen.iter().map(move |other| (one, other)));
    let distance = pairs().map(|(one, other)| (one.0 - other.0).norm()).fold(0.0, f64::max);
    let angle = pairs().map(|(one, other)| (one.1 - other.1).abs()).fold(0.0, f64::max);
    (distance, angle)
}

/// Where a robot has a point that is at `at`, and how far it is turned.
fn misplaced(
    truth: &RobotTruth,
    state: &RobotState,
    X_WO: &[f64; 7],
    at: &Vector3<f64>,
) -> Option<(Vector2<f64>, f64)> {
    let X_WB = Pose::<World, Base>::from_array(&truth.base_pose)?;
    let X_OB = Pose::<Odometry, Base>::from_array(&state.base_pose)?;
    let error: Pose<World, World> = Pose::<World, Odometry>::from_array(X_WO)? * X_OB * X_WB.inverse();
    let yaw = mikoshi_spatial::log(&error.rotation).z;
    Some((error.transform_point(at).xy(), yaw))
}
