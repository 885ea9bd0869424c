//! What a robot knows of itself from its sensors.

#![allow(non_snake_case)]

mod common;

use common::{hrp2, settled};
use mikoshi_humanoid::balance::{GRAVITY_M_S2, PerFoot, Side};
use mikoshi_humanoid::estimate::{
    BaseEstimate, BaseEstimator, BaseEstimatorGains, CarriedMotion, FootContact, ForceTorqueSensor, Readings,
    SoleRectangle, SupportPolygon, zero_moment_point,
};
use mikoshi_humanoid::{IkTargets, Kinematics, Model};
use mikoshi_spatial::{Base, Foot, Pose, Sensor, Twist, World, Wrench, exp, log};
use nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};
use proptest::prelude::*;

#[global_allocator]
static ALLOCATOR: assert_no_alloc::AllocDisabler = assert_no_alloc::AllocDisabler;

const PERIOD_S: f64 = 0.005;

fn gravity() -> Vector3<f64> {
    Vector3::new(0.0, 0.0, -GRAVITY_M_S2)
}

// ---- Force sensors ----

/// HRP-2 in some posture on a tilted base.
fn posed() -> (Model, Kinematics) {
    let model = hrp2();
    let mut kinematics = Kinematics::new(&model);
    let q: Vec<f64> = (0..model.joint_count()).map(|j| 0.4 * (1.3 * j as f64).sin()).collect();
    kinematics.update(
        &model,
        &Pose::new(Vector3::new(0.3, 0.1, 0.7), exp(&Vector3::new(0.2, 0.5, -0.9))),
        &q,
    );
    (model, kinematics)
}

#[test]
fn a_hand_that_holds_nothing_and_rests_applies_nothing() {
    let (model, kinematics) = posed();
    let sensor = ForceTorqueSensor::new(&model, model.find_frame("r_wrist_sensor").unwrap());
    assert!(sensor.carried.mass_kg > 0.05);
    let X_WS: Pose<World, Sensor> = kinematics.frame_pose(&model, sensor.frame);
    // What the arm must apply to keep the hand up: its weight, upwards, at its centre.
    let support = Wrench::<World>::new(-gravity() * sensor.carried.mass_kg, Vector3::zeros())
        .shifted(&(X_WS.rotation * sensor.carried.com));
    let reading = support.expressed_in(&X_WS.inverse());
    let palm = kinematics.frame_position(&model, model.find_frame("r_palm").unwrap());
    let applied = sensor.applied_wrench(&model, &kinematics, &reading, None, &palm);
    assert!(applied.to_vector().amax() < 1e-12, "{applied:?}");
}

