//! What the operator wants: references of forces and positions, and how they come in.

use crate::build::{BuildCoordinatorError, find_row};
use mikoshi_config::scenario::{Control, Scenario};
use mikoshi_cooperation::{GeneralizedForce, GeneralizedPosition, InternalForces};
use mikoshi_spatial::{CoordinateFrame, Object, Pose, Twist, World, Wrench};
use nalgebra::Vector6;

/// References grow from zero over this time, so that no hand jumps when control starts.
const RAMP_S: f64 = 1.0;

/// Constant references of single axes, by row.
#[derive(Clone, Debug)]
pub(crate) struct References {
    rows: Vec<RowReference>,
    ramp_ticks: f64,
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
        Ok(Self { rows, ramp_ticks: RAMP_S / scenario.control_period_s })
    }

    /// Fills in h_r and z_r, `ticks` ticks after control started with the object at `X_WA_start`.
    pub(crate) fn fill(
        &self,
        ticks: u64,
        X_WA_start: &Pose<World, Object>,
        force: &mut GeneralizedForce,
        position: &mut GeneralizedPosition,
    ) {
        let ramp = (ticks as f64 / self.ramp_ticks).min(1.0);
        let mut rows = self.rows.iter();
        if let Some(object) = rows.next() {
            force.external = Wrench::from_vector(&(object.force * ramp));
            position.external = X_WA_start.displaced(&Twist::from_vector(&(object.position * ramp)));
        }
        let outputs = force.internal.iter_mut().zip(position.internal.iter_mut());
        for (row, (force, position)) in rows.zip(outputs) {
            *force = scaled_wrench(&row.force, ramp);
            *position = Twist::from_vector(&(row.position * ramp));
        }
    }
}

fn scaled_wrench<F: CoordinateFrame>(wrench: &Vector6<f64>, scale: f64) -> Wrench<F> {
    Wrench::from_vector(&(wrench * scale))
}
