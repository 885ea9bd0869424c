//! A sole that has landed on the edge of something turns until it bears flat, before the other foot leaves the ground.

use super::machine::GaitPhase;
use crate::balance::PerFoot;
use serde::{Deserialize, Serialize};

/// Ground that a robot meets an edge of first, it falls onto with all its weight if the other foot has left by then: it
/// pivots about that edge, and its hands with it. On two feet the same is a matter of one ankle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Settling {
    /// Whether the sole that is to bear turns to its ground.
    pub turns: bool,
    /// Ticks of this double support in which it has.
    pub ticks: u64,
}

impl Settling {
    /// After a tick in `phase` in which these soles turned.
    pub fn after(self, phase: &GaitPhase, soles_turn: &PerFoot<bool>) -> Self {
        let GaitPhase::DoubleSupport { step, landing: None, .. } = phase else { return Self::default() };
        let turns = soles_turn[step.side.opposite()];
        Self { turns, ticks: self.ticks.saturating_add(u64::from(turns)) }
    }

    /// Whether the other foot stays on the ground, for `patience` ticks at most: what has not found its ground by then has none
    /// to find.
    pub fn waits(&self, patience: u64) -> bool {
        self.turns && self.ticks <= patience
    }
}

#[cfg(test)]
mod tests {
    use super::super::ground_pose::GroundPose;
    use super::super::machine::{PlannedStep, SwingingFoot};
    use super::super::swing::{Foothold, Swing};
    use super::*;
    use crate::balance::Side;
    use nalgebra::Vector2;

    const RIGHT_TURNS: PerFoot<bool> = PerFoot { right: true, left: false };
    const NONE_TURNS: PerFoot<bool> = PerFoot { right: false, left: false };

    /// After the right foot's landing, with the left one to swing next.
    fn double_support(landing: Option<SwingingFoot>) -> GaitPhase {
        let step = PlannedStep { index: 3, side: Side::Left, to: GroundPose::default() };
        GaitPhase::DoubleSupport { zmp_from: Vector2::zeros(), step, landing }
    }

    #[test]
    fn the_foot_that_is_to_bear_is_waited_for_while_it_turns_and_no_longer_than_patience() {
        let (phase, patience) = (double_support(None), 80);
        let mut settling = Settling::default();
        for tick in 1..=200 {
            settling = settling.after(&phase, &RIGHT_TURNS);
            assert_eq!(settling.waits(patience), tick <= patience, "tick {tick}");
        }
        assert!(!settling.after(&phase, &NONE_TURNS).waits(patience));
    }

    #[test]
    fn a_sole_that_turns_again_and_again_has_the_patience_of_one() {
        let phase = double_support(None);
        let mut settling = Settling::default();
        for _ in 0..80 {
            settling = settling.after(&phase, &RIGHT_TURNS).after(&phase, &NONE_TURNS);
        }
        assert!(!settling.after(&phase, &RIGHT_TURNS).waits(80));
    }

    #[test]
    fn the_foot_that_is_to_swing_and_one_that_has_not_landed_are_not_waited_for() {
        let left_turns = PerFoot { right: false, left: true };
        assert!(!Settling::default().after(&double_support(None), &left_turns).waits(80));
        let swing = Swing::new(Foothold::default(), Foothold::default());
        let landing = Some(SwingingFoot { side: Side::Right, swing });
        assert_eq!(Settling::default().after(&double_support(landing), &RIGHT_TURNS), Settling::default());
    }
}
