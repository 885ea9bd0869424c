//! Preview control against an independent solver, and against what it is for: following the zero moment
//! point of a walk.

use mikoshi_humanoid::gait::solve_discrete_riccati;
use mikoshi_humanoid::gait::{PreviewConfig, PreviewControl, PreviewState, SolvePreviewError, ZmpReference};
use nalgebra::{Matrix2, SMatrix, SVector, Vector2, Vector3};
use proptest::prelude::*;
use serde::Deserialize;

#[derive(Deserialize)]
struct Golden {
    control_period_s: f64,
    com_height_m: f64,
    horizon_s: f64,
    error_weight: f64,
    jerk_weight: f64,
    gain_error: f64,
    gain_state: [f64; 3],
    gain_preview: Vec<f64>,
}

fn goldens() -> Vec<Golden> {
    serde_json::from_str(include_str!("goldens/preview_gains.json")).expect("the golden file parses")
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * b.abs()
}

#[test]
fn gains_are_those_of_an_independent_riccati_solver() {
    for golden in goldens() {
        let control = PreviewControl::new(&PreviewConfig {
            control_period_s: golden.control_period_s,
            com_height_m: golden.com_height_m,
            horizon_s: golden.horizon_s,
            error_weight: golden.error_weight,
            jerk_weight: golden.jerk_weight,
            ..PreviewConfig::default()
        })
        .expect("solvable");
        assert!(close(control.gain_error(), golden.gain_error, 1e-9), "{}", control.gain_error());
        for (mine, theirs) in control.gain_state().iter().zip(golden.gain_state) {
            assert!(close(*mine, theirs, 1e-9), "{mine} {theirs}");
        }
        let (mine, theirs) = (control.gain_preview(), &golden.gain_preview);
        assert_eq!(mine.len(), theirs.len());
        let scale = theirs.iter().fold(0.0_f64, |scale, gain| scale.max(gain.abs()));
        for (mine, theirs) in mine.iter().zip(theirs).take(mine.len() - 1) {
            assert!((mine - theirs).abs() < 1e-9 * scale, "{mine} {theirs}");
        }
    }
}

#[test]
fn the_riccati_solution_leaves_no_residual_and_stabilises() {
    let a = Matrix2::new(1.0, 0.1, 0.3, 1.2);
    let b = SVector::<f64, 2>::new(0.0, 0.1);
    let q = Matrix2::new(1.0, 0.2, 0.2, 2.0);
    let r = 0.5;
    let p = solve_discrete_riccati(&a, &b, &q, r).expect("controllable");
    let gain = b.transpose() * p * a / (r + (b.transpose() * p * b).x);
    let residual = a.transpose() * p * a - a.transpose() * p * b * gain + q - p;
    assert!(residual.norm() < 1e-10 * p.norm(), "{residual}");
    let closed: SMatrix<f64, 2, 2> = a - b * gain;
    assert!(closed.complex_eigenvalues().iter().all(|value| value.norm() < 1.0));
}

#[test]
fn an_unstable_mode_out_of_reach_of_the_input_has_no_solution() {
    let a = Matrix2::new(1.5, 0.0, 0.0, 0.5);
    let b = SVector::<f64, 2>::new(0.0, 1.0);
    assert_eq!(solve_discrete_riccati(&a, &b, &Matrix2::identity(), 1.0), None);
}

#[test]
fn numbers_that_make_no_sense_are_refused() {
    for config in [
        PreviewConfig { control_period_s: 0.0, ..PreviewConfig::default() },
        PreviewConfig { com_height_m: -0.8, ..PreviewConfig::default() },
        PreviewConfig { horizon_s: f64::NAN, ..PreviewConfig::default() },
        PreviewConfig { jerk_weight: 0.0, ..PreviewConfig::default() },
    ] {
        assert_eq!(PreviewControl::new(&config), Err(SolvePreviewError::NotPositive));
    }
}

/// Four steps of .8 s and 10 cm, feet .17 m apart, from and to a stand.
fn walk() -> ZmpReference {
    let start = Vector2::new(0.0, 0.0);
    let mut reference = ZmpReference::resting(start);
    for step in 0..4 {
        let side = if step % 2 == 0 { 0.085 } else { -0.085 };
        let at = 400 + 160 * step;
        reference = reference.shift(at, at + 40, Vector2::new(0.1 * step as f64, side));
    }
    reference.shift(1040, 1080, Vector2::new(0.3, 0.0))
}

#[test]
fn the_zmp_of_a_known_walk_is_followed_within_millimetres() {
    let control = PreviewControl::new(&PreviewConfig::default()).expect("solvable");
    let reference = walk();
    let mut state = PreviewState::at_rest(reference.at(0));
    let (mut worst, mut sum, mut com_y) = (0.0_f64, 0.0, 0.0_f64);
    let ticks = 1600;
    for tick in 0..ticks {
        let error = control.advance(&mut state, &reference.later(tick));
        worst = worst.max(error.norm());
        sum += error.norm_squared();
        com_y = com_y.max(state.com.y.abs());
    }
    let rms = (sum / ticks as f64).sqrt();
    assert!(worst < 0.005, "peak ZMP error {worst} m");
    assert!(rms < 0.001, "RMS ZMP error {rms} m");
    assert!(com_y < 0.06, "the centre of mass stays between the feet: {com_y} m");
    assert!((state.com - Vector2::new(0.3, 0.0)).norm() < 1e-4);
    assert!(state.com_velocity.norm() < 1e-4);
}

