//! A foot that turns on the ground takes its foothold along.

use super::ground_pose::{GroundPose, wrap};
use super::swing::Foothold;
use crate::balance::{PerFoot, Side};
use serde::{Deserialize, Serialize};

/// How far a sole's heading by encoders may be off its foothold's until it is believed to pivot \[rad\]. The estimate of the base
/// is pulled to its feet with 5 1/s: what turns slower than 10 mrad/s is a gyroscope's bias. On flat ground soles turn by
/// 6.5 mrad/s at most, as they yield.
const TOLERANCE_RAD: f64 = 0.002;
/// Time constant in which the foothold of a foot that pivots follows it: short beside the estimate of the base, which would
/// turn to the foothold instead \[s\].
const FOLLOW_S: f64 = 0.02;

/// Which foot pivots. A sole on an edge bears on a line or at a corner of it, and what hands and the swinging leg do turns it
/// by 20 to 30 mrad in a step. Who believes that it stands believes as well that his hands have turned about it, by as many
/// millimetres: the team would take them for hands that slip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pivoting {
    /// The foot that has been found to pivot, until another one bears.
    pub foot: Option<Side>,
}

impl Pivoting {
    /// After a tick of `dt` \[s\] in which `stance` bore a step and encoders, from a base that knows its heading by a
    /// gyroscope, had soles as in `soles`. The foothold of a foot that pivots follows.
    pub fn after(
        self,
        stance: Option<Side>,
        feet: &mut PerFoot<Foothold>,
        soles: &PerFoot<GroundPose>,
        dt: f64,
    ) -> Self {
        let Some(side) = stance else { return Self::default() };
        let foothold = &mut feet[side].pose;
        let turned = wrap(soles[side].yaw - foothold.yaw);
        if self.foot != stance && turned.abs() <= TOLERANCE_RAD {
            return Self::default();
        }
        foothold.yaw = wrap(foothold.yaw + turned * (dt / FOLLOW_S).min(1.0));
        Self { foot: stance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.005;

    /// A base that knows its heading by a gyroscope and is pulled to the heading of the foot that it stands on, as
    /// [`crate::estimate::BaseEstimator`] is; its foot turns at this rate for a second, and stands for another one. The largest
    /// error of the base's heading, and the last.
    fn errors_of_a_base(rate_rad_s: f64) -> (f64, f64) {
        let mut feet = PerFoot { right: Foothold::default(), left: Foothold::default() };
        let (mut pivoting, mut error, mut worst) = (Pivoting::default(), 0.0_f64, 0.0_f64);
        let (mut foot, mut base) = (0.0, 0.0);
        for tick in 0..400 {
            let turn = if tick < 200 { rate_rad_s * DT } else { 0.0 };
            foot += turn;
            base += turn;
            // The leg does not turn: by encoders the foot looks where the base does.
            let sole = GroundPose::new(0.0, 0.0, base);
            let soles = PerFoot { right: sole, left: GroundPose::default() };
            pivoting = pivoting.after(Some(Side::Right), &mut feet, &soles, DT);
            base += 5.0 * DT * wrap(feet.right.pose.yaw - base);
            error = base - foot;
            worst = worst.max(error.abs());
        }
        (worst, error)
    }

    #[test]
    fn who_stands_on_a_foot_that_pivots_knows_where_he_looks() {
        for rate_rad_s in [0.02, 0.035, 0.06, -0.06, 0.2] {
            let (worst, last) = errors_of_a_base(rate_rad_s);
            let turned = rate_rad_s.abs();
            assert!(worst < 0.2 * turned && last.abs() < 0.2 * turned, "{rate_rad_s}: {worst}, {last}");
        }
    }

    #[test]
    fn what_turns_slowly_is_a_gyroscopes_bias_and_moves_no_foothold() {
        let mut feet = PerFoot { right: Foothold::default(), left: Foothold::default() };
        let before = feet;
        let soles =
            PerFoot { right: GroundPose::new(0.0, 0.0, 0.0019), left: GroundPose::new(0.0, 0.0, 0.1) };
        let pivoting = Pivoting::default().after(Some(Side::Right), &mut feet, &soles, DT);
        assert_eq!((pivoting, feet), (Pivoting::default(), before), "and the other foot may do what it will");
    }

    #[test]
    fn a_foot_that_has_pivoted_is_trusted_again_when_another_one_bears() {
        let mut feet = PerFoot { right: Foothold::default(), left: Foothold::default() };
        let turned = GroundPose::new(0.0, 0.0, 0.01);
        let soles = PerFoot { right: turned, left: GroundPose::default() };
        let pivoting = Pivoting::default().after(Some(Side::Right), &mut feet, &soles, DT);
        assert_eq!(pivoting.foot, Some(Side::Right));
        let next = pivoting.after(Some(Side::Left), &mut feet, &soles, DT);
        assert_eq!(next, Pivoting::default());
        assert_eq!(pivoting.after(None, &mut feet, &soles, DT), Pivoting::default());
    }
}
