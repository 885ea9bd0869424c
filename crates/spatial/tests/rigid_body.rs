//! Poses, twists and wrenches of one rigid body.

#![allow(non_snake_case)]

use core::f64::consts::PI;
use mikoshi_spatial::{
    Hand, Object, Pose, Tip, Twist, World, Wrench, euler_rate_matrix, euler_zyx, exp, log,
};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

prop_compose! {
    fn vector(size: f64)(v in prop::array::uniform3(-size..size)) -> Vector3<f64> { v.into() }
}
prop_compose! {
    fn attitude()(v in vector(1.8)) -> UnitQuaternion<f64> { exp(&v) }
}

fn pose<A: mikoshi_spatial::CoordinateFrame, B: mikoshi_spatial::CoordinateFrame>()
-> impl Strategy<Value = Pose<A, B>> {
    (vector(3.0), attitude()).prop_map(|(p, r)| Pose::new(p, r))
}

fn wrench() -> impl Strategy<Value = Wrench<World>> {
    (vector(100.0), vector(20.0)).prop_map(|(f, n)| Wrench::new(f, n))
}

fn twist() -> impl Strategy<Value = Twist<World>> {
    (vector(1.0), vector(1.7)).prop_map(|(v, w)| Twist::new(v, w))
}

fn is_close(a: &Pose<World, Hand>, b: &Pose<World, Hand>) -> bool {
    let d = a.displacement_to(b);
    d.linear.norm() < 1e-14 && d.angular.norm() < 1e-14
}

proptest! {
    #[test]
    fn displaced_undoes_displacement_to(a in pose::<World, Hand>(), b in pose()) {
        prop_assert!(is_close(&a.displaced(&a.displacement_to(&b)), &b));
    }

    #[test]
    fn displacement_to_undoes_displaced(a in pose::<World, Hand>(), d in twist()) {
        let found = a.displacement_to(&a.displaced(&d));
        prop_assert!((found - d).to_vector().norm() < 1e-14);
    }

    #[test]
    fn a_pose_times_its_inverse_is_the_identity(X_WH in pose::<World, Hand>(), p in vector(3.0)) {
        let identity = X_WH * X_WH.inverse();
        prop_assert!(identity.translation.norm() < 1e-14 && log(&identity.rotation).norm() < 1e-15);
        let there_and_back = X_WH.inverse().transform_point(&X_WH.transform_point(&p));
        prop_assert!((there_and_back - p).norm() < 1e-14);
    }

    #[test]
    fn composition_transforms_points_in_turn(
        X_WH in pose::<World, Hand>(), X_HB in pose::<Hand, Tip>(), p_B in vector(3.0)
    ) {
        let in_turn = X_WH.transform_point(&X_HB.transform_point(&p_B));
        prop_assert!(((X_WH * X_HB).transform_point(&p_B) - in_turn).norm() < 1e-14);
    }

    /// Eq. A1 against the moment's definition: n_B = n_H + (p_H − p_B) × f.
    #[test]
    fn shifted_wrench_has_the_same_moment_about_any_third_point(
        f_H in wrench(), p_WH in vector(2.0), p_WB in vector(2.0), p_WQ in vector(2.0)
    ) {
        let f_B = f_H.shifted(&(p_WH - p_WB));
        prop_assert_eq!(f_B.force, f_H.force);
        let about_Q = |f: &Wrench<World>, p: &Vector3<f64>| f.moment + (p - p_WQ).cross(&f.force);
        prop_assert!((about_Q(&f_B, &p_WB) - about_Q(&f_H, &p_WH)).norm() < 1e-11);
    }

    #[test]
    fn power_is_the_same_at_every_point_of_a_body(f_H in wrench(), v_H in twist(), p_HB in vector(2.0)) {
        let (f_B, v_B) = (f_H.shifted(&-p_HB), v_H.shifted(&p_HB));
        prop_assert!((f_B.power(&v_B) - f_H.power(&v_H)).abs() < 1e-11);
    }

    #[test]
    fn power_is_the_same_in_all_axes(f in wrench(), v in twist(), X_AW in pose::<Object, World>()) {
        let in_A = f.expressed_in(&X_AW).power(&v.expressed_in(&X_AW));
        prop_assert!((in_A - f.power(&v)).abs() < 1e-11);
    }

    #[test]
    fn both_parts_of_a_vector_turn_with_its_axes(f in wrench(), v in twist(), X_AW in pose::<Object, World>()) {
        let turned = |vector: &Vector3<f64>| X_AW.transform_point(vector) - X_AW.translation;
        let (f_A, v_A) = (f.expressed_in(&X_AW), v.expressed_in(&X_AW));
        prop_assert!((f_A.force - turned(&f.force)).norm() < 1e-12);
        prop_assert!((f_A.moment - turned(&f.moment)).norm() < 1e-12);
        prop_assert!((v_A.linear - turned(&v.linear)).norm() < 1e-12);
        prop_assert!((v_A.angular - turned(&v.angular)).norm() < 1e-12);
    }

    #[test]
    fn shifted_twist_is_the_rate_of_the_other_point(v_H in twist(), X_WH in pose::<World, Hand>(), p_HB_H in vector(2.0)) {
        let dt = 1e-6;
        let position = |sign: f64| X_WH.displaced(&(v_H * (sign * dt))).transform_point(&p_HB_H);
        let rate = (position(0.5) - position(-0.5)) / dt;
        let shifted = v_H.shifted(&(X_WH.rotation * p_HB_H));
        prop_assert!((shifted.linear - rate).norm() < 1e-8);
        prop_assert_eq!(shifted.angular, v_H.angular);
    }

    /// Eq. B1, by central differences of the attitude along each Euler angle.
    #[test]
    fn euler_rate_matrix_maps_rates_of_euler_angles_to_angular_velocity(
        yaw in -3.0..3.0, pitch in -1.5..1.5, roll in -3.0..3.0, rates in vector(1.0)
    ) {
        let dt = 1e-6;
        let at = |t: f64| {
            UnitQuaternion::from_euler_angles(roll + rates.z * t, pitch + rates.y * t, yaw + rates.x * t)
        };
        let angular_velocity = log(&(at(0.5 * dt) * at(-0.5 * dt).inverse())) / dt;
        prop_assert!((euler_rate_matrix(yaw, pitch) * rates - angular_velocity).norm() < 1e-8);
    }

    #[test]
    fn euler_angles_rebuild_the_attitude(rotation in attitude()) {
        let angles = euler_zyx(&rotation);
        let rebuilt = exp(&(Vector3::z() * angles.x)) * exp(&(Vector3::y() * angles.y)) * exp(&(Vector3::x() * angles.z));
        prop_assert!(log(&(rebuilt * rotation.inverse())).norm() < 1e-7);
    }

    #[test]
    fn poses_survive_the_array_bit_by_bit(X_WH in pose::<World, Hand>(), X_HB in pose::<Hand, Tip>(), d in twist()) {
        prop_assert_eq!(Pose::from_array(&X_WH.to_array()), Some(X_WH));
        let displaced = X_WH.displaced(&d);
        prop_assert_eq!(Pose::from_array(&displaced.to_array()), Some(displaced));
        let composed = X_WH * X_HB;
        prop_assert_eq!(Pose::from_array(&composed.to_array()), Some(composed));
    }

    #[test]
    fn vectors_survive_the_array(f in wrench(), v in twist()) {
        prop_assert_eq!(Wrench::from_array(&f.to_array()), f);
        prop_assert_eq!(Twist::from_vector(&v.to_vector()), v);
        prop_assert_eq!(&f.to_array()[..3], f.force.as_slice());
    }
}

