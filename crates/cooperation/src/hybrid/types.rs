//! What the law reads and writes in a tick.

use crate::{GeneralizedForce, GeneralizedPosition};
use mikoshi_spatial::{Hand, Pose, Twist, World, Wrench};

/// One hand, as its robot reports it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandInput {
    /// Measured pose.
    pub pose: Pose<World, Hand>,
    /// Pose by the commanded posture of the last tick: what the robot made of earlier references.
    pub pose_commanded: Pose<World, Hand>,
    /// Wrench that the hand applies TO the object, at the hand's origin.
    pub wrench: Wrench<World>,
}

/// What the operator wants of the team.
#[derive(Clone, Copy, Debug)]
pub struct HybridReference<'a> {
    /// h_r, used on force axes.
    pub force: &'a GeneralizedForce,
    /// z_r^input, used on position axes.
    pub position: &'a GeneralizedPosition,
    /// Rate of `position.external`, for feed-forward.
    pub object_twist: Twist<World>,
}

/// Inputs of one tick.
#[derive(Clone, Copy, Debug)]
pub struct HybridInputs<'a> {
    /// The n hands, in hand order.
    pub hands: &'a [HandInput],
    /// How far the object is from where rigid grasps would have it: where palms yield, hands don't tell
    /// where the object is. Zero if they don't, or nobody knows.
    pub grasp_yield: Twist<World>,
    /// What to control; nothing is controlled without it, and hand references hold.
    pub reference: Option<HybridReference<'a>>,
}

/// Where a hand is to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandReference {
    /// Reference pose.
    pub pose: Pose<World, Hand>,
    /// Twist of the hand if it moves with the object's reference: the predictable part of the reference's
    /// motion. What feedback adds is not in it.
    pub twist: Twist<World>,
    /// Wrench that the hand is to apply to the object, at its origin: its share of what moves the object
    /// and of the reference internal forces (eq. 7). The predictable part of its load.
    pub wrench: Wrench<World>,
}

/// What one tick gives.
#[derive(Clone, Debug, PartialEq)]
pub struct HybridOutput {
    /// h_c, filtered.
    pub force: GeneralizedForce,
    /// z_c.
    pub position: GeneralizedPosition,
    /// References of the n hands.
    pub hands: Vec<HandReference>,
    /// How many references wait for hands that don't follow.
    pub hands_held_back: usize,
}

impl HybridOutput {
    /// For n `arms`.
    pub fn new(arms: usize) -> Self {
        let at_rest = HandReference { pose: Pose::identity(), twist: Twist::zero(), wrench: Wrench::zero() };
        Self {
            force: GeneralizedForce::zero(arms),
            position: GeneralizedPosition::at_grasp(Pose::identity(), arms),
            hands: vec![at_rest; arms],
            hands_held_back: 0,
        }
    }
}

/// Why a tick gave nothing. State and output are as they were.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HybridError {
    /// Inputs, scratch, output or grasp are not for the law's number of arms.
    #[error("inputs, scratch, output or grasp are for another number of arms")]
    WrongSize,
    /// An input is NaN or infinite.
    #[error("the input of a hand, or a reference, is not finite")]
    NonFiniteInput,
    /// The state holds no valid pose.
    #[error("the state holds a pose that is none")]
    InvalidState,
}
