//! What the last second of a run was like, tick by tick.

use core::f64::consts::PI;
use mikoshi_ipc_types::{Envelope, ServiceId};
use mikoshi_observation::{Observation, ObservedRun};
use mikoshi_runtime::{Call, Phase, TickSchedule};
use serde::{Serialize, Serializer};
use std::collections::VecDeque;

/// How far it looks back.
const WINDOW_S: f64 = 1.0;

/// The last second.
pub struct Window {
    phases: Vec<(ServiceId, Call)>,
    /// When the last result of each service was kept.
    kept_ns: Vec<u64>,
    /// Torque limits of each robot's joints.
    limits_nm: Vec<Vec<f64>>,
    moments: VecDeque<Moment>,
}

/// What is remembered of a tick.
struct Moment {
    /// When it was heard of, in this process's time.
    at_s: f64,
    tick: u64,
    /// When it began.
    stamp_ns: u64,
    /// By phase; none if its frame was lost.
    times: Vec<Option<Times>>,
    robots: Vec<RobotMoment>,
}

/// How long a phase waited for what it needs, and how long it worked on it.
#[derive(Clone, Copy)]
struct Times {
    wait_ns: u64,
    work_ns: u64,
}

/// How a robot was, or what was worst.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotMoment {
    /// From the measured zero moment point to the edge of the support.
    pub zmp_margin_m: f64,
    /// The same of the capture point.
    pub capture_point_margin_m: f64,
    /// Of the base from upright, as estimated.
    pub tilt_rad: f64,
    /// Of the drive that was nearest to its limit.
    pub torque_share: f64,
    /// Which drive that was.
    pub torque_joint: usize,
}

/// How long a phase took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct PhaseTimes {
    #[serde(rename = "phase", serialize_with = "as_text")]
    pub call: Call,
    pub work_p50_s: f64,
    pub work_p99_s: f64,
    pub wait_p50_s: f64,
    pub wait_p99_s: f64,
}

impl Window {
    /// Empty, of this run.
    pub fn new(schedule: &TickSchedule, observed: &ObservedRun) -> Self {
        // What the bridge publishes it has stepped before.
        let calls = schedule.phases().iter().filter(|phase| phase.call != Call::Publish);
        let phases: Vec<_> = calls.map(|phase: &Phase| (phase.service, phase.call)).collect();
        let limits = |robot: &mikoshi_observation::ObservedRobot| {
            robot.joints.iter().map(|joint| joint.torque_limit_nm).collect()
        };
        Self {
            kept_ns: vec![0; phases.len()],
            phases,
            limits_nm: observed.robots.iter().map(limits).collect(),
            moments: VecDeque::new(),
        }
    }

    /// Takes in a tick that was heard of at this time.
    pub fn take(&mut self, at_s: f64, observation: &Observation) {
        self.forget(at_s);
        let times = (0..self.phases.len()).map(|index| self.times(index, observation)).collect();
        let robots = (0..self.limits_nm.len()).map(|robot| self.robot(robot, observation)).collect();
        let stamp_ns = observation.object_truth.envelope.stamp_ns;
        self.moments.push_back(Moment { at_s, tick: observation.tick(), stamp_ns, times, robots });
    }

    /// Forgets what is older than the window by now.
    pub fn forget(&mut self, at_s: f64) {
        while self.moments.front().is_some_and(|moment| moment.at_s < at_s - WINDOW_S) {
            self.moments.pop_front();
        }
    }

    /// Ticks a second, of the whole run.
    pub fn rate_hz(&self) -> f64 {
        match (self.moments.front(), self.moments.back()) {
            (Some(first), Some(last)) if last.stamp_ns > first.stamp_ns => {
                (last.tick - first.tick) as f64 / (1e-9 * (last.stamp_ns - first.stamp_ns) as f64)
            }
            _ => 0.0,
        }
    }

    /// Results a second of one service.
    pub fn rate_of_hz(&self, service: ServiceId) -> f64 {
        let Some(index) = self.phases.iter().rposition(|phase| phase.0 == service) else { return 0.0 };
        let said = self.moments.iter().filter(|moment| moment.times[index].is_some()).count();
        self.rate_hz() * said as f64 / self.moments.len().max(1) as f64
    }

    /// How long the phases of a service took.
    pub fn phases_of(&self, service: ServiceId) -> Vec<PhaseTimes> {
        let phases = self.phases.iter().enumerate().filter(|(_, phase)| phase.0 == service);
        phases.filter_map(|(index, phase)| self.phase_times(index, phase.1)).collect()
    }

