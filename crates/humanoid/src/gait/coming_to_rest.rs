//! A centre of mass that comes to rest over feet that stay.

use super::preview::PreviewState;
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// The quintic from a moving centre of mass to one at rest: position, velocity and acceleration are met at both
/// ends, so that the zero moment point c − c̈ h/g begins where it is and ends under the centre of mass.
///
/// A robot that would step on has its divergent component a third of the way to its next foot when a foot lands.
/// Brought to rest in .8 s, its zero moment point goes as far as that foot's middle and a few centimetres more, and
/// comes back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComingToRest {
    from: PreviewState,
    to: Vector2<f64>,
    duration_s: f64,
}

impl ComingToRest {
    /// From `from` to rest at `to` \[m, world\] in `duration_s`, which is positive.
    pub fn new(from: PreviewState, to: Vector2<f64>, duration_s: f64) -> Self {
        Self { from, to, duration_s }
    }

    /// The centre of mass after `seconds` \[m, world\]: with s = t / T, V = ċ₀ T, A = c̈₀ T² and way w,
    /// `c₀ + V s + ½A s² + (10w − 6V − 3/2 A) s³ + (−15w + 8V + 3/2 A) s⁴ + (6w − 3V − ½A) s⁵`.
    pub fn com(&self, seconds: f64) -> Vector2<f64> {
        let s = (seconds / self.duration_s).clamp(0.0, 1.0);
        let way = self.to - self.from.com;
        let velocity = self.from.com_velocity * self.duration_s;
        let acceleration = self.from.com_acceleration * (self.duration_s * self.duration_s);
        let third = way * 10.0 - velocity * 6.0 - acceleration * 1.5;
        let fourth = way * -15.0 + velocity * 8.0 + acceleration * 1.5;
        let fifth = way * 6.0 - velocity * 3.0 - acceleration * 0.5;
        self.from.com + (velocity + (acceleration * 0.5 + (third + (fourth + fifth * s) * s) * s) * s) * s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balance::Pendulum;

    const STEP_S: f64 = 1e-3;

    fn moving(com: f64, velocity: f64, acceleration: f64) -> PreviewState {
        let along = |value| Vector2::new(0.0, value);
        PreviewState {
            com: along(com),
            com_velocity: along(velocity),
            com_acceleration: along(acceleration),
            error_sum: Vector2::zeros(),
        }
    }

    /// Position, velocity and acceleration, by differences.
    fn motion(rest: &ComingToRest, seconds: f64) -> [f64; 3] {
        let [before, now, after] = [-1.0, 0.0, 1.0].map(|steps| rest.com(seconds + steps * STEP_S).y);
        [now, (after - before) / (2.0 * STEP_S), (after - 2.0 * now + before) / (STEP_S * STEP_S)]
    }

    #[test]
    fn it_begins_as_it_moves_and_ends_at_rest() {
        let rest = ComingToRest::new(moving(0.3, -0.2, 0.8), Vector2::new(0.0, 0.35), 0.8);
        let near = |found: [f64; 3], expected: [f64; 3]| {
            found.into_iter().zip(expected).zip([1e-3, 5e-3, 5e-2]).all(|((f, e), most)| (f - e).abs() < most)
        };
        assert!(near(motion(&rest, STEP_S), [0.3, -0.2, 0.8]), "{:?}", motion(&rest, STEP_S));
        assert!(near(motion(&rest, 0.8 - STEP_S), [0.35, 0.0, 0.0]), "{:?}", motion(&rest, 0.8));
        assert_eq!(rest.com(5.0), rest.com(0.8));
    }

    #[test]
    fn a_robot_that_would_have_stepped_on_keeps_its_zero_moment_point_within_its_feet() {
        // Across the feet, 85 mm aside of the middle each, half of a sole .14 m wide beyond: as it walks when a
        // foot lands, and halfway to the next lift-off.
        let pendulum = Pendulum { mass_kg: 56.0, com_height_m: 0.79 };
        for from in [moving(-0.021, 0.178, 0.80), moving(0.0, 0.218, 0.0)] {
            let rest = ComingToRest::new(from, Vector2::zeros(), 0.8);
            for tick in 1..800 {
                let [com, _, acceleration] = motion(&rest, f64::from(tick) * STEP_S);
                let zmp = pendulum.extended_zmp(&Vector2::new(0.0, com), &Vector2::new(0.0, acceleration));
                assert!((-0.09..0.12).contains(&zmp.y), "{zmp} after {tick} ms");
            }
        }
    }
}
