//! At which height a swing expects the ground.

use super::swing::Foothold;
use crate::balance::PerFoot;
use serde::{Deserialize, Serialize};

/// By how much the plane rises with a landing at most \[m\]: less than a board, more than odometry errs in height with a step on
/// average.
const RISE_M: f64 = 0.0005;

/// The plane on which the robot walks, and on which things lie that are higher.
///
/// Odometry errs in height by a millimetre with a step on ground that is not flat: after half a minute the floor may be 17 mm
/// under where it was. A foot that expects it there is lowered slowly for .9 s, while its robot stands on the other one. Ground
/// that comes early does less harm than ground that comes late: so the plane falls to the lowest foothold at once, and rises
/// to the lower of both by and by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ExpectedGround {
    /// Height of the plane \[m\].
    pub plane_m: f64,
}

impl ExpectedGround {
    /// After a landing, with feet where they now stand; what is within `tolerance_m` of the plane is on it.
    pub fn after_landing(self, feet: &PerFoot<Foothold>, tolerance_m: f64) -> Self {
        let height = |foot: &Foothold| foot.on_plane_within(self.plane_m, tolerance_m).height;
        let lower = height(&feet.right).min(height(&feet.left));
        Self { plane_m: lower.min(self.plane_m + RISE_M) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE_M: f64 = 0.003;

    fn standing_at(right_m: f64, left_m: f64) -> PerFoot<Foothold> {
        let at = |height| Foothold { height, ..Foothold::default() };
        PerFoot { right: at(right_m), left: at(left_m) }
    }

    #[test]
    fn the_plane_falls_at_once_and_rises_slowly() {
        let found = ExpectedGround::default().after_landing(&standing_at(0.0, -0.008), TOLERANCE_M);
        assert_eq!(found.plane_m, -0.008);
        let on_boards =
            (0..10).fold(found, |ground, _| ground.after_landing(&standing_at(0.015, 0.007), TOLERANCE_M));
        assert!((on_boards.plane_m + 0.003).abs() < 1e-12, "{on_boards:?}");
        let at_last =
            (0..100).fold(found, |ground, _| ground.after_landing(&standing_at(0.015, 0.007), TOLERANCE_M));
        assert!(
            (0.007 - at_last.plane_m - TOLERANCE_M).abs() < RISE_M,
            "it is where the lower foot stands: {at_last:?}"
        );
    }

    #[test]
    fn on_a_floor_with_boards_the_plane_stays_where_it_is() {
        let ground = ExpectedGround::default();
        for feet in [standing_at(0.0, 0.015), standing_at(0.0, -0.002), standing_at(0.015, 0.0)] {
            assert_eq!(ground.after_landing(&feet, TOLERANCE_M), ground);
        }
    }
}
