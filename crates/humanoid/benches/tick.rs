//! What one robot costs per tick: kinematics, inverse kinematics, estimation. HRP-2 with two hands.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{carry_posture, hrp2, settled};
use divan::{Bencher, black_box};
use mikoshi_humanoid::balance::PerFoot;
use mikoshi_humanoid::estimate::{
    BaseEstimator, BaseEstimatorGains, FootContact, ForceTorqueSensor, Readings,
};
use mikoshi_humanoid::{FrameId, Kinematics, Model};
use mikoshi_spatial::{Pose, Twist, Wrench};
use nalgebra::{Matrix3xX, Matrix6xX, Vector3};

fn main() {
    divan::main();
}

fn frames<const N: usize>(model: &Model, names: [&str; N]) -> [FrameId; N] {
    names.map(|name| model.find_frame(name).expect("the description has it"))
}

#[divan::bench]
fn forward_kinematics_and_centre_of_mass(bencher: Bencher) {
    let model = hrp2();
    let q = carry_posture(&model);
    let mut kinematics = Kinematics::new(&model);
    bencher.bench_local(|| kinematics.update(&model, &Pose::identity(), black_box(&q)));
}

#[divan::bench]
fn four_jacobians_and_that_of_the_centre_of_mass(bencher: Bencher) {
    let model = hrp2();
    let mut kinematics = Kinematics::new(&model);
    kinematics.update(&model, &Pose::identity(), &carry_posture(&model));
    let columns = 6 + model.joint_count();
    let (mut jacobian, mut com_jacobian) = (Matrix6xX::zeros(columns), Matrix3xX::zeros(columns));
    let four = frames(&model, ["r_palm", "l_palm", "r_sole", "l_sole"]);
    bencher.bench_local(|| {
        for frame in four {
            kinematics.frame_jacobian(&model, black_box(frame), &mut jacobian);
        }
        kinematics.com_jacobian(&model, &mut com_jacobian);
    });
}

#[divan::bench]
fn inverse_kinematics_on_moving_references(bencher: Bencher) {
    let (mut setup, mut state) = settled();
    let start = setup.targets;
    let mut tick = 0.0_f64;
    bencher.bench_local(|| {
        tick += 1.0;
        let mut targets = start;
        let offset = Vector3::new(0.0, 0.02 * (tick * 0.005).sin(), 0.02 * (tick * 0.007).sin());
        for hand in targets.hands.iter_mut().flatten() {
            *hand = hand.displaced(&Twist::new(offset, Vector3::zeros()));
        }
        setup.ik.solve(&setup.model, &mut state, &mut setup.scratch, &targets)
    });
}

/// The worst that references do: both hands at speed limits, on the way to where they cannot go.
#[divan::bench]
fn inverse_kinematics_with_a_hand_out_of_reach(bencher: Bencher) {
    let (mut setup, start) = settled();
    let mut state = start;
    let mut tick = 0_u32;
    bencher.bench_local(|| {
        tick += 1;
        let side = if tick % 400 < 200 { 1.0 } else { -1.0 };
        let mut targets = setup.targets;
        for hand in targets.hands.iter_mut().flatten() {
            *hand = hand.displaced(&Twist::new(Vector3::new(0.5 * side, -0.3 * side, 0.2), Vector3::zeros()));
        }
        setup.ik.solve(&setup.model, &mut state, &mut setup.scratch, &targets)
    });
}

/// All that a standing robot does in a tick: estimate, wrenches, inverse kinematics.
#[divan::bench]
fn whole_tick_of_a_standing_robot(bencher: Bencher) {
    let (mut setup, mut state) = settled();
    let model = &setup.model;
    let estimator = BaseEstimator {
        imu: frames(model, ["imu"])[0],
        feet: setup.ik.config().feet,
        period_s: 0.005,
        gains: BaseEstimatorGains::default(),
    };
    let base = setup.ik.base_pose(model, &state.joint_position, &setup.targets);
    let mut memory = estimator.start(model, &base, &state.joint_position);
    let sensors = frames(model, ["r_wrist_sensor", "l_wrist_sensor", "r_ankle_sensor", "l_ankle_sensor"])
        .map(|frame| ForceTorqueSensor::new(model, frame));
    let mut measured = Kinematics::new(model);
    let feet = PerFoot::from_fn(|side| FootContact { pose: setup.targets.feet[side], weight: 0.5 });
    bencher.bench_local(|| {
        let readings = Readings {
            joint_position: &state.joint_position,
            joint_velocity: &state.joint_velocity,
            angular_velocity: Vector3::zeros(),
            specific_force: Vector3::new(0.0, 0.0, 9.81),
        };
        let estimate = estimator.update(&setup.model, &mut memory, &mut measured, &readings, &feet);
        let wrenches = sensors.map(|sensor| {
            sensor.applied_wrench(&setup.model, &measured, &Wrench::zero(), None, &Vector3::zeros())
        });
        let report = setup.ik.solve(&setup.model, &mut state, &mut setup.scratch, &setup.targets);
        (estimate, wrenches, report)
    });
}
