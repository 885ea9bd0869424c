//! The object's reference motion: the scenario's velocities, or those of whoever drives, bounded by what the slowest
//! robot can follow (Fig. 10b) and by accelerations, and their integral.

use crate::step_clock::step_timing;
use bytemuck::{Pod, Zeroable};
use mikoshi_config::RunSpec;
use mikoshi_config::scenario::Segment;
use mikoshi_spatial::{Object, Pose, Twist, World};
use nalgebra::Vector3;

/// How far the object may go before a first foot comes down: hands go ahead of feet that stand, as far as they
/// may be ahead of a robot that walks before the object slows down for it.
const START_ROOM_M: f64 = 0.08;
/// The same of its turn.
const START_ROOM_RAD: f64 = 0.12;

/// The scenario's velocities over time, and how velocities may change.
#[derive(Clone, Debug)]
pub(crate) struct ObjectMotion {
    segments: Vec<Segment>,
    period_s: f64,
    /// Largest change of velocity in a tick; of what is driven, largest loss \[m/s\].
    step_m_s: f64,
    /// The same of angular velocity \[rad/s\].
    step_rad_s: f64,
    /// Largest gain of what is driven \[m/s\].
    gain_m_s: f64,
    /// The same of angular velocity \[rad/s\].
    gain_rad_s: f64,
    /// Largest gain of velocity in a tick before a first foot has come down \[m/s\].
    start_step_m_s: f64,
    /// The same of angular velocity \[rad/s\].
    start_step_rad_s: f64,
}

/// Where the reference is, and how fast.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ObjectMotionState {
    /// Reference pose.
    pub pose: [f64; 7],
    /// Reference twist in the world, of the object's origin.
    pub twist: [f64; 6],
    /// How far along the operator's velocities the object is: it stands still when the team can't follow.
    pub path_time_s: f64,
}

// SAFETY: zeros are a valid value of floats.
unsafe impl Zeroable for ObjectMotionState {}
// SAFETY: `repr(C)` over floats only: no padding, any bit pattern valid.
unsafe impl Pod for ObjectMotionState {}

impl ObjectMotionState {
    /// At rest.
    pub(crate) fn at_rest(X_WA: &Pose<World, Object>) -> Self {
        Self { pose: X_WA.to_array(), twist: [0.0; 6], path_time_s: 0.0 }
    }

    /// Reference twist.
    pub(crate) fn twist(&self) -> Twist<World> {
        Twist::from_array(&self.twist)
    }
}

impl ObjectMotion {
    /// Of this run.
    pub(crate) fn new(run: &RunSpec) -> Self {
        let period_s = run.scenario.control_period_s;
        let first_landing_s = step_timing(&run.scenario).step(0) as f64 * period_s;
        let [step_m_s, step_rad_s] =
            run.scenario.object_braking().unwrap_or_default().map(|rate| rate * period_s);
        let gain = run.scenario.operator.drive.as_ref();
        let gain = gain.map(|drive| [drive.acceleration_m_s2, drive.angular_acceleration_rad_s2]);
        let [gain_m_s, gain_rad_s] =
            gain.map_or([step_m_s, step_rad_s], |gain| gain.map(|rate| rate * period_s));
        let to_go = |room: f64| 2.0 * room / (first_landing_s * first_landing_s) * period_s;
        Self {
            segments: run.motion.clone(),
            period_s,
            step_m_s,
            step_rad_s,
            gain_m_s,
            gain_rad_s,
            start_step_m_s: gain_m_s.min(to_go(START_ROOM_M)),
            start_step_rad_s: gain_rad_s.min(to_go(START_ROOM_RAD)),
        }
    }

    /// One tick: the twist goes towards `speed_share` of the operator's, and the pose with it; gently as long
    /// as feet don't follow. Returns the reference pose at the end of the tick; `None` if the state is no pose.
    pub(crate) fn advance(
        &self,
        state: &mut ObjectMotionState,
        speed_share: f64,
        feet_follow: bool,
    ) -> Option<Pose<World, Object>> {
        let X_WA = Pose::<World, Object>::from_array(&state.pose)?;
        let wanted = self.velocity_at(state.path_time_s);
        let last = state.twist();
        let start = |step: f64, start: f64| if feet_follow { step } else { start };
        let (linear, pace) = change(
            &last.linear,
            &(wanted.linear * speed_share),
            self.step_m_s,
            start(self.step_m_s, self.start_step_m_s),
        );
        let (angular, turning_pace) = change(
            &last.angular,
            &(wanted.angular * speed_share),
            self.step_rad_s,
            start(self.step_rad_s, self.start_step_rad_s),
        );
        let twist = Twist::new(linear, angular);
        let X_WA = X_WA.displaced(&(twist * self.period_s));
        *state = ObjectMotionState {
            pose: X_WA.to_array(),
            twist: twist.to_array(),
            path_time_s: state.path_time_s + self.period_s * speed_share * pace.min(turning_pace),
        };
        Some(X_WA)
    }

