//! Logarithm and exponential of SO(3): against 60-digit arithmetic, and at their edges.

use core::f64::consts::PI;
use mikoshi_spatial::{exp, log, skew};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Rotation vector and quaternion `[w, x, y, z]`: norms from 1e-300 to the double next to π. Computed from
/// the decimal values of the inputs with 60 digits (mpmath), then rounded.
#[rustfmt::skip]
const EXP: [([f64; 3], [f64; 4]); 11] = [
    ([4.8e-301, -6e-301, 6.4e-301], [1.0, 2.4e-301, -3e-301, 3.2e-301]),
    ([4.8e-13, -6e-13, 6.4e-13], [1.0, 2.4e-13, -3e-13, 3.2e-13]),
    ([4.32e-09, -5.4e-09, 5.76e-09], [1.0, 2.16e-09, -2.7e-09, 2.88e-09]),
    ([5.28e-09, -6.6e-09, 7.04e-09], [1.0, 2.64e-09, -3.3e-09, 3.52e-09]),
    ([4.8e-06, -6e-06, 6.4e-06], [0.9999999999875, 2.39999999999e-06, -2.9999999999875e-06, 3.1999999999866667e-06]),
    ([0.0048, -0.006, 0.0064], [0.9999875000260416, 0.0023999900000125, -0.0029999875000156252, 0.0031999866666833337]),
    ([0.48, -0.6, 0.64], [0.8775825618903728, 0.23012425853001744, -0.2876553231625218, 0.3068323447066899]),
    ([1.44, -1.8, 1.92], [0.07073720166770293, 0.4787975935699461, -0.5984969919624327, 0.6383967914265948]),
    ([1.50796416, -1.8849552, 2.01061888], [3.267948966047518e-07, 0.4799999999999744, -0.599999999999968, 0.6399999999999658]),
    ([1.5079644737184, -1.884955592148, 2.0106192982912], [4.89669988244921e-12, 0.48, -0.6, 0.64]),
    ([1.5079644737231006, -1.8849555921538759, 2.0106192982974673], [1.6781375032138267e-16, 0.48, -0.6000000000000001, 0.64]),
];

/// Quaternion `[w, x, y, z]` and rotation vector, likewise.
#[rustfmt::skip]
const LOG: [([f64; 4], [f64; 3]); 11] = [
    ([1.0, 2.4e-301, -3e-301, 3.2e-301], [4.8e-301, -6e-301, 6.4e-301]),
    ([1.0, 2.4e-13, -3e-13, 3.2e-13], [4.8e-13, -6e-13, 6.4e-13]),
    ([1.0, 2.16e-09, -2.7e-09, 2.88e-09], [4.32e-09, -5.4e-09, 5.76e-09]),
    ([1.0, 2.64e-09, -3.3e-09, 3.52e-09], [5.28e-09, -6.6e-09, 7.04e-09]),
    ([0.9999999999875, 2.39999999999e-06, -2.9999999999875e-06, 3.1999999999866667e-06], [4.8e-06, -6e-06, 6.4e-06]),
    ([0.9999875000260416, 0.0023999900000125, -0.002999987500015625, 0.0031999866666833333], [0.0048, -0.005999999999999999, 0.0064]),
    ([0.8775825618903728, 0.23012425853001744, -0.2876553231625218, 0.3068323447066899], [0.48, -0.6, 0.6399999999999999]),
    ([0.0707372016677029, 0.4787975935699461, -0.5984969919624327, 0.6383967914265949], [1.44, -1.8, 1.9200000000000002]),
    ([3.267948966192255e-07, 0.4799999999999744, -0.599999999999968, 0.6399999999999658], [1.50796416, -1.8849552, 2.01061888]),
    ([4.896619231321692e-12, 0.48, -0.6, 0.64], [1.5079644737184, -1.884955592148, 2.0106192982912]),
    ([1.1923132169163976e-16, 0.48, -0.6, 0.64], [1.5079644737231006, -1.8849555921538756, 2.0106192982974678]),
];

fn rotation_vector(norm: impl Strategy<Value = f64>) -> impl Strategy<Value = Vector3<f64>> {
    (direction(), norm).prop_map(|(axis, norm)| axis * norm)
}

fn direction() -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-1.0..1.0)
        .prop_map(Vector3::from)
        .prop_filter("has a direction", |v: &Vector3<f64>| v.norm() > 1e-3)
        .prop_map(|v: Vector3<f64>| v.normalize())
}

fn attitude() -> impl Strategy<Value = UnitQuaternion<f64>> {
    prop::array::uniform4(-1.0..1.0)
        .prop_filter("has a direction", |q: &[f64; 4]| q.iter().map(|x| x * x).sum::<f64>() > 1e-3)
        .prop_map(|[w, x, y, z]| UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)))
}