    /// What was worst of a robot, if it was heard of.
    pub fn worst_of(&self, robot: usize) -> Option<RobotMoment> {
        let moments = self.moments.iter().filter_map(|moment| moment.robots.get(robot).copied());
        moments.reduce(|worst, moment| RobotMoment {
            zmp_margin_m: worst.zmp_margin_m.min(moment.zmp_margin_m),
            capture_point_margin_m: worst.capture_point_margin_m.min(moment.capture_point_margin_m),
            tilt_rad: worst.tilt_rad.max(moment.tilt_rad),
            torque_share: worst.torque_share.max(moment.torque_share),
            torque_joint: match moment.torque_share > worst.torque_share {
                true => moment.torque_joint,
                false => worst.torque_joint,
            },
        })
    }

    fn phase_times(&self, index: usize, call: Call) -> Option<PhaseTimes> {
        let times = || self.moments.iter().filter_map(|moment| moment.times[index]);
        let quantiles = |of: fn(Times) -> u64| {
            let mut all: Vec<_> = times().map(of).collect();
            all.sort_unstable();
            let at = |share: f64| {
                let place = (share * all.len().saturating_sub(1) as f64).round() as usize;
                all.get(place).map(|&ns| 1e-9 * ns as f64)
            };
            Some((at(0.5)?, at(0.99)?))
        };
        let ((work_p50_s, work_p99_s), (wait_p50_s, wait_p99_s)) =
            (quantiles(|times| times.work_ns)?, quantiles(|times| times.wait_ns)?);
        Some(PhaseTimes { call, work_p50_s, work_p99_s, wait_p50_s, wait_p99_s })
    }

    /// When this phase waited and worked, by the stamps of what came of it.
    fn times(&mut self, index: usize, observation: &Observation) -> Option<Times> {
        let (service, call) = self.phases[index];
        let envelope = envelope_of(observation, service, call)?;
        // Whoever made this result had made another one before.
        let of_service = self.phases.iter().zip(&self.kept_ns).filter(|(phase, _)| phase.0 == service);
        let before_ns = of_service.map(|(_, kept_ns)| *kept_ns).max().unwrap_or_default();
        let before_ns = if before_ns == 0 { envelope.heard_ns } else { before_ns };
        self.kept_ns[index] = envelope.kept_ns;
        Some(Times {
            wait_ns: envelope.heard_ns.saturating_sub(before_ns),
            work_ns: envelope.kept_ns.saturating_sub(envelope.heard_ns),
        })
    }

    fn robot(&self, robot: usize, observation: &Observation) -> RobotMoment {
        let state = &observation.robot_state[robot].payload;
        let torques = &observation.sensors[robot].payload.joint_torque_nm;
        let share =
            |(joint, (torque_nm, limit_nm)): (usize, (&f64, &f64))| (joint, torque_nm.abs() / limit_nm);
        let shares = torques.iter().zip(&self.limits_nm[robot]).enumerate().map(share);
        let (torque_joint, torque_share) = shares
            .filter(|(_, share)| share.is_finite())
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or_default();
        RobotMoment {
            zmp_margin_m: state.zmp_margin_m,
            capture_point_margin_m: state.capture_point_margin_m,
            tilt_rad: tilt_rad(&state.base_pose),
            torque_share,
            torque_joint,
        }
    }
}

fn as_text<S: Serializer>(call: &Call, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(call)
}

/// The envelope of what a phase said in this tick; none if it was lost.
fn envelope_of(observation: &Observation, service: ServiceId, call: Call) -> Option<Envelope> {
    let (tick, envelope) = (
        observation.tick(),
        match (service, call) {
            (ServiceId::Bridge, _) => observation.sensors.first()?.envelope,
            (ServiceId::Coordinator, _) => observation.team_state.envelope,
            (ServiceId::Servo(robot), Call::Sense) => observation.robot_state.get(robot)?.envelope,
            (ServiceId::Servo(robot), _) => observation.joint_command.get(robot)?.envelope,
        },
    );
    (envelope.tick == tick).then_some(envelope)
}