    /// The same for an object that is driven: towards `wanted`, within the limits that its driver has. It loses what it
    /// has too much before it gains anything.
    pub(crate) fn follow(
        &self,
        state: &mut ObjectMotionState,
        wanted: &Twist<World>,
        feet_follow: bool,
    ) -> Option<Pose<World, Object>> {
        let X_WA = Pose::<World, Object>::from_array(&state.pose)?;
        let last = state.twist();
        let start = |gain: f64, start: f64| if feet_follow { gain } else { start };
        let gain_m_s = start(self.gain_m_s, self.start_step_m_s);
        let gain_rad_s = start(self.gain_rad_s, self.start_step_rad_s);
        let twist = Twist::new(
            steered(&last.linear, &wanted.linear, self.step_m_s, gain_m_s),
            steered(&last.angular, &wanted.angular, self.step_rad_s, gain_rad_s),
        );
        let X_WA = X_WA.displaced(&(twist * self.period_s));
        (state.pose, state.twist) = (X_WA.to_array(), twist.to_array());
        Some(X_WA)
    }

    /// One tick in which the object goes up by `step_m`, and nowhere else. Returns the reference pose at the
    /// end of the tick; `None` if the state is no pose.
    pub(crate) fn lift(&self, state: &mut ObjectMotionState, step_m: f64) -> Option<Pose<World, Object>> {
        let up = Twist::new(Vector3::new(0.0, 0.0, step_m), Vector3::zeros());
        let X_WA = Pose::<World, Object>::from_array(&state.pose)?.displaced(&up);
        state.pose = X_WA.to_array();
        state.twist = (up * self.period_s.recip()).to_array();
        Some(X_WA)
    }

    /// Whether the operator asks for nothing more, and the object rests.
    pub(crate) fn is_over(&self, state: &ObjectMotionState) -> bool {
        let end_s: f64 = self.segments.iter().map(|segment| segment.duration_s).sum();
        state.path_time_s >= end_s && state.twist == [0.0; 6]
    }

    fn velocity_at(&self, mut time_s: f64) -> Twist<World> {
        for segment in &self.segments {
            if time_s < segment.duration_s {
                return Twist::new(segment.velocity_m_s.into(), segment.angular_velocity_rad_s.into());
            }
            time_s -= segment.duration_s;
        }
        Twist::zero()
    }
}

/// The velocity after a tick in which it may change by `step`, and gain only `gain`; and at which pace the way
/// goes on. What is lost while speed is gained at the rate a, v² / 2a, is gained again where it is lost, if
/// that takes as long; if a gain takes longer, by 1 / a' − 1 / a of v, the way waits for half of that.
fn change(from: &Vector3<f64>, target: &Vector3<f64>, step: f64, gain: f64) -> (Vector3<f64>, f64) {
    if target.norm() <= from.norm() {
        return (towards(from, target, step), 1.0);
    }
    let next = towards(from, target, gain);
    let pace = if next == *target { 1.0 } else { 0.5 * (1.0 + gain / step) };
    (next, pace)
}

/// The velocity after a tick in which it may lose `step`, and gain `gain`. What `target` has no use for is lost first.
fn steered(from: &Vector3<f64>, target: &Vector3<f64>, step: f64, gain: f64) -> Vector3<f64> {
    let kept = match from.try_normalize(0.0) {
        Some(along) => along * target.dot(&along).clamp(0.0, from.norm()),
        None => *from,
    };
    let next = towards(from, &kept, step);
    if next == kept { towards(&next, target, gain) } else { next }
}

