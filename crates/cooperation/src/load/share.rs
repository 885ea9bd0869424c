//! Who bears how much of a load, with hands that are free of moments.

use crate::VirtualStick;
use mikoshi_spatial::{Hand, Pose, World, Wrench, skew};
use nalgebra::{Matrix6, Vector3};

/// How far a hand may bring a force aside of its palm for the price of that force \[m\]: a moment costs a hand as much as a
/// force of so much more that acts on this lever. It decides only where forces alone don't do: for hands on one line.
const LEVER_M: f64 = 0.03;

/// Who bears: a hand, and how willingly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bearer {
    /// Where the hand is in the world \[m\].
    pub position_m: Vector3<f64>,
    /// Its weight: of two hands that could bear the same, one of twice the weight bears twice as much. 0 bears nothing.
    pub weight: f64,
    /// Moment that it would apply of its own accord \[Nm\]; whoever bears nothing applies none.
    pub moment_nm: Vector3<f64>,
}

/// What each hand is to apply, at its own origin, so that all together apply `load` at `origin`.
///
/// Of all wrenches that do, those with the smallest Σ (|f|² + |n − n₀|²/r²) / w, n₀ being the moments that hands apply of
/// their own accord, r the lever that a moment is worth: with `G` the map from a hand's wrench to what it does at `origin`,
/// and D = w diag(1, 1, 1, r², r², r²), `q = (0, n₀) + D Gᵀ (Σ G D Gᵀ)⁻¹ (load − Σ G (0, n₀))`. Where hands spread about the
/// load's line of action they bear it by forces, and by moments that cancel.
///
/// `false`, and `out` untouched, if nobody bears.
pub fn share_load(
    load: &Wrench<World>,
    origin: &Vector3<f64>,
    bearers: impl Iterator<Item = Bearer> + Clone,
    out: &mut [Wrench<World>],
) -> bool {
    let (mut normal, mut rest) = (Matrix6::zeros(), *load);
    for Bearer { position_m, weight, moment_nm } in bearers.clone() {
        if weight > 0.0 {
            rest.moment -= moment_nm;
        }
        let lever = skew(&(position_m - origin));
        let at_origin = lever * weight;
        for axis in 0..3 {
            normal[(axis, axis)] += weight;
            normal[(axis + 3, axis + 3)] += weight * LEVER_M * LEVER_M;
        }
        // Of one triangle, which is all that is read.
        let mut below = normal.fixed_view_mut::<3, 3>(3, 0);
        below += at_origin;
        let mut diagonal = normal.fixed_view_mut::<3, 3>(3, 3);
        diagonal += at_origin * lever.transpose();
    }
    let Some(factors) = normal.cholesky() else { return false };
    let multiplier = Wrench::<World>::from_vector(&factors.solve(&rest.to_vector()));
    if !multiplier.is_finite() {
        return false;
    }
    for (out, Bearer { position_m, weight, moment_nm }) in out.iter_mut().zip(bearers) {
        let lever = position_m - origin;
        let force = multiplier.force + multiplier.moment.cross(&lever);
        let own = if weight > 0.0 { moment_nm } else { Vector3::zeros() };
        *out = Wrench::new(force * weight, own + multiplier.moment * (weight * LEVER_M * LEVER_M));
    }
    true
}

/// The largest moment at a hand if all tips bear the same of `load`, as the paper's zero internal forces have it: each hand
/// then bears its stick's length times its force.
pub fn largest_moment_of_equal_tips_nm<'a>(
    load: &Wrench<World>,
    hands: impl Iterator<Item = (&'a Pose<World, Hand>, VirtualStick)>,
    shares: &[f64],
) -> f64 {
    hands.zip(shares).fold(0.0, |most: f64, ((pose, stick), share)| {
        most.max(stick.hand_wrench(pose, &(*load * *share)).moment.norm())
    })
}
