//! Where each hand has the object: at the tip of its virtual stick.

use mikoshi_cooperation::{HandInput, HybridState};
use mikoshi_ipc_types::MAX_HANDS_OF_TEAM;
use mikoshi_spatial::{Object, Pose, Twist, World};
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
    /// Of this arm; none if it takes no part.
    pub(crate) fn of(
        hybrid: &HybridState<MAX_HANDS_OF_TEAM>,
        arm: usize,
        hand: &HandInput,
        X_WA: &Pose<World, Object>,
    ) -> Option<Self> {
        let stick = hybrid.stick(arm).filter(|_| hybrid.takes_part(arm))?;
        let X_WB = stick.tip_pose(&hand.pose);
        let lever = stick.vector(&hand.pose);
        Some(Self { lever, position: X_WB.translation, off: X_WA.displacement_to(&X_WB.relabel()) })
    }

    /// Of all arms.
    pub(crate) fn fill(
        tips: &mut [Option<Self>],
        hybrid: &HybridState<MAX_HANDS_OF_TEAM>,
        hands: &[HandInput],
        X_WA: &Pose<World, Object>,
    ) {
        for (arm, (tip, hand)) in tips.iter_mut().zip(hands).enumerate() {
            *tip = Self::of(hybrid, arm, hand, X_WA);
        }
    }
}
