//! What is controlled along each axis of the control space: the selection matrix S.

use nalgebra::Vector6;

/// An axis of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Axis {
    X,
    Y,
    Z,
    Roll,
    Pitch,
    Yaw,
}

impl Axis {
    /// All six.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::Roll, Self::Pitch, Self::Yaw];
}

/// What is controlled along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// The position or the angle: '0' in S.
    Position,
    /// The force or the moment: '1' in S.
    Force,
}

/// S (eq. 35), the diagonal 6n × 6n matrix of zeros and ones, row by row and axis by axis: row 0 by world
/// axes, the others by object axes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selection {
    rows: Vec<[Control; 6]>,
}

impl Selection {
    /// The paper's choice (section 4.2): the object by position, every internal force by force.
    pub fn object_position_internal_force(arms: usize) -> Self {
        let mut rows = vec![[Control::Force; 6]; arms];
        if let Some(object) = rows.first_mut() {
            *object = [Control::Position; 6];
        }
        Self { rows }
    }

    /// Changes one axis; `None`, and no change, if there is no such row.
    #[must_use = "a row that does not exist is not selected"]
    pub fn select(&mut self, row: usize, axis: Axis, control: Control) -> Option<()> {
        self.rows.get_mut(row)?[axis as usize] = control;
        Some(())
    }

    /// Row by row; n of them.
    pub fn rows(&self) -> &[[Control; 6]] {
        &self.rows
    }

    /// The diagonal of S, row by row.
    pub fn diagonal(&self) -> impl Iterator<Item = Vector6<f64>> {
        self.rows.iter().map(|row| {
            Vector6::from(row.map(|control| match control {
                Control::Force => 1.0,
                Control::Position => 0.0,
            }))
        })
    }
}