#[test]
fn euler_rate_matrix_is_singular_at_a_pitch_of_90_degrees() {
    assert!(euler_rate_matrix(0.3, 0.5 * PI).determinant().abs() < 1e-15);
    assert!(euler_rate_matrix(0.3, 0.4 * PI).determinant().abs() > 0.3);
}

#[test]
fn arrays_that_are_no_pose_are_rejected() {
    let valid = [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0];
    assert!(Pose::<World, Hand>::from_array(&valid).is_some());
    for index in 0..7 {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut array = valid;
            array[index] = value;
            assert_eq!(Pose::<World, Hand>::from_array(&array), None, "{array:?}");
        }
    }
    for norm in [0.0, 1.0 - 2e-6, 1.0 + 2e-6, 2.0, -2.0, f64::MAX] {
        let mut array = valid;
        array[3] = norm;
        assert_eq!(Pose::<World, Hand>::from_array(&array), None, "{array:?}");
    }
}

#[test]
fn quaternions_within_rounding_of_unit_norm_are_accepted_and_normalised() {
    let pose = Pose::<World, Hand>::from_array(&[0.0, 0.0, 0.0, 0.6 + 5e-7, 0.0, 0.8, 0.0]).unwrap();
    assert!((pose.rotation.norm() - 1.0).abs() < 1e-15);
}

#[test]
fn finiteness_is_seen_in_every_component() {
    assert!(Pose::<World, Hand>::identity().is_finite());
    let mut pose = Pose::<World, Hand>::identity();
    pose.rotation.as_mut_unchecked().coords.z = f64::NAN;
    assert!(!pose.is_finite());
    assert!(
        !Pose::<World, Hand>::new(Vector3::new(0.0, 0.0, f64::INFINITY), UnitQuaternion::identity())
            .is_finite()
    );
    for index in 0..6 {
        let mut array = [0.0; 6];
        array[index] = f64::NAN;
        assert!(!Wrench::<World>::from_array(&array).is_finite());
        assert!(!Twist::<World>::from_array(&array).is_finite());
    }
}

#[test]
fn poses_are_equal_only_in_place_and_attitude() {
    let pose = Pose::<World, Hand>::new(Vector3::x(), exp(&Vector3::y()));
    assert_eq!(pose, pose.relabel());
    assert_ne!(pose, Pose::new(Vector3::x(), UnitQuaternion::identity()));
    assert_ne!(pose, Pose::new(Vector3::y(), pose.rotation));
}
