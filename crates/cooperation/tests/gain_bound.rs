//! The critical gain against the characteristic polynomial of the loop.

use core::f64::consts::PI;
use mikoshi_cooperation::critical_loop_gain;
use nalgebra::DMatrix;

const FILTER_HZ: f64 = 10.0;
const PERIOD_S: f64 = 0.005;

/// Largest modulus of the roots of 1 + L(z) = 0, that is of
/// `zᴰ⁺² − (1 + a) zᴰ⁺¹ + a zᴰ + g (1 − a) z`, by the companion matrix.
fn spectral_radius(gain: f64, delay_ticks: usize, filter_hz: f64) -> f64 {
    let a = (-2.0 * PI * filter_hz * PERIOD_S).exp();
    let degree = delay_ticks + 2;
    // Coefficients of z⁰ to zᴰ⁺¹; the term in g has z¹ for D ≥ 0.
    let mut coefficients = vec![0.0; degree];
    coefficients[delay_ticks + 1] -= 1.0 + a;
    coefficients[delay_ticks] += a;
    coefficients[1] += gain * (1.0 - a);
    let companion = DMatrix::from_fn(degree, degree, |row, column| {
        if column + 1 == degree { -coefficients[row] } else { f64::from(row == column + 1) }
    });
    companion.complex_eigenvalues().iter().map(|root| root.norm()).fold(0.0, f64::max)
}

#[test]
fn critical_gains_at_5_ms_with_a_10_hz_filter_are_those_known() {
    for (delay_ticks, expected) in [(1, 1.0), (2, 0.53), (3, 0.37), (7, 0.18), (13, 0.10)] {
        let found = critical_loop_gain(delay_ticks, FILTER_HZ, PERIOD_S);
        assert!((found - expected).abs() < 0.005, "{delay_ticks} ticks: {found}");
    }
}

#[test]
fn the_loop_is_on_the_edge_of_stability_at_the_critical_gain() {
    for delay_ticks in [0, 1, 2, 3, 7, 13] {
        for filter_hz in [1.0, FILTER_HZ, 60.0, f64::INFINITY] {
            let critical = critical_loop_gain(delay_ticks as u64, filter_hz, PERIOD_S);
            let radius = |share| spectral_radius(share * critical, delay_ticks, filter_hz);
            assert!((radius(1.0) - 1.0).abs() < 1e-9, "{delay_ticks} ticks, {filter_hz} Hz: {}", radius(1.0));
            assert!(radius(0.99) < 1.0 && radius(1.01) > 1.0, "{delay_ticks} ticks, {filter_hz} Hz");
        }
    }
}

#[test]
fn more_delay_allows_less_gain() {
    let gains: Vec<f64> = (0..40).map(|ticks| critical_loop_gain(ticks, FILTER_HZ, PERIOD_S)).collect();
    assert!(gains.is_sorted_by(|a, b| a > b), "{gains:?}");
}
