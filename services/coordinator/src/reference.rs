//! What the operator wants: references of forces and positions, and how they come in.

use crate::build::{BuildCoordinatorError, find_row};
use mikoshi_config::scenario::{Control, Scenario};
use mikoshi_cooperation::{GeneralizedForce, GeneralizedPosition, InternalForces};
use mikoshi_spatial::{CoordinateFrame, Object, Pose, Twist, World, Wrench};
use nalgebra::Vector6;

/// References go from what is there when control starts to what is asked for in this time, so that no hand
/// jumps.
const RAMP_S: f64 = 1.0;

/// Constant references of single axes, by row.
#[derive(Clone, Debug)]
pub(crate) struct References {
    rows: Vec<RowReference>,
    ramp_ticks: f64,
    /// Tells these references of forces from others.
    fingerprint: u64,
}

#[derive(Clone, Copy, Debug, Default)]
struct RowReference {
    force: Vector6<f64>,
    position: Vector6<f64>,
}

impl References {
    /// What the scenario asks of single axes.
    pub(crate) fn new(
        scenario: &Scenario,
        internal_forces: &InternalForces,
    ) -> Result<Self, BuildCoordinatorError> {
        let mut rows = vec![RowReference::default(); internal_forces.arms()];
        for exception in &scenario.hybrid.axes {
            let row = &mut rows[find_row(internal_forces, &exception.row)?];
            let target = match exception.control {
                Control::Force => &mut row.force,
                Control::Position => &mut row.position,
            };
            target[exception.axis as usize] = exception.reference;
        }
        let forces = rows.iter().flat_map(|row| row.force.iter());
        // FNV-1a, by words.
        let fingerprint = forces.fold(0xcbf2_9ce4_8422_2325_u64, |hash, force| {
            (hash ^ force.to_bits()).wrapping_mul(0x0000_0100_0000_01b3)
        });
        Ok(Self { rows, ramp_ticks: RAMP_S / scenario.control_period_s, fingerprint })
    }

    /// Differs from that of references of other forces.
    pub(crate) fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// Fills in h_r and z_r for an object that shall be at `X_WA_ref`, so many ticks after control started, and after it
    /// was last formed for the hands that take part, with the generalized force at `force_start` and the object's
    /// reference off by `off_start`: from there forces and object go to what is asked for, and axes that are displaced
    /// go there from where they are.
    pub(crate) fn fill(
        &self,
        [ticks, formed_ticks]: [u64; 2],
        X_WA_ref: &Pose<World, Object>,
        (force_start, off_start): (&[[f64; 6]], &[f64; 6]),
        force: &mut GeneralizedForce,
        position: &mut GeneralizedPosition,
    ) {
        let share = smooth_step(ticks as f64 / self.ramp_ticks);
        let force_share = self.share_in_force(formed_ticks);
        let mut rows = self.rows.iter().zip(force_start);
        if let Some((object, start)) = rows.next() {
            force.external = between(start, &object.force, force_share);
            let off = self.off_after(formed_ticks, off_start);
            position.external = X_WA_ref.displaced(&(Twist::from_vector(&(object.position * share)) + off));
        }
        let outputs = force.internal.iter_mut().zip(position.internal.iter_mut());
        for ((row, start), (force, position)) in rows.zip(outputs) {
            *force = between(start, &row.force, force_share);
            *position = Twist::from_vector(&(row.position * share));
        }
    }
}

impl References {
    /// To which part references are in force, so many ticks after the team was last formed.
    pub(crate) fn share_in_force(&self, formed_ticks: u64) -> f64 {
        smooth_step(formed_ticks as f64 / self.ramp_ticks)
    }

    /// How far the object's reference is still off, so many ticks after it was off by `off_start`.
    pub(crate) fn off_after(&self, ticks: u64, off_start: &[f64; 6]) -> Twist<World> {
        Twist::from_array(off_start) * (1.0 - smooth_step(ticks as f64 / self.ramp_ticks))
    }
}

/// The wrench that lies the given share of the way from `start` to `target`.
fn between<F: CoordinateFrame>(start: &[f64; 6], target: &Vector6<f64>, share: f64) -> Wrench<F> {
    let start = Vector6::from(*start);
    Wrench::from_vector(&(start + (target - start) * share))
}

/// 3x² − 2x³ within 0 and 1: it starts and ends at rest.
pub(crate) fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_start_and_end_at_rest_where_they_should() {
        assert_eq!([-1.0, 0.0, 0.5, 1.0, 2.0].map(smooth_step), [0.0, 0.0, 0.5, 1.0, 1.0]);
        assert!(smooth_step(1e-3) < 4e-6 && smooth_step(1.0 - 1e-3) > 1.0 - 4e-6);
        let wrench: Wrench<Object> = between(&[8.0; 6], &Vector6::repeat(20.0), 0.25);
        assert_eq!(wrench.to_array(), [11.0; 6]);
    }
}
