//! From a guess to a posture that stands and holds: how a run finds where its robots begin.

use super::{IkScratch, IkState, IkTargets, WholeBodyIk};
use crate::model::{MAX_JOINTS, Model};
use thiserror::Error;

/// Steps after which the search ends.
const MOST_STEPS: usize = 4000;
/// Largest increment of a joint in a step \[rad or m\].
const LARGEST_STEP: f64 = 0.1;
/// The search ends when no joint moves more than this in a step \[rad or m\].
const STILL: f64 = 1e-9;
/// What may be missing at the end, linear \[m\] and angular \[rad\].
const TOLERANCE: f64 = 1e-4;

/// A stance or a grasp that the robot cannot take.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SettlePostureError {
    /// A hand does not reach its grasp.
    #[error(
        "hand {hand} misses its grasp by {:.1} mm and {:.2}°; {}",
        missed_by_m * 1e3,
        missed_by_rad.to_degrees(),
        name_limits(limiting_joints)
    )]
    UnreachableGrasp {
        /// Index of the hand.
        hand: usize,
        /// How far.
        missed_by_m: f64,
        /// By which angle.
        missed_by_rad: f64,
        /// Joints that stand at their limits.
        limiting_joints: Vec<String>,
    },
    /// Centre of mass, waist and feet cannot be where they should at once.
    #[error(
        "the stance is out of reach: centre of mass by {:.1} mm, foot by {:.1} mm and {:.2}°, waist by {:.2}°; {}",
        com_missed_by_m * 1e3,
        foot_missed_by_m * 1e3,
        foot_missed_by_rad.to_degrees(),
        waist_missed_by_rad.to_degrees(),
        name_limits(limiting_joints)
    )]
    UnreachableStance {
        /// Of the centre of mass.
        com_missed_by_m: f64,
        /// Of the foot that is not the base.
        foot_missed_by_m: f64,
        /// Of that foot.
        foot_missed_by_rad: f64,
        /// Of the waist.
        waist_missed_by_rad: f64,
        /// Joints that stand at their limits.
        limiting_joints: Vec<String>,
    },
    /// A reference or the guess is not finite.
    #[error("a reference or the posture to start from is not finite")]
    NotFinite,
}

fn name_limits(joints: &[String]) -> String {
    match joints {
        [] => "no joint stands at its limit".into(),
        joints => format!("joints at their limits: {}", joints.join(", ")),
    }
}

impl WholeBodyIk {
    /// A posture at rest that meets `targets`, from the posture `guess` in the order of the model: where
    /// the null space has come to rest, within the margins of all limits. For use before a run: it takes
    /// thousands of ticks' worth of steps.
    ///
    /// # Errors
    /// What is out of reach, by how much, and which joints are in the way.
    pub fn settle(
        &self,
        model: &Model,
        scratch: &mut IkScratch,
        guess: &[f64],
        targets: &IkTargets,
    ) -> Result<IkState, SettlePostureError> {
        let mut state = IkState::at_rest(guess);
        let mut report = None;
        for _ in 0..MOST_STEPS {
            let step = self
                .step(model, &mut state, scratch, targets, (&[LARGEST_STEP; MAX_JOINTS], f64::INFINITY))
                .map_err(|_| SettlePostureError::NotFinite)?;
            report = Some(step);
            if state.joint_velocity.iter().all(|rate| (rate * self.config.period_s).abs() < STILL) {
                break;
            }
        }
        let Some(report) = report else { return Err(SettlePostureError::NotFinite) };

        let limiting_joints = || {
            let at_limit = |j: &usize| report.at_position_limit >> j & 1 == 1;
            (0..model.joint_count()).filter(at_limit).map(|j| model.joints()[j].name.clone()).collect()
        };
        let balance = [report.com_error_m, report.waist_error_rad];
        if balance.into_iter().chain([report.foot_error_m, report.foot_error_rad]).any(|e| e > TOLERANCE) {
            return Err(SettlePostureError::UnreachableStance {
                com_missed_by_m: report.com_error_m,
                foot_missed_by_m: report.foot_error_m,
                foot_missed_by_rad: report.foot_error_rad,
                waist_missed_by_rad: report.waist_error_rad,
                limiting_joints: limiting_joints(),
            });
        }
        // The hand that misses most is the one to name.
        let missed = |&hand: &usize| report.hand_error_m[hand].max(report.hand_error_rad[hand]);
        let worst = (0..self.config.hands.len()).max_by(|a, b| missed(a).total_cmp(&missed(b)));
        if let Some(hand) = worst.filter(|hand| missed(hand) > TOLERANCE) {
            return Err(SettlePostureError::UnreachableGrasp {
                hand,
                missed_by_m: report.hand_error_m[hand],
                missed_by_rad: report.hand_error_rad[hand],
                limiting_joints: limiting_joints(),
            });
        }
        Ok(IkState::at_rest(&state.joint_position[..model.joint_count()]))
    }
}