/// The angle between a body's z axis and the vertical.
fn tilt_rad([_, _, _, _, x, y, _]: &[f64; 7]) -> f64 {
    let upright = 1.0 - 2.0 * (x * x + y * y);
    if upright.is_finite() { upright.clamp(-1.0, 1.0).acos() } else { PI }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_observation::{ObservedJoint, ObservedRobot};

    fn observed() -> ObservedRun {
        let joint = |torque_limit_nm| ObservedJoint {
            name: "joint".to_owned(),
            lower_rad: -1.0,
            upper_rad: 1.0,
            torque_limit_nm,
        };
        let robot = ObservedRobot {
            name: "A".to_owned(),
            mass_kg: 1.0,
            hands: 1,
            joints: vec![joint(10.0), joint(100.0)],
        };
        ObservedRun {
            control_period_s: 0.005,
            ticks: 1000,
            is_controlled: true,
            X_WBody_goal: None,
            robots: vec![robot],
            internal_rows: vec![],
        }
    }

    fn window() -> Window {
        let phases = [
            (ServiceId::Bridge, Call::Step),
            (ServiceId::Servo(0), Call::Sense),
            (ServiceId::Coordinator, Call::Coordinate),
            (ServiceId::Servo(0), Call::Act),
        ];
        Window {
            phases: phases.to_vec(),
            kept_ns: vec![0; phases.len()],
            limits_nm: vec![observed().robots[0].joints.iter().map(|joint| joint.torque_limit_nm).collect()],
            moments: VecDeque::new(),
        }
    }

    /// A tick of 5 ms: sensors at 0, the servo senses from 100 to 300 µs, acts from 1000 to 1500.
    fn tick(number: u64) -> Observation {
        let begin_ns = 1_000_000_000 + number * 5_000_000;
        let mut all = Observation::for_team(1);
        let stamp = |envelope: &mut Envelope, heard_us: u64, kept_us: u64| {
            envelope.tick = number;
            envelope.heard_ns = begin_ns + 1_000 * heard_us;
            envelope.kept_ns = begin_ns + 1_000 * kept_us;
            envelope.stamp_ns = envelope.kept_ns;
        };
        stamp(&mut all.object_truth.envelope, 0, 0);
        stamp(&mut all.sensors[0].envelope, 0, 0);
        stamp(&mut all.robot_state[0].envelope, 100, 300);
        stamp(&mut all.team_state.envelope, 400, 450);
        stamp(&mut all.joint_command[0].envelope, 1000, 1500);
        all.robot_state[0].payload.base_pose = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        all
    }

    #[test]
    fn a_phase_waits_from_what_its_service_kept_last_and_works_from_what_it_heard() {
        let mut window = window();
        (0..100).for_each(|number| window.take(0.005 * number as f64, &tick(number)));
        let near =
            |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found}, {expected}");
        near(window.rate_hz(), 200.0);
        let [sense, act] = window.phases_of(ServiceId::Servo(0))[..] else { panic!("two phases") };
        assert_eq!((sense.call, act.call), (Call::Sense, Call::Act));
        near(sense.work_p50_s, 200e-6);
        near(act.work_p99_s, 500e-6);
        // Since it has acted, 3500 µs of the tick before and 100 of this one.
        near(sense.wait_p50_s, 3.6e-3);
        near(act.wait_p50_s, 700e-6);
    }

    #[test]
    fn what_is_older_than_a_second_is_forgotten_and_who_is_silent_has_no_rate() {
        let mut window = window();
        (0..1000).for_each(|number| {
            let mut all = tick(number);
            if number % 2 == 1 {
                all.joint_command[0].envelope.tick = u64::MAX;
            }
            window.take(0.005 * number as f64, &all);
        });
        assert!((200..=202).contains(&window.moments.len()), "{}", window.moments.len());
        let rate_hz = window.rate_of_hz(ServiceId::Servo(0));
        assert!((rate_hz - 100.0).abs() < 1.5, "{rate_hz}");
        window.forget(100.0);
        assert_eq!((window.rate_hz(), window.worst_of(0)), (0.0, None));
        assert!(window.phases_of(ServiceId::Bridge).is_empty());
    }

    #[test]
    fn of_a_robot_the_worst_is_told() {
        let mut window = window();
        for (number, (margin_m, torque_nm)) in
            [(0.05, -9.0), (0.01, 5.0), (0.03, 1.0)].into_iter().enumerate()
        {
            let mut all = tick(number as u64);
            all.robot_state[0].payload.zmp_margin_m = margin_m;
            all.sensors[0].payload.joint_torque_nm[..2].copy_from_slice(&[torque_nm, 20.0]);
            window.take(0.0, &all);
        }
        let worst = window.worst_of(0).expect("it was heard of");
        assert_eq!((worst.zmp_margin_m, worst.torque_share, worst.torque_joint), (0.01, 0.9, 0));
        assert_eq!(worst.tilt_rad, 0.0);
    }

    #[test]
    fn a_robot_that_lies_is_tilted_by_a_right_angle() {
        let half = core::f64::consts::FRAC_1_SQRT_2;
        assert!((tilt_rad(&[0.0, 0.0, 0.0, half, 0.0, half, 0.0]) - PI / 2.0).abs() < 1e-12);
        // Turned about the vertical it is as upright as before.
        assert_eq!(tilt_rad(&[0.0, 0.0, 0.0, half, 0.0, 0.0, half]), 0.0);
    }
}