/// Angle between two attitudes \[rad\], right down to 0: twice the norm of the vector part.
fn angle_between(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> f64 {
    2.0 * (a.inverse() * b).imag().norm()
}

/// Σ [v]×ᵏ / k!, the exponential's definition.
fn exponential_series(v: &Vector3<f64>) -> Matrix3<f64> {
    let (mut sum, mut term) = (Matrix3::identity(), Matrix3::identity());
    for k in 1..40 {
        term = term * skew(v) / f64::from(k);
        sum += term;
    }
    sum
}

#[test]
fn exp_agrees_with_sixty_digit_arithmetic_from_0_to_pi() {
    for (v, [w, x, y, z]) in EXP {
        let q = exp(&v.into());
        let expected = Vector3::new(x, y, z);
        assert!((q.imag() - expected).norm() <= 4e-16 * expected.norm(), "{v:?}: {q:?}");
        assert!((q.w - w).abs() <= 4e-16, "{v:?}: {q:?}");
    }
}

#[test]
fn log_agrees_with_sixty_digit_arithmetic_from_0_to_pi() {
    for ([w, x, y, z], expected) in LOG {
        let expected = Vector3::from(expected);
        let quaternion = Quaternion::new(w, x, y, z);
        let v = log(&UnitQuaternion::new_unchecked(quaternion));
        assert!((v - expected).norm() <= 4e-16 * expected.norm(), "{quaternion:?}: {v:?}");
        // −q is the same rotation.
        assert_eq!(log(&UnitQuaternion::new_unchecked(-quaternion)), v);
    }
}

#[test]
fn half_turns_have_a_logarithm_of_norm_pi() {
    for axis in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.6, 0.0, -0.8)] {
        for w in [0.0, -0.0] {
            let half_turn = UnitQuaternion::new_unchecked(Quaternion::from_parts(w, axis));
            let v = log(&half_turn);
            assert!((v.norm() - PI).abs() < 1e-15);
            assert!(angle_between(&exp(&v), &half_turn) < 1e-15);
        }
    }
}

#[test]
fn the_identity_is_exact_both_ways() {
    assert_eq!(exp(&Vector3::zeros()), UnitQuaternion::identity());
    assert_eq!(log(&UnitQuaternion::identity()), Vector3::zeros());
    assert_eq!(log(&UnitQuaternion::new_unchecked(-Quaternion::identity())), Vector3::zeros());
}

proptest! {
    #[test]
    fn exp_undoes_log(rotation in attitude()) {
        let v = log(&rotation);
        prop_assert!(v.norm() <= PI + 1e-15);
        prop_assert!(angle_between(&exp(&v), &rotation) < 2e-15);
    }

    #[test]
    fn log_undoes_exp_below_pi(v in rotation_vector(0.0..PI - 1e-3)) {
        prop_assert!((log(&exp(&v)) - v).norm() <= 2e-15 * v.norm());
    }

    #[test]
    fn log_undoes_exp_near_0(v in rotation_vector((-300.0..-1.0).prop_map(|e| 10.0_f64.powf(e)))) {
        prop_assert!((log(&exp(&v)) - v).norm() <= 1e-15 * v.norm());
    }

    #[test]
    fn log_undoes_exp_near_pi(v in rotation_vector((-14.0..-1.0).prop_map(|e| PI - 10.0_f64.powf(e)))) {
        prop_assert!((log(&exp(&v)) - v).norm() <= 2e-15);
    }

    #[test]
    fn exp_is_the_series_that_defines_it(v in rotation_vector(0.0..PI)) {
        let difference = exp(&v).to_rotation_matrix().into_inner() - exponential_series(&v);
        prop_assert!(difference.amax() < 1e-14);
    }

    #[test]
    fn skew_is_the_cross_product(v in rotation_vector(0.0..10.0), w in rotation_vector(0.0..10.0)) {
        prop_assert!((skew(&v) * w - v.cross(&w)).norm() < 1e-14);
        prop_assert_eq!(skew(&v).transpose(), -skew(&v));
    }
}

#[test]
fn series_of_small_rotations_go_over_into_the_functions_without_a_step() {
    // A hundred steps on each side of where they meet, and far below.
    for step in 0..400 {
        let angle = 1e-2 * (1.0 + 1e-4 * f64::from(step - 100)) * if step < 300 { 1.0 } else { 1e-3 };
        let v = Vector3::new(0.6, 0.0, -0.8) * angle;
        let q = exp(&v);
        let sine = (0.5 * v.norm()).sin();
        assert!((q.imag().norm() - sine).abs() <= 4e-16 * sine, "exp of {angle}");
        assert!((q.w - (0.5 * v.norm()).cos()).abs() <= 2.3e-16, "exp of {angle}");
        assert!((log(&q) - v).norm() <= 5e-16 * angle, "log of exp of {angle}");
    }
}
