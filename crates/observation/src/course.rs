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

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_ipc_types::RobotState;
    use mikoshi_spatial::{Object, Twist, Wrench};

    /// Two minutes and a half of ticks of 1 s. The object is 1 mm off in the first minute and 3 mm from then on; an
    /// internal force grows by 1 N a tick; the second robot's odometry drifts by 1 mm a tick, which the team knows.
    fn course() -> Vec<MinuteSummary> {
        let mut course = Course::new(1.0);
        for tick in 0..150 {
            let mut observation = Observation::for_team(2);
            observation.object_truth.envelope.tick = tick;
            let team_state = &mut observation.team_state.payload;
            team_state.team_mode = mode::CARRY;
            team_state.odometry_pose.fill(Pose::<World, Odometry>::identity().to_array());
            let drift_m = 1e-3 * tick as f64;
            team_state.odometry_pose[1][0] = -drift_m;
            for (robot, (truth, state)) in
                observation.robot_truth.iter_mut().zip(&mut observation.robot_state).enumerate()
            {
                let X_WB = [0.5, 0.0, 0.7, 1.0, 0.0, 0.0, 0.0];
                truth.payload.base_pose = X_WB;
                truth.payload.zmp_margin_m = 0.05 - 1e-4 * tick as f64;
                state.payload = RobotState { base_pose: X_WB, ..state.payload };
                state.payload.base_pose[0] += drift_m * robot as f64;
            }
            let off_m = if tick < 60 { 0.001 } else { 0.003 };
            let X_WA = Pose::<World, Object>::identity();
            let object = TrackedObject {
                X_WBody: X_WA,
                X_WA,
                X_WA_ref: Some(X_WA.displaced(&Twist::new(Vector3::new(0.0, off_m, 0.0), Vector3::zeros()))),
                internal: vec![Wrench::new(Vector3::new(tick as f64, 0.0, 0.0), Vector3::zeros())],
            };
            course.observe(&object, &observation);
        }
        course.finish()
    }

    #[test]
    fn every_minute_is_told_of_itself() {
        let course = course();
        assert_eq!(course.iter().map(|minute| minute.start_s).collect::<Vec<_>>(), [0.0, 60.0, 120.0]);
        let about = |value: f64, expected: f64| (value - expected).abs() < 1e-12;
        for (minute, object_m) in course.iter().zip([0.001, 0.003, 0.003]) {
            assert!(about(minute.object_rms_m, object_m) && about(minute.object_peak_m, object_m));
        }
        for (minute, last) in course.iter().zip([59.0, 119.0, 149.0]) {
            assert_eq!(minute.internal_peak_n, last);
            assert!(about(minute.zmp_margin_min_m, 0.05 - 1e-4 * last));
            assert!(about(minute.odometry_apart_m, 1e-3 * last) && about(minute.frames_apart_m, 0.0));
        }
        // A law is judged from 3 s after its start on.
        assert!(about(course[0].internal_mean_n, 31.0) && about(course[1].internal_mean_n, 89.5));
    }

    #[test]
    fn worlds_that_are_turned_are_told_apart_where_the_object_is() {
        let mut observation = Observation::for_team(2);
        for (truth, state) in observation.robot_truth.iter_mut().zip(&mut observation.robot_state) {
            truth.payload.base_pose = [2.0, 0.0, 0.7, 1.0, 0.0, 0.0, 0.0];
            state.payload.base_pose = truth.payload.base_pose;
        }
        let turned = Pose::<World, Odometry>::identity()
            .displaced(&Twist::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 0.01)));
        let frames = [Pose::<World, Odometry>::identity().to_array(), turned.to_array()];
        let (distance, angle) = apart(&observation, &frames, &Vector3::new(0.0, 3.0, 1.0));
        assert!((distance - 3.0 * 2.0 * 0.005_f64.sin()).abs() < 1e-12, "{distance}");
        assert!((angle - 0.01).abs() < 1e-12);
    }
}
