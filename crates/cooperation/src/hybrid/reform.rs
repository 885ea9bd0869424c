//! Arms leave a law that is at work, and come back to it.

use super::{HandInput, HybridError, HybridLaw, HybridScratch, HybridState};
use crate::workspace::mean_pose;
use crate::{FormError, Formation, VirtualStick, WorkspaceScratch};
use mikoshi_spatial::{Object, Pose, World, Wrench};

/// Why a law can't be at work for these arms. The state is as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)]
pub enum ReformError {
    #[error("{0}")]
    Form(#[from] FormError),
    #[error("{0}")]
    Law(#[from] HybridError),
}

impl HybridLaw {
    /// The internal forces' coefficients for the arms that take part by this state.
    ///
    /// # Errors
    /// No tick leaves such a state.
    pub fn form<const CAPACITY: usize>(
        &self,
        state: &HybridState<CAPACITY>,
        formation: &mut Formation,
    ) -> Result<(), HybridError> {
        let formed = self.internal_forces().form(|arm| state.takes_part(arm), formation);
        formed.map_err(|_| HybridError::InvalidState)
    }

    /// From the next tick on the law is at work for the arms that `takes_part` names: [W; C] and its inverse are
    /// formed anew for them ([`Formation`]). The mean of their tips is then at `X_WA`, where Σa is on the object.
    ///
    /// - Who stays keeps its reference, so that no hand jumps. All their sticks are moved alike, as one body, by what the
    ///   mean of their tips alone is off `X_WA`: the object's error is what `X_WA` makes it, and not what the others'
    ///   deviations were.
    /// - Who leaves goes along with the object, without feedback of force, until it comes back.
    /// - Who comes gets a stick that begins at its hand as it is and ends in Σa, and begins with the reference that it
    ///   went along with.
    /// - The filter remembers what each arm applies, and not what the rows were: its memory goes through the tips, q = U h
    ///   (eq. 7), and those who stay make up the new h' = [W'; C'] q. What was internal to all and is not internal to
    ///   those who stay becomes what they bear.
    ///
    /// Whoever gives references of forces begins them anew with `state.filtered_force`, as at the start of control.
    /// O(n), no allocation, no panic.
    ///
    /// # Errors
    /// Nobody would be left, C is a matrix, or sizes don't agree.
    pub fn reform<const CAPACITY: usize>(
        &self,
        state: &mut HybridState<CAPACITY>,
        scratch: &mut HybridScratch,
        X_WA: &Pose<World, Object>,
        hands: &[HandInput],
        takes_part: impl Fn(usize) -> bool,
    ) -> Result<(), ReformError> {
        let n = self.arms();
        let HybridScratch { workspace, sticks, formation, .. } = scratch;
        if hands.len() != n || n > CAPACITY || state.arms != n as u64 || sticks.len() != n {
            return Err(HybridError::WrongSize.into());
        }
        let (forces, X_AW) = (self.internal_forces(), X_WA.inverse());
        let WorkspaceScratch { tips, tip_twists, tip_wrenches, row_wrenches, work_wrenches, .. } = workspace;
        for ((stick, array), (tip, hand)) in
            sticks.iter_mut().zip(&state.sticks).zip(tips.iter_mut().zip(hands))
        {
            stick.X_HB = Pose::from_array(array).ok_or(HybridError::InvalidState)?;
            *tip = stick.tip_pose(&hand.pose);
        }
        // Before anything changes: whether they can be formed.
        forces.form(&takes_part, formation)?;
        self.form(state, formation)?;
        for (row, (memory, slot)) in state.filtered_force.iter().zip(row_wrenches.iter_mut()).enumerate() {
            *slot = match row {
                0 => Wrench::from_array(memory),
                _ => Wrench::<Object>::from_array(memory).expressed_in(X_WA),
            };
        }
        forces.among(formation).tip_forces(row_wrenches, tip_wrenches, work_wrenches);

        let stays = |arm: usize| state.takes_part(arm) && takes_part(arm);
        if forces.form(stays, formation).is_ok() {
            let mean = mean_pose(formation.w_inverse(), tips, tip_twists);
            let motion = *X_WA * mean.inverse();
            for ((stick, tip), hand) in sticks.iter_mut().zip(tips.iter()).zip(hands) {
                stick.X_HB = hand.pose.inverse() * (motion * *tip);
            }
        }
        let arms = hands.iter().zip(sticks.iter_mut()).zip(tip_wrenches.iter_mut()).zip(&mut state.is_absent);
        for (arm, (((hand, stick), tip), is_absent)) in arms.enumerate() {
            if *is_absent != 0 && takes_part(arm) {
                *stick = VirtualStick::at_grasp(&hand.pose, X_WA);
                *tip = stick.tip_wrench(&hand.pose, &hand.wrench);
            }
            *is_absent = u64::from(!takes_part(arm));
        }
        for (array, stick) in state.sticks.iter_mut().zip(sticks.iter()) {
            *array = stick.X_HB.to_array();
        }
        forces.form(&takes_part, formation)?;
        forces.among(formation).generalized_force(tip_wrenches, row_wrenches, work_wrenches);
        for (row, (memory, slot)) in state.filtered_force.iter_mut().zip(row_wrenches.iter()).enumerate() {
            *memory = match row {
                0 => slot.to_array(),
                _ => slot.expressed_in(&X_AW).to_array(),
            };
        }
        Ok(())
    }
}