/// `target`, or as far towards it as one step goes.
fn towards(from: &Vector3<f64>, target: &Vector3<f64>, step: f64) -> Vector3<f64> {
    let way = target - from;
    let length = way.norm();
    if length > step { from + way * (step / length) } else { *target }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOTION_STEP: f64 = 0.5 * 0.005;

    fn motion() -> ObjectMotion {
        let segment =
            |velocity_m_s| Segment { duration_s: 2.0, velocity_m_s, angular_velocity_rad_s: [0.0; 3] };
        ObjectMotion {
            segments: vec![segment([0.1, 0.0, 0.0]), segment([0.0, -0.05, 0.0])],
            period_s: 0.005,
            step_m_s: MOTION_STEP,
            step_rad_s: MOTION_STEP,
            gain_m_s: 0.2 * MOTION_STEP,
            gain_rad_s: 0.2 * MOTION_STEP,
            start_step_m_s: 0.1 * MOTION_STEP,
            start_step_rad_s: 0.1 * MOTION_STEP,
        }
    }

    fn run(speed_share: f64, ticks: usize) -> ObjectMotionState {
        let (motion, mut state) = (motion(), ObjectMotionState::at_rest(&Pose::identity()));
        for _ in 0..ticks {
            let last = state.twist();
            motion.advance(&mut state, speed_share, true).expect("a pose");
            assert!((state.twist().linear - last.linear).norm() <= MOTION_STEP * (1.0 + 1e-9));
        }
        state
    }

    #[test]
    fn the_object_goes_where_its_velocities_lead_and_rests() {
        let state = run(1.0, 2000);
        assert_eq!(state.twist, [0.0; 6]);
        // Each change takes time and gains what the next one loses, but for the last one's direction.
        assert!((state.pose[0] - 0.2).abs() < 0.02 && (state.pose[1] + 0.1).abs() < 0.02, "{:?}", state.pose);
    }

    #[test]
    fn a_team_that_is_half_as_fast_goes_the_same_way_in_twice_the_time() {
        let halfway = run(0.5, 400);
        assert!((halfway.path_time_s - 1.0).abs() < 1e-9);
        assert!((halfway.twist[0] - 0.05).abs() < 1e-12);
        let (early, late) = (run(0.5, 800), run(0.5, 2000));
        assert!(early.twist != [0.0; 6] && late.twist == [0.0; 6]);
    }

    #[test]
    fn an_object_is_lifted_straight_up_and_its_way_is_still_before_it() {
        let (motion, mut state) = (motion(), ObjectMotionState::at_rest(&Pose::identity()));
        for _ in 0..10 {
            motion.lift(&mut state, 1e-3).expect("a pose");
        }
        assert!((state.pose[2] - 0.01).abs() < 1e-12 && state.pose[..2] == [0.0; 2]);
        assert!((state.twist[2] - 0.2).abs() < 1e-12 && state.path_time_s == 0.0);
    }

    #[test]
    fn before_a_foot_has_landed_the_object_gains_speed_slowly_and_still_goes_where_its_velocities_lead() {
        let (motion, mut state) = (motion(), ObjectMotionState::at_rest(&Pose::identity()));
        for tick in 1..=1000 {
            motion.advance(&mut state, 1.0, tick > 420).expect("a pose");
            if tick == 100 {
                assert!((state.twist[0] - 100.0 * motion.start_step_m_s).abs() < 1e-12, "{:?}", state.twist);
            }
        }
        assert_eq!(state.twist, [0.0; 6]);
        assert!((state.pose[0] - 0.2).abs() < 2e-3, "{:?}", state.pose);
    }

    #[test]
    fn what_is_driven_brakes_faster_than_it_gains_and_before_it_does() {
        let (motion, mut state) = (motion(), ObjectMotionState::at_rest(&Pose::identity()));
        let to = |x, y| Twist::new(Vector3::new(x, y, 0.0), Vector3::zeros());
        let mut ticks = |wanted: Twist<World>| {
            let mut ticks = 0;
            while state.twist() != wanted {
                let last = state.twist().linear;
                motion.follow(&mut state, &wanted, true).expect("a pose");
                let (lost, gained) = (last - state.twist().linear, state.twist().linear.norm() - last.norm());
                assert!(lost.norm() < 1.2 * MOTION_STEP + 1e-12 && gained < 0.2 * MOTION_STEP + 1e-12);
                ticks += 1;
                assert!(ticks < 10_000, "{wanted:?}");
            }
            ticks
        };
        assert_eq!(ticks(to(0.1, 0.0)), 200);
        assert_eq!(ticks(to(0.0, 0.0)), 40);
        assert_eq!(ticks(to(0.1, 0.0)), 200);
        assert!((239..=241).contains(&ticks(to(-0.1, 0.0))), "back");
        assert!((239..=241).contains(&ticks(to(0.0, 0.1))), "aside");
        assert_eq!(state.path_time_s, 0.0);
    }

    #[test]
    fn a_team_that_can_not_follow_stands() {
        let state = run(0.0, 400);
        assert_eq!(state, ObjectMotionState::at_rest(&Pose::identity()));
    }
}
