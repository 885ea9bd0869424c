//! The reference of the zero moment point, from footholds: it rests on the stance foot while one foot
//! swings and shifts linearly while both stand.

use nalgebra::Vector2;

/// More than a horizon of two steps needs.
const CAPACITY: usize = 12;

/// Piecewise linear over ticks, 0 being the start of this tick: what lies before the first knot has the
/// first one's value, and what lies after the last one has the last one's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZmpReference {
    knots: [(i64, Vector2<f64>); CAPACITY],
    count: usize,
}

impl ZmpReference {
    /// At `point` until something else is said.
    pub fn resting(point: Vector2<f64>) -> Self {
        Self { knots: [(0, point); CAPACITY], count: 1 }
    }

    /// A weight shift between two ticks, of which the first may lie in the past: rests before, moves
    /// linearly to `point`, rests there. Shifts are given in order of time; those past the capacity are
    /// dropped.
    pub fn shift(mut self, from_tick: i64, to_tick: i64, point: Vector2<f64>) -> Self {
        let resting_at = self.last();
        for knot in [(from_tick, resting_at), (to_tick, point)] {
            if let Some(slot) = self.knots.get_mut(self.count) {
                *slot = knot;
                self.count += 1;
            }
        }
        self
    }

    /// Where it ends.
    pub fn last(&self) -> Vector2<f64> {
        self.knots().last().map_or_else(Vector2::zeros, |knot| knot.1)
    }

    fn knots(&self) -> &[(i64, Vector2<f64>)] {
        self.knots.get(..self.count).unwrap_or(&self.knots)
    }

    /// The reference at a tick.
    pub fn at(&self, tick: i64) -> Vector2<f64> {
        let mut previous = *self.knots.first().unwrap_or(&(tick, Vector2::zeros()));
        // The first knot is only a value: what rests there may begin to move in the past.
        for &(knot_tick, point) in self.knots().iter().skip(1) {
            if tick < knot_tick {
                let length = (knot_tick - previous.0) as f64;
                let share = if length > 0.0 { ((tick - previous.0) as f64 / length).max(0.0) } else { 1.0 };
                return previous.1 + (point - previous.1) * share;
            }
            previous = (knot_tick, point);
        }
        previous.1
    }

    /// Tick by tick from now on, without end.
    pub fn samples(&self) -> impl Iterator<Item = Vector2<f64>> + '_ {
        (0..).map(|tick| self.at(tick))
    }
}
