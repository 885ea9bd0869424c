//! The reference of the zero moment point, from footholds: it rests on the stance foot while one foot
//! swings and shifts linearly while both stand.

use core::ops::Range;
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

    /// The same as it is seen so many ticks later.
    pub fn later(mut self, ticks: i64) -> Self {
        for (tick, _) in self.knots.iter_mut().skip(1) {
            *tick = tick.saturating_sub(ticks);
        }
        self
    }

    /// Every point through a map that keeps lines straight and shares on them.
    pub fn mapped(mut self, affine: impl Fn(&Vector2<f64>) -> Vector2<f64>) -> Self {
        for (_, point) in self.knots.iter_mut().take(self.count) {
            *point = affine(point);
        }
        self
    }

    /// The same with what grows by `slope` in a tick, from now to `until` and not further.
    pub fn with_drift(self, slope: &Vector2<f64>, until: i64) -> Self {
        let mut drifting = self.shift(until, until, self.last());
        for (tick, point) in drifting.knots.iter_mut().take(drifting.count) {
            *point += slope * (*tick).clamp(-until, until) as f64;
        }
        drifting
    }

    /// The reference in the ticks `from..to`, from >= 0, as lines in order of time.
    pub(super) fn lines(&self, from: i64, to: i64) -> impl Iterator<Item = Line> + '_ {
        let ends = self.knots().windows(2).map(|pair| Some((pair[0], pair[1])));
        let mut begin = from;
        ends.chain([None]).filter_map(move |knots| {
            let (end, through, slope) = match knots {
                Some((before, after)) => {
                    let length = (after.0 - before.0) as f64;
                    let slope = if length > 0.0 { (after.1 - before.1) / length } else { Vector2::zeros() };
                    (after.0.min(to), before, slope)
                }
                None => (to, (0, self.last()), Vector2::zeros()),
            };
            let ticks = begin..end;
            if ticks.is_empty() {
                return None;
            }
            begin = end;
            Some(Line { ticks, through, slope })
        })
    }
}

/// What a reference is in some ticks: linear.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Line {
    /// In which it is.
    pub ticks: Range<i64>,
    /// A tick, which may lie outside of them, and the reference there \[m\].
    pub through: (i64, Vector2<f64>),
    /// Change in a tick \[m\].
    pub slope: Vector2<f64>,
}
