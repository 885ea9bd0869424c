//! A foot that turns on the ground does not say where its robot looks.

use crate::gait::{Foothold, wrap};
use serde::{Deserialize, Serialize};

/// How far a sole's heading by encoders may be off its foothold's until it is believed to pivot \[rad\]. The estimate of the base
/// is pulled to its feet with 5 1/s: what turns slower than 10 mrad/s is a gyroscope's bias. On flat ground soles turn by
/// 6.5 mrad/s at most, as they yield.
const TOLERANCE_RAD: f64 = 0.002;
/// Time constant in which a foot that pivots is followed: short beside the estimate of the base, which would turn to the
/// foot instead \[s\].
const FOLLOW_S: f64 = 0.02;

/// How far a foot has pivoted. A sole on an edge bears on a line or at a corner of it, and what hands and the swinging leg do
/// turns it by 20 to 30 mrad in a step. Who believes that it stands believes as well that his hands have turned about it, by
/// as many millimetres: the team would take them for hands that slip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pivoting {
    /// From where it landed \[rad\].
    turned_rad: f64,
    /// Whether it has been found to, since it landed.
    pivots: bool,
}

impl Pivoting {
    /// After a tick of `dt` \[s\] in which encoders, from a base that knows its heading by a gyroscope, had the sole off its
    /// foothold by `off_rad`. A robot that `stands` trusts its feet again: a gyroscope alone would drift.
    pub fn after(self, off_rad: f64, stands: bool, dt: f64) -> Self {
        let off = wrap(off_rad - self.turned_rad);
        let pivots = (self.pivots && !stands) || off.abs() > TOLERANCE_RAD;
        let share = if pivots { (dt / FOLLOW_S).min(1.0) } else { 0.0 };
        Self { turned_rad: self.turned_rad + off * share, pivots }
    }

    /// Where a foot stands that has landed there.
    pub fn turn(&self, mut landed: Foothold) -> Foothold {
        if self.turned_rad != 0.0 {
            landed.pose.yaw = wrap(landed.pose.yaw + self.turned_rad);
        }
        landed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.005;

    /// The largest error of a heading, and the last one, of a base that knows it by a gyroscope and is pulled to that of its
    /// foot as [`crate::estimate::BaseEstimator`] is. The foot turns at this rate for a second, and stands for another one.
    fn errors_of_a_base(rate_rad_s: f64) -> (f64, f64) {
        let (mut pivoting, mut foot, mut base) = (Pivoting::default(), 0.0, 0.0);
        let (mut worst, mut last) = (0.0_f64, 0.0);
        for tick in 0..400 {
            let turn = if tick < 200 { rate_rad_s * DT } else { 0.0 };
            foot += turn;
            base += turn;
            // The leg does not turn: by encoders the foot looks where the base does.
            pivoting = pivoting.after(base, false, DT);
            base += 5.0 * DT * wrap(pivoting.turn(Foothold::default()).pose.yaw - base);
            last = base - foot;
            worst = worst.max(last.abs());
        }
        (worst, last)
    }

    #[test]
    fn who_stands_on_a_foot_that_pivots_knows_where_he_looks() {
        for rate_rad_s in [0.02_f64, 0.035, 0.06, -0.06, 0.2] {
            let (worst, last) = errors_of_a_base(rate_rad_s);
            let turned = rate_rad_s.abs();
            assert!(worst < 0.2 * turned && last.abs() < 0.2 * turned, "{rate_rad_s}: {worst}, {last}");
        }
    }

    #[test]
    fn what_turns_slowly_is_a_gyroscopes_bias() {
        let (_, last) = errors_of_a_base(0.008);
        assert!((last + 0.008).abs() < 1e-4, "the base has come back to its foot: {last}");
    }

    #[test]
    fn a_robot_that_stands_trusts_its_feet_again() {
        let pivoting = Pivoting::default().after(0.01, false, DT);
        assert!(pivoting.pivots && pivoting.turned_rad > 0.0);
        let stands = (0..100).fold(pivoting, |pivoting, _| pivoting.after(0.01, true, DT));
        assert!(!stands.pivots && (stands.turned_rad - 0.008).abs() < 1e-3, "{stands:?}");
        let drifted = stands.after(stands.turned_rad + 0.0019, true, DT);
        assert_eq!(drifted, stands, "what a gyroscope drifts by, feet hold");
    }
}
