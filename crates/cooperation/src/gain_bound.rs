//! How high the hybrid law's gain may be, given its delay.
//!
//! Along one force axis the loop is an integrator (the hand references), a spring (hand against object)
//! and the wrench filter. A hand of stiffness k that gives way by kz kh to each newton of its error corrects
//! the share g = kz·kh·k of it in a tick. (With the paper's kh, by which two arms share the displacement of
//! their row, g = kz·kh·k/2.) With a = exp(−2π f T) the open loop is
//! ```text
//! L(z) = g · z⁻¹/(1 − z⁻¹) · (1 − a)/(1 − a z⁻¹) · z⁻ᴰ
//! ```
//! where the integrator's own z⁻¹ says that a reference made at tick k shows in the sensors of tick k + 1
//! at the earliest, and D counts every further tick of delay: coordination, drives, structure.

use core::f64::consts::PI;

/// The share of [`critical_loop_gain`] to stay within: real loops, with servos and structure, have gone
/// unstable at less than half of what this first-order model allows.
pub const RECOMMENDED_SHARE: f64 = 0.3;

/// The g at which L(z) reaches −1, to compare with [`ForceGains::loop_gain`](crate::ForceGains::loop_gain):
/// above it the loop is unstable. An infinite `filter_hz` is no filter.
///
/// With a 10 Hz filter at 5 ms it is 1.0, .53, .37, .18, .10 for D = 1, 2, 3, 7, 13.
///
/// |L| falls with the frequency and its lag grows, so there is one phase crossover. There
/// `(D + 1) ω + (π − ω)/2 + atan2(a sin ω, 1 − a cos ω) = π`, and g = |1 − e⁻ʲʷ| |1 − a e⁻ʲʷ| / (1 − a).
pub fn critical_loop_gain(delay_ticks: u64, filter_hz: f64, period_s: f64) -> f64 {
    let a = (-2.0 * PI * filter_hz * period_s).exp();
    let lag_rad =
        |w: f64| (delay_ticks as f64 + 1.0) * w + 0.5 * (PI - w) + (a * w.sin()).atan2(1.0 - a * w.cos());
    // It grows with ω throughout, from π/2 at 0 to at least π at π.
    let (mut below, mut above) = (0.0, PI);
    for _ in 0..64 {
        let middle = 0.5 * (below + above);
        if lag_rad(middle) < PI { below = middle } else { above = middle }
    }
    let w = below;
    2.0 * (0.5 * w).sin() * (1.0 - 2.0 * a * w.cos() + a * a).sqrt() / (1.0 - a)
}