#[test]
fn where_the_origin_lies_makes_no_difference() {
    let control = PreviewControl::new(&PreviewConfig::default()).expect("solvable");
    let (reference, far) = (walk(), Vector2::new(1000.0, -300.0));
    let mut near = PreviewState::at_rest(reference.at(0));
    let mut away = PreviewState::at_rest(reference.at(0) + far);
    for tick in 0..1600 {
        control.advance(&mut near, &reference.later(tick));
        control.advance(&mut away, &reference.later(tick).mapped(|point| point + far));
        assert!((away.com - far - near.com).norm() < 1e-6, "tick {tick}: {}", away.com - far - near.com);
    }
}

#[test]
fn a_robot_at_rest_over_its_reference_stays_there() {
    let control = PreviewControl::new(&PreviewConfig::default()).expect("solvable");
    let place = Vector2::new(3.2, -1.7);
    let mut state = PreviewState::at_rest(place);
    for _ in 0..2000 {
        control.advance(&mut state, &ZmpReference::resting(place));
    }
    assert!((state.com - place).norm() < 1e-9);
}

#[test]
fn a_plan_that_changes_at_short_notice_moves_the_zmp_by_centimetres_only() {
    let control = PreviewControl::new(&PreviewConfig::default()).expect("solvable");
    let walk = ZmpReference::resting(Vector2::zeros()).shift(80, 180, Vector2::new(0.0, 0.085));
    let mut state = PreviewState::at_rest(Vector2::zeros());
    let mut worst = 0.0_f64;
    for tick in 0..800 {
        control.advance(&mut state, &walk.later(tick));
        worst = worst.max((control.zmp(&state) - walk.at(tick + 1)).norm());
    }
    assert!(worst < 0.045, "{worst}");
    assert!((state.com.y - 0.085).abs() < 1e-4, "{}", state.com);
}

#[test]
fn the_linear_law_is_what_remains_without_a_limit() {
    let unlimited = PreviewConfig { deviation_max_m: f64::INFINITY, ..PreviewConfig::default() };
    let [limited, linear] =
        [PreviewConfig::default(), unlimited].map(|config| PreviewControl::new(&config).expect("solvable"));
    let reference = walk();
    let (mut a, mut b) = (PreviewState::at_rest(Vector2::zeros()), PreviewState::at_rest(Vector2::zeros()));
    for tick in 0..1600 {
        for (control, state) in [(&limited, &mut a), (&linear, &mut b)] {
            control.advance(state, &reference.later(tick));
        }
    }
    assert!((a.com - b.com).norm() < 1e-12, "a plan that was known in time never meets the limit");
}

#[test]
fn no_state_is_out_of_reach_of_the_limited_law() {
    let control = PreviewControl::new(&PreviewConfig::default()).expect("solvable");
    for (position, velocity) in [(0.5, 0.0), (0.0, 2.0), (-0.3, -1.0), (0.02, 0.05)] {
        let mut state = PreviewState::at_rest(Vector2::new(position, 0.0));
        state.com_velocity.x = velocity;
        for _ in 0..3000 {
            control.advance(&mut state, &ZmpReference::resting(Vector2::zeros()));
        }
        assert!(state.com.norm() < 1e-3, "from {position} m, {velocity} m/s to {}", state.com);
    }
}

/// Of any number of weight shifts, begun in the past or yet to come.
fn any_reference() -> impl Strategy<Value = ZmpReference> {
    let point = || (-1.0..1.0, -1.0..1.0).prop_map(|(x, y)| Vector2::new(x, y));
    let shift = (0_i64..150, 0_i64..60, point());
    (point(), -200_i64..300, proptest::collection::vec(shift, 0..5)).prop_map(|(rest, begin, shifts)| {
        let mut tick = begin;
        shifts.into_iter().fold(ZmpReference::resting(rest), |reference, (pause, length, point)| {
            let from = tick + pause;
            tick = from + length;
            reference.shift(from, tick, point)
        })
    })
}

proptest! {
    #[test]
    fn the_jerk_is_that_of_the_law_tick_by_tick(
        reference in any_reference(),
        com in -1.0..1.0,
        velocity in -1.0..1.0,
        acceleration in -3.0..3.0,
        error_sum in -0.1..0.1,
    ) {
        let config = PreviewConfig { deviation_max_m: f64::INFINITY, ..PreviewConfig::default() };
        let control = PreviewControl::new(&config).expect("solvable");
        let along = |value| Vector2::new(value, 0.0);
        let mut state = PreviewState {
            com: along(com),
            com_velocity: along(velocity),
            com_acceleration: along(acceleration),
            error_sum: along(error_sum),
        };
        let zmp = control.zmp(&state).x;
        control.advance(&mut state, &reference);

        let preview: f64 =
            (1..).zip(control.gain_preview()).map(|(tick, gain)| gain * reference.at(tick).x).sum();
        let jerk = -control.gain_error() * (error_sum + zmp - reference.at(0).x)
            - (control.gain_state() * Vector3::new(com, velocity, acceleration)).x
            - preview;
        let felt = (state.com_acceleration.x - acceleration) / config.control_period_s;
        prop_assert!((felt - jerk).abs() < 1e-9 * (1e4 + jerk.abs()), "{felt} {jerk}");
    }
}
