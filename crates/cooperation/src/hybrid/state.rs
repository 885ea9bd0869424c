//! What the law remembers from tick to tick, and what it doesn't.

use crate::workspace::nan_pose;
use crate::{Formation, InternalForces, VirtualStick, WorkspaceScratch};
use bytemuck::{Pod, Zeroable};
use mikoshi_spatial::{Hand, Pose, Tip, World};
use nalgebra::Vector3;

/// All that matters between ticks, for up to `CAPACITY` arms: a plain value that can be copied bit by bit.
/// Entries past the number of arms are zero.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HybridState<const CAPACITY: usize> {
    /// Number n of arms of the grasp.
    pub arms: u64,
    /// Ticks since the grasp: at 0 there is neither a filtered force nor a reference yet.
    pub ticks: u64,
    /// Virtual sticks `X_HB`.
    pub sticks: [[f64; 7]; CAPACITY],
    /// Filtered h: row 0 in world axes, the others in object axes.
    pub filtered_force: [[f64; 6]; CAPACITY],
    /// The last hand references `X_WH`.
    pub hand_pose_ref: [[f64; 7]; CAPACITY],
    /// Not 0 where an arm takes no part, for [`HybridLaw::reform`](crate::HybridLaw::reform) to change.
    pub is_absent: [u64; CAPACITY],
}

// SAFETY: zeros are a valid value of integers and floats.
unsafe impl<const CAPACITY: usize> Zeroable for HybridState<CAPACITY> {}
// SAFETY: `repr(C)` over u64 and arrays of f64 only: every field has the same size unit and alignment, so
// there is no padding, and any bit pattern is valid.
unsafe impl<const CAPACITY: usize> Pod for HybridState<CAPACITY> {}

/// Why a grasp has no state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StartHybridError {
    /// More arms than the state can hold.
    #[error("{arms} arms grasp, and the state holds {capacity}")]
    TooManyArms {
        /// Arms that grasp.
        arms: usize,
        /// Arms that the state can hold.
        capacity: usize,
    },
}

impl<const CAPACITY: usize> HybridState<CAPACITY> {
    /// At the grasp, with the virtual stick of each hand in hand order. Hand references start at the
    /// commanded poses of the first tick, the filter at its wrenches.
    pub fn at_grasp(sticks: &[VirtualStick]) -> Result<Self, StartHybridError> {
        let arms = sticks.len();
        if arms > CAPACITY {
            return Err(StartHybridError::TooManyArms { arms, capacity: CAPACITY });
        }
        let mut state = Self { arms: arms as u64, ..Self::zeroed() };
        for (slot, stick) in state.sticks.iter_mut().zip(sticks) {
            *slot = stick.X_HB.to_array();
        }
        Ok(state)
    }

    /// Whether an arm takes part.
    pub fn takes_part(&self, arm: usize) -> bool {
        self.is_absent.get(arm) == Some(&0)
    }

    /// The virtual stick of a hand.
    pub fn stick(&self, hand: usize) -> Option<VirtualStick> {
        self.sticks.get(hand).and_then(Pose::from_array).map(|X_HB| VirtualStick { X_HB })
    }
}

/// Workspaces. Nothing in them outlives a tick: filled with NaN between ticks they change nothing.
#[derive(Clone, Debug)]
pub struct HybridScratch {
    pub(super) workspace: WorkspaceScratch,
    pub(super) formation: Formation,
    pub(super) sticks: Vec<VirtualStick>,
    pub(super) hand_pose_ref: Vec<Pose<World, Hand>>,
}

impl HybridScratch {
    /// For these internal forces.
    pub fn new(internal_forces: &InternalForces) -> Self {
        let n = internal_forces.arms();
        Self {
            workspace: WorkspaceScratch::new(internal_forces),
            formation: internal_forces.whole().clone(),
            sticks: vec![VirtualStick { X_HB: Pose::identity() }; n],
            hand_pose_ref: vec![Pose::identity(); n],
        }
    }

    /// Where each hand's stick ends, and the vector from the hand to there, in the world \[m\]: as the law has found them
    /// in this tick, whoever takes part.
    pub fn tips(&self) -> impl Iterator<Item = (&Pose<World, Tip>, &Vector3<f64>)> {
        self.workspace.tips.iter().zip(&self.workspace.levers)
    }

    /// Overwrites every number with NaN.
    pub fn poison(&mut self) {
        self.workspace.poison();
        self.formation.poison();
        self.sticks.fill(VirtualStick { X_HB: nan_pose() });
        self.hand_pose_ref.fill(nan_pose());
    }
}
