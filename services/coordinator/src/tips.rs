//! Where each hand has the object: at the tip of its virtual stick.

use mikoshi_cooperation::{HandInput, HybridScratch, HybridState};
use mikoshi_ipc_types::MAX_HANDS_OF_TEAM;
use mikoshi_spatial::{self as spatial, Object, Pose, Twist, World};
use nalgebra::Vector3;

/// What a hand that takes part sees of the object, by its stick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tip {
    /// From the hand to the tip, in the world.
    pub lever: Vector3<f64>,
    /// Where the tip is.
    pub position: Vector3<f64>,
    /// From the team's object to where this hand has it, as if nothing yielded.
    pub off: Twist<World>,
}

impl Tip {
    fn new(X_WB: &Pose<World, spatial::Tip>, lever: Vector3<f64>, X_WA: &Pose<World, Object>) -> Self {
        Self { lever, position: X_WB.translation, off: X_WA.displacement_to(&X_WB.relabel()) }
    }

    /// Of this arm; none if it takes no part.
    pub(crate) fn of(
        hybrid: &HybridState<MAX_HANDS_OF_TEAM>,
        arm: usize,
        hand: &HandInput,
        X_WA: &Pose<World, Object>,
    ) -> Option<Self> {
        let stick = hybrid.stick(arm).filter(|_| hybrid.takes_part(arm))?;
        Some(Self::new(&stick.tip_pose(&hand.pose), stick.vector(&hand.pose), X_WA))
    }

    /// Of all arms, as the law has found their tips in this tick.
    pub(crate) fn fill(
        tips: &mut [Option<Self>],
        hybrid: &HybridState<MAX_HANDS_OF_TEAM>,
        law: &HybridScratch,
        X_WA: &Pose<World, Object>,
    ) {
        for (arm, (tip, (X_WB, lever))) in tips.iter_mut().zip(law.tips()).enumerate() {
            *tip = hybrid.takes_part(arm).then(|| Self::new(X_WB, *lever, X_WA));
        }
    }
}