/// The carried part as four particles: Newton's second law for each, and nothing of Euler's.
#[test]
fn what_a_hand_applies_follows_from_newtons_law_for_each_of_its_particles() {
    let (model, kinematics) = posed();
    let frame = model.find_frame("l_wrist_sensor").unwrap();
    let particles = [
        (0.3, Vector3::new(0.05, 0.02, -0.1)),
        (0.2, Vector3::new(-0.03, 0.04, -0.05)),
        (0.4, Vector3::new(0.01, -0.05, -0.15)),
        (0.1, Vector3::new(0.07, 0.01, 0.02)),
    ];
    let mass_kg: f64 = particles.iter().map(|(m, _)| m).sum();
    let com = particles.iter().map(|(m, p)| p * *m).sum::<Vector3<f64>>() / mass_kg;
    let inertia = particles.iter().map(|(m, p)| {
        let d: Vector3<f64> = p - com;
        (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * *m
    });
    let carried = mikoshi_humanoid::model::Inertial { mass_kg, com, inertia: inertia.sum() };
    let sensor = ForceTorqueSensor { frame, carried };

    let motion = CarriedMotion {
        acceleration: Vector3::new(0.7, -1.1, 0.4),
        angular_velocity: Vector3::new(1.0, -2.0, 0.5),
        angular_acceleration: Vector3::new(-3.0, 1.0, 4.0),
    };
    let applied = Wrench::<World>::new(Vector3::new(3.0, -20.0, 8.0), Vector3::new(0.4, 1.0, -2.0));
    let X_WS: Pose<World, Sensor> = kinematics.frame_pose(&model, frame);
    let at = X_WS.translation + Vector3::new(0.1, 0.2, -0.3);

    // The sensor accelerates what the reaction of `applied` and gravity would not.
    let (w, alpha) = (motion.angular_velocity, motion.angular_acceleration);
    let mut support = applied.shifted(&(at - X_WS.translation));
    for (m, p) in particles {
        let (arm, from_com) = (X_WS.rotation * p, X_WS.rotation * (p - com));
        let acceleration = motion.acceleration + alpha.cross(&from_com) + w.cross(&w.cross(&from_com));
        let force = (acceleration - gravity()) * m;
        support += Wrench::new(force, arm.cross(&force));
    }
    let reading = support.expressed_in(&X_WS.inverse());
    let found = sensor.applied_wrench(&model, &kinematics, &reading, Some(&motion), &at);
    assert!((found.to_vector() - applied.to_vector()).amax() < 1e-12, "{found:?}");
}

#[test]
fn an_ankle_sensor_that_carries_no_mass_reads_the_ground_reversed() {
    let (model, kinematics) = posed();
    let sensor = ForceTorqueSensor::new(&model, model.find_frame("r_ankle_sensor").unwrap());
    let X_WS: Pose<World, Sensor> = kinematics.frame_pose(&model, sensor.frame);
    let ground = Wrench::<World>::new(Vector3::new(10.0, -5.0, 300.0), Vector3::new(2.0, 8.0, 1.0));
    let reading = (-ground).expressed_in(&X_WS.inverse());
    let applied = sensor.applied_wrench(&model, &kinematics, &reading, None, &X_WS.translation);
    assert!((applied.to_vector() + ground.to_vector()).amax() < 1e-11);
}

#[test]
fn the_zero_moment_point_is_where_the_ground_pushes() {
    let point = Vector3::new(0.3, -0.2, 0.05);
    let push = Wrench::<World>::new(Vector3::new(20.0, -30.0, 500.0), Vector3::new(0.0, 0.0, 7.0));
    let at_origin = push.shifted(&point);
    let zmp = zero_moment_point(&at_origin, point.z, 1.0).unwrap();
    assert!((zmp - point.xy()).norm() < 1e-14);
    // The same line of action meets lower ground elsewhere.
    let lower = zero_moment_point(&at_origin, 0.0, 1.0).unwrap();
    assert!((lower - (point.xy() - Vector2::new(20.0, -30.0) / 500.0 * point.z)).norm() < 1e-14);
}

#[test]
fn in_the_air_there_is_no_zero_moment_point() {
    for force in [0.5, 0.0, -100.0, f64::NAN] {
        let wrench = Wrench::<World>::new(Vector3::new(0.0, 0.0, force), Vector3::zeros());
        assert_eq!(zero_moment_point(&wrench, 0.0, 1.0), None);
    }
}

// ---- Support polygon ----

const SOLES: PerFoot<SoleRectangle> = PerFoot {
    right: SoleRectangle { x_min: -0.1056, x_max: 0.1356, y_min: -0.079, y_max: 0.059 },
    left: SoleRectangle { x_min: -0.1056, x_max: 0.1356, y_min: -0.059, y_max: 0.079 },
};

fn sole_at(x: f64, y: f64, yaw: f64) -> Option<Pose<World, Foot>> {
    Some(Pose::new(Vector3::new(x, y, 0.0), exp(&Vector3::new(0.0, 0.0, yaw))))
}

#[test]
fn two_soles_side_by_side_support_the_rectangle_around_both() {
    let polygon = SupportPolygon::of_feet(
        &SOLES,
        &PerFoot { right: sole_at(0.0, -0.095, 0.0), left: sole_at(0.0, 0.095, 0.0) },
    );
    assert_eq!(polygon.vertices().len(), 4);
    let distance = |x: f64, y: f64| polygon.signed_distance(&Vector2::new(x, y));
    assert!((distance(0.0, 0.0) - 0.1056).abs() < 1e-15);
    assert!((distance(0.12, 0.0) - 0.0156).abs() < 1e-15);
    assert!((distance(0.1656, 0.0) + 0.03).abs() < 1e-15);
    assert!((distance(0.1356 + 0.03, 0.174 + 0.04) + 0.05).abs() < 1e-15);
}

#[test]
fn one_sole_supports_itself_and_none_supports_nothing() {
    let one = SupportPolygon::of_feet(&SOLES, &PerFoot { right: sole_at(1.0, 2.0, 0.5), left: None });
    assert_eq!(one.vertices().len(), 4);
    let centre = sole_at(1.0, 2.0, 0.5).unwrap().transform_point(&Vector3::new(0.015, -0.01, 0.0));
    assert!((one.signed_distance(&centre.xy()) - 0.069).abs() < 1e-12);
    let none = SupportPolygon::of_feet(&SOLES, &PerFoot { right: None, left: None });
    assert_eq!(none.signed_distance(&Vector2::zeros()), f64::NEG_INFINITY);
}

proptest! {
    #[test]
    fn the_support_of_two_feet_is_convex_and_holds_both_soles(
        x in -0.3f64..0.3, y in -0.5f64..0.5, yaw in -3.0f64..3.0, yaw_too in -3.0f64..3.0,
        share in prop::collection::vec(0.0f64..1.0, 8),
    ) {
        let standing = PerFoot { right: sole_at(0.0, 0.0, yaw), left: sole_at(x, y, yaw_too) };
        let polygon = SupportPolygon::of_feet(&SOLES, &standing);
        let vertices = polygon.vertices();
        let n = vertices.len();
        prop_assert!((4..=8).contains(&n));
        for i in 0..n {
            let (a, b, c) = (vertices[i], vertices[(i + 1) % n], vertices[(i + 2) % n]);
            prop_assert!((b - a).perp(&(c - b)) > 0.0);
        }
        let mut corners = vec![];
        for side in Side::BOTH {
            let sole = SOLES[side];
            for corner in [(sole.x_min, sole.y_min), (sole.x_max, sole.y_min), (sole.x_max, sole.y_max), (sole.x_min, sole.y_max)] {
                let corner = standing[side].unwrap().transform_point(&Vector3::new(corner.0, corner.1, 0.0)).xy();
                prop_assert!(polygon.signed_distance(&corner) > -1e-12);
                corners.push(corner);
            }
        }
        // Any mean of corners lies within.
        let total: f64 = share.iter().sum::<f64>() + 1e-9;
        let mean = corners.iter().zip(&share).map(|(c, s)| c * (*s / total)).sum::<Vector2<f64>>();
        if share.iter().sum::<f64>() > 0.1 {
            prop_assert!(polygon.signed_distance(&mean) > -1e-8);
        }
    }
}

// ---- Base ----

/// A robot that sways and turns on two feet that stand, tick by tick: what its sensors would read and
/// where its base truly is.
struct Motion {
    model: Model,
    targets: IkTargets,
    posture: Vec<Vec<f64>>,
    base: Vec<Pose<World, Base>>,
}

impl Motion {
    fn sway(ticks: usize) -> Self {
        let (mut setup, mut state) = settled();
        let (start, mut posture, mut base) = (setup.targets, vec![], vec![]);
        for tick in 0..ticks {
            let phase = tick as f64 * PERIOD_S * core::f64::consts::TAU * 0.4;
            let mut targets = start;
            targets.com += Vector3::new(0.02 * phase.sin(), 0.03 * (1.0 - phase.cos()), 0.01 * phase.sin());
            targets.waist_attitude = exp(&Vector3::new(0.05 * phase.sin(), 0.0, 0.1 * (1.0 - phase.cos())));
            targets.hands = [None; 4];
            let report = setup.ik.solve(&setup.model, &mut state, &mut setup.scratch, &targets).unwrap();
            posture.push(state.joint_position[..setup.model.joint_count()].to_vec());
            base.push(report.base_pose);
        }
        Self { model: setup.model, targets: start, posture, base }
    }

    fn imu(&self, tick: usize) -> Pose<World, Sensor> {
        let imu = self.model.find_frame("imu").unwrap();
        self.base[tick] * self.model.pose_in_base::<Sensor>(imu, &self.posture[tick])
    }

    /// Central differences; the gyroscope's reading is the mean rate since the last tick.
    fn readings(&self, tick: usize) -> (Vec<f64>, Vector3<f64>, Vector3<f64>) {
        let rates = self.posture[tick + 1].iter().zip(&self.posture[tick - 1]);
        let rates = rates.map(|(next, last)| (next - last) / (2.0 * PERIOD_S)).collect();
        let [last, now, next] = [self.imu(tick - 1), self.imu(tick), self.imu(tick + 1)];
        let angular = log(&(last.rotation.inverse() * now.rotation)) / PERIOD_S;
        let acceleration = (next.translation - now.translation * 2.0 + last.translation) / PERIOD_S.powi(2);
        (rates, angular, now.rotation.inverse() * (acceleration - gravity()))
    }

    fn estimator(&self) -> BaseEstimator {
        let frame = |name| self.model.find_frame(name).unwrap();
        BaseEstimator {
            imu: frame("imu"),
            feet: PerFoot { right: frame("r_sole"), left: frame("l_sole") },
            period_s: PERIOD_S,
            gains: BaseEstimatorGains::default(),
        }
    }

    fn contacts(&self) -> PerFoot<FootContact> {
        PerFoot::from_fn(|side| FootContact { pose: self.targets.feet[side], weight: 1.0 })
    }

    /// Estimates of all ticks but the first and the last, starting from a base that is wrong by `error`.
    fn estimate(
        &self,
        error: UnitQuaternion<f64>,
        gyro_bias: Vector3<f64>,
        contacts: impl Fn(usize) -> PerFoot<FootContact>,
    ) -> Vec<BaseEstimate> {
        let estimator = self.estimator();
        let mut kinematics = Kinematics::new(&self.model);
        let mut start = self.base[0];
        start.rotation = error * start.rotation;
        let mut state = estimator.start(&self.model, &start, &self.posture[0]);
        (1..self.posture.len() - 1)
            .map(|tick| {
                let (joint_velocity, angular_velocity, specific_force) = self.readings(tick);
                let readings = Readings {
                    joint_position: &self.posture[tick],
                    joint_velocity: &joint_velocity,
                    angular_velocity: angular_velocity + gyro_bias,
                    specific_force,
                };
                let contacts = contacts(tick);
                assert_no_alloc::assert_no_alloc(|| {
                    estimator.update(&self.model, &mut state, &mut kinematics, &readings, &contacts)
                })
            })
            .collect()
    }

    /// Error of the pose, linear before angular.
    fn error(&self, estimates: &[BaseEstimate], tick: usize) -> Twist<World> {
        self.base[tick].displacement_to(&estimates[tick - 1].pose)
    }
}

#[test]
fn a_swaying_base_is_known_to_a_millimetre_and_a_milliradian() {
    let motion = Motion::sway(1000);
    let estimates = motion.estimate(UnitQuaternion::identity(), Vector3::zeros(), |_| motion.contacts());
    for tick in 1..999 {
        let error = motion.error(&estimates, tick);
        assert!(error.linear.norm() < 1e-3 && error.angular.norm() < 2e-3, "tick {tick}: {error:?}");
    }
}

#[test]
fn the_bases_twist_is_the_rate_of_its_pose() {
    let motion = Motion::sway(400);
    let estimates = motion.estimate(UnitQuaternion::identity(), Vector3::zeros(), |_| motion.contacts());
    for tick in 50..390 {
        let change = motion.base[tick - 1].displacement_to(&motion.base[tick + 1]) * (0.5 / PERIOD_S);
        let error = estimates[tick - 1].twist.to_vector() - change.to_vector();
        assert!(error.amax() < 3e-3, "tick {tick}: {error:?}");
    }
}

#[test]
fn a_wrong_start_is_forgotten() {
    let motion = Motion::sway(2000);
    let wrong = exp(&Vector3::new(0.03, -0.02, 0.05));
    let estimates = motion.estimate(wrong, Vector3::zeros(), |_| motion.contacts());
    assert!(motion.error(&estimates, 1).angular.norm() > 0.05);
    let error = motion.error(&estimates, 1990);
    assert!(error.linear.norm() < 1.5e-3 && error.angular.norm() < 2e-3, "{error:?}");
}

#[test]
fn a_biased_gyroscope_is_found_out() {
    let motion = Motion::sway(6000);
    let bias = Vector3::new(0.01, -0.008, 0.012);
    let estimates = motion.estimate(UnitQuaternion::identity(), bias, |_| motion.contacts());
    let without = motion.error(&estimates, 200).angular.norm();
    let with = motion.error(&estimates, 5990).angular.norm();
    assert!(without > 5e-3 && with < 0.4 * without, "{without} then {with}");
}

#[test]
fn a_foot_in_the_air_has_no_say() {
    let motion = Motion::sway(300);
    let nonsense = FootContact {
        pose: Pose::new(Vector3::new(9.0, 9.0, 9.0), exp(&Vector3::new(1.0, 1.0, 1.0))),
        weight: 0.0,
    };
    let contacts = |_| PerFoot { right: motion.contacts().right, left: nonsense };
    let estimates = motion.estimate(UnitQuaternion::identity(), Vector3::zeros(), contacts);
    let error = motion.error(&estimates, 290);
    assert!(error.linear.norm() < 1e-3 && error.angular.norm() < 2e-3, "{error:?}");
}

#[test]
fn without_a_foot_the_base_stays_where_it_was_last_known() {
    let motion = Motion::sway(100);
    let contacts = |tick| {
        let mut feet = motion.contacts();
        if tick > 50 {
            (feet.right.weight, feet.left.weight) = (0.0, 0.0);
        }
        feet
    };
    let estimates = motion.estimate(UnitQuaternion::identity(), Vector3::zeros(), contacts);
    assert_eq!(estimates[97].pose.translation, estimates[49].pose.translation);
    assert_eq!(estimates[97].twist.linear, Vector3::zeros());
}
