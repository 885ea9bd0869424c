//! What must hold of kinematics in any posture.

#![allow(non_snake_case)]

mod common;

use common::{carry_posture, hrp2};
use mikoshi_humanoid::{Kinematics, Model};
use mikoshi_spatial::{Base, Foot, Pose, Twist, World, exp};
use nalgebra::{DVector, Matrix3xX, Matrix6, Matrix6xX, Vector3};

#[global_allocator]
static ALLOCATOR: assert_no_alloc::AllocDisabler = assert_no_alloc::AllocDisabler;

fn tilted() -> Pose<World, Base> {
    Pose::new(Vector3::new(0.3, -0.2, 0.7), exp(&Vector3::new(0.1, -0.3, 0.8)))
}

/// HRP-2 as it carries, on a tilted base.
fn posed() -> (Model, Kinematics, Vec<f64>) {
    let model = hrp2();
    let q = carry_posture(&model);
    let mut kinematics = Kinematics::new(&model);
    kinematics.update(&model, &tilted(), &q);
    (model, kinematics, q)
}

#[test]
fn the_stance_jacobian_is_the_whole_one_with_the_base_eliminated_through_the_stance_foot() {
    let (model, kinematics, _) = posed();
    let n = model.joint_count();
    let [mut J_stance, mut J] = [(); 2].map(|()| Matrix6xX::zeros(6 + n));
    let mut reduced = Matrix6xX::zeros(n);
    for stance in ["r_sole", "l_sole", "l_palm"] {
        let stance = model.find_frame(stance).unwrap();
        kinematics.frame_jacobian(&model, stance, &mut J_stance);
        let J_sb_inverse: Matrix6<f64> = J_stance.fixed_columns::<6>(0).try_inverse().unwrap();
        let base_from_joints = -J_sb_inverse * J_stance.columns(6, n);
        for frame in ["r_palm", "l_sole", "BODY", "r_sole", "HEAD_JOINT1"] {
            let frame = model.find_frame(frame).unwrap();
            kinematics.frame_jacobian(&model, frame, &mut J);
            let expected = J.columns(6, n) + J.fixed_columns::<6>(0) * &base_from_joints;
            reduced.fill(0.0);
            for (j, column) in kinematics.stance_columns(&model, frame, stance) {
                reduced.set_column(j, &column);
            }
            assert!((&reduced - expected).amax() < 1e-13);
        }
        let (mut J_com, mut reduced_com) = (Matrix3xX::zeros(6 + n), Matrix3xX::zeros(n));
        kinematics.com_jacobian(&model, &mut J_com);
        let expected = J_com.columns(6, n) + J_com.fixed_columns::<6>(0) * &base_from_joints;
        for (j, column) in kinematics.stance_com_columns(&model, stance).enumerate() {
            reduced_com.set_column(j, &column);
        }
        assert!((&reduced_com - expected).amax() < 1e-13);
    }
}

#[test]
fn twists_are_jacobians_times_generalized_velocities() {
    let (model, kinematics, _) = posed();
    let n = model.joint_count();
    let velocity = DVector::from_fn(6 + n, |i, _| (1.7 * i as f64).sin());
    let base_twist = Twist::from_vector(&velocity.fixed_rows::<6>(0).into());
    let joint_velocity = &velocity.as_slice()[6..];
    let mut J = Matrix6xX::zeros(6 + n);
    for frame in ["r_palm", "l_sole", "imu", "BODY"] {
        let frame = model.find_frame(frame).unwrap();
        kinematics.frame_jacobian(&model, frame, &mut J);
        let twist = kinematics.frame_twist(&model, frame, &base_twist, joint_velocity);
        assert!((twist.to_vector() - &J * &velocity).amax() < 1e-13);
    }
    let mut J_com = Matrix3xX::zeros(6 + n);
    kinematics.com_jacobian(&model, &mut J_com);
    let com_velocity = kinematics.com_velocity(&model, &base_twist, joint_velocity);
    assert!((com_velocity - J_com * velocity).amax() < 1e-13);
}

#[test]
fn a_pose_in_the_base_needs_no_other_joint_than_those_between() {
    let (model, kinematics, mut q) = posed();
    let sole = model.find_frame("l_sole").unwrap();
    let expected = tilted().inverse() * kinematics.frame_pose::<Foot>(&model, sole);
    for (j, joint) in model.joints().iter().enumerate() {
        if !joint.name.starts_with("LLEG") {
            q[j] = f64::NAN;
        }
    }
    let pose: Pose<Base, Foot> = model.pose_in_base(sole, &q);
    assert!(pose.displacement_to(&expected).to_vector().amax() < 1e-14);
}

#[test]
fn the_carry_posture_puts_palms_and_centre_of_mass_where_its_configuration_says() {
    let (model, mut kinematics, q) = posed();
    kinematics.update(&model, &Pose::new(Vector3::new(0.0, 0.0, 0.603), Default::default()), &q);
    let position = |frame: &str| kinematics.frame_position(&model, model.find_frame(frame).unwrap());
    let ground = (position("r_sole") + position("l_sole")) / 2.0;
    assert!(ground.z.abs() < 1e-3);
    // The posture is printed to a tenth of a degree.
    assert!((position("r_palm") - ground - Vector3::new(0.35, -0.25, 0.96)).amax() < 3e-3);
    assert!((position("l_palm") - ground - Vector3::new(0.35, 0.25, 0.96)).amax() < 3e-3);
    assert!((kinematics.com() - ground - Vector3::new(0.0, 0.0, 0.79)).amax() < 3e-3);
}

#[test]
fn nothing_survives_in_the_workspace_and_nothing_is_allocated() {
    let (model, mut kinematics, q) = posed();
    let n = model.joint_count();
    let frame = model.find_frame("r_palm").unwrap();
    let (mut J, mut J_com) = (Matrix6xX::zeros(6 + n), Matrix3xX::zeros(6 + n));
    kinematics.frame_jacobian(&model, frame, &mut J);
    kinematics.com_jacobian(&model, &mut J_com);
    let (mut J_again, mut J_com_again) = (J.clone(), J_com.clone());
    J_again.fill(f64::NAN);
    J_com_again.fill(f64::NAN);
    let com = kinematics.com();

    assert_no_alloc::assert_no_alloc(|| {
        kinematics.fill_with_nan();
        kinematics.update(&model, &tilted(), &q);
        kinematics.frame_jacobian(&model, frame, &mut J_again);
        kinematics.com_jacobian(&model, &mut J_com_again);
    });
    assert_eq!(kinematics.com(), com);
    assert_eq!(J_again, J);
    assert_eq!(J_com_again, J_com);
}
