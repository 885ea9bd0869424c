//! Legs ahead of time: how they go on if all is as planned, and how they come to rest on both feet when nobody leads
//! them any more.

use crate::legs::{LegTargets, Legs, LegsState};
use mikoshi_humanoid::balance::{PerFoot, Side};
use mikoshi_humanoid::gait::{ComingToRest, GaitInputs, GaitState, HandCentre, SoleCorrection};
use mikoshi_spatial::Twist;
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// In which a centre of mass comes to rest once both feet stand.
pub(crate) const REST_S: f64 = 0.8;

/// Legs in some tick of the future.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Foresight {
    gait: GaitState,
    sole_correction: SoleCorrection,
    ground_tilt: PerFoot<Vector3<f64>>,
    rest: Option<Rest>,
}

/// A centre of mass on its way to rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Rest {
    motion: ComingToRest,
    ticks: u64,
}

impl Legs {
    /// Legs as they are.
    pub(crate) fn foresee(&self, state: &LegsState) -> Foresight {
        Foresight {
            gait: state.gait,
            sole_correction: state.sole_correction,
            ground_tilt: state.ground_tilt,
            rest: None,
        }
    }

    /// One tick on, under hands with this centre. While they are led they follow the team's clock; then a foot that
    /// swings lands where it was to land, no other is lifted, and the centre of mass comes to rest.
    pub(crate) fn go_on(&self, ahead: &mut Foresight, centre: Option<HandCentre>, are_led: bool) {
        let swinging = ahead.gait.phase.swinging_foot();
        if let Some(rest) = &mut ahead.rest {
            rest.ticks += 1;
        } else if are_led || swinging.is_some() {
            let now = self.gait.reference(&ahead.gait);
            let inputs = GaitInputs {
                clock: ahead.gait.clock.extrapolated(self.timing(), 1),
                hand_centre: centre,
                foot_force: PerFoot::from_fn(|side| self.foot_force_as_planned(&now.feet[side].pose)),
                soles: None,
                sole_heights: None,
                load: ahead.gait.load,
                divergent_component: None,
                soles_turn: PerFoot { right: false, left: false },
            };
            self.gait.act(&mut ahead.gait, &inputs);
        } else {
            let to = self.gait.resting_com(&ahead.gait);
            let motion = ComingToRest::new(ahead.gait.preview, to, REST_S);
            ahead.rest = Some(Rest { motion, ticks: 1 });
        }
        for side in Side::BOTH {
            // A foot in the air keeps what makes up for a leg that yields.
            if swinging.is_none_or(|foot| foot.side != side) {
                self.sole_tracking.fade(&mut ahead.sole_correction[side], self.period_s);
            }
        }
    }

    /// What they ask of the inverse kinematics then.
    pub(crate) fn foreseen(&self, ahead: &Foresight) -> LegTargets {
        let mut reference = self.gait.reference(&ahead.gait);
        if let Some(rest) = &ahead.rest {
            reference.com = rest.motion.com(rest.ticks as f64 * self.period_s).push(reference.com.z);
        }
        let soles = PerFoot::from_fn(|side| {
            let tilt = Twist::new(Vector3::zeros(), ahead.ground_tilt[side]);
            reference.feet[side].pose.displaced(&(ahead.sole_correction[side] + tilt))
        });
        self.targets(&reference, &soles, &soles, Vector2::zeros())
    }

    /// The most ticks in which legs come to rest that are not led any more: a swing, and what follows it.
    pub(crate) fn ticks_to_rest(&self) -> u64 {
        self.timing().single_support + (REST_S / self.period_s).ceil() as u64 + 1
    }
}
