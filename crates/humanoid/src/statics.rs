//! What a posture costs: torques with which a robot at rest bears itself and what its hands carry.
//!
//! A drive's torque is the opposite of the moment that all beyond its joint has about its axis: weights, what hands are
//! pressed down by, and for a leg that stands, the ground.

use crate::balance::{GRAVITY_M_S2, PerFoot, Side};
use crate::kinematics::Kinematics;
use crate::model::{FrameId, JointKind, MAX_HANDS, MAX_JOINTS, Model};
use mikoshi_spatial::{Foot, World, Wrench};
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Share of its limit that a joint may need at rest: the rest is for what moves.
pub const BEARABLE_SHARE: f64 = 0.8;
/// What nobody bears \[N\].
const MOST_N: f64 = 1e5;
/// Largest moment that a hand applies of its own accord \[Nm\].
const HAND_LIMIT_NM: f64 = 20.0;
/// Part of the robot's weight below which the best moment for a load is in proportion to it.
const LEAST_SHARE: f64 = 0.1;
/// Rounds in which the best moment is found to a thousandth of what a hand can apply.
const ROUNDS: usize = 20;

/// What bears: palms, and points under the soles where the ground presses.
#[derive(Clone, Copy, Debug)]
pub struct Bearing<'a> {
    /// Palms.
    pub hands: &'a [FrameId],
    /// Soles of the feet that may have to bear all of it.
    pub feet: PerFoot<Option<FrameId>>,
    /// Where under each foot the zero moment point rests, in the foot's frame \[m\].
    pub zmp_in_foot: PerFoot<Vector2<f64>>,
}

/// What a robot can bear as it stands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Burden {
    /// Largest torque that a joint needs, as a share of its limit, on either foot.
    pub torque_share: f64,
    /// That joint.
    pub joint: u64,
    /// Vertical force that its hands together could bear before a joint needed [`BEARABLE_SHARE`] \[N\]; never less than 0.
    pub bearable_n: f64,
    /// Moment that the hands together would best apply to what they lift, so that the joints that bear them need least
    /// \[Nm, world\]: it brings the line on which the load acts nearer to the body.
    pub moment_nm: Vector3<f64>,
}

impl Bearing<'_> {
    /// For hands that lift with `force_n` together, each the same, and apply the best moment beside; in the posture of
    /// `kinematics`.
    ///
    /// Torques are linear, τ = τ₀ + f k + n b, with n about the horizontal axis across the way from body to hands. Of the
    /// joints between root and hands n is the one with the least Σ (τ / τ_max)⁴, the hands' own moments among them: the
    /// joint that is worst off counts most.
    pub fn burden(&self, model: &Model, kinematics: &Kinematics, force_n: f64) -> Burden {
        let hands = self.hands.get(..self.hands.len().min(MAX_HANDS)).unwrap_or(self.hands);
        let count = hands.len().max(1) as f64;
        let paths = hands.iter().fold(0, |set, &hand| set | model.path(model.frame(hand).body));
        let legs =
            PerFoot::from_fn(|side| self.feet[side].map_or(0, |foot| model.path(model.frame(foot).body)));
        let across = self.across(model, kinematics, hands);
        let lifted = Wrench::<World>::new(Vector3::new(0.0, 0.0, -1.0 / count), Vector3::zeros());
        let turned = Wrench::<World>::new(Vector3::zeros(), -across / count);
        let of_hands = |j: usize, wrench: &Wrench<World>| {
            let bears = hands.iter().filter(|hand| model.path(model.frame(**hand).body) >> j & 1 == 1);
            bears.fold(0.0, |sum, &hand| {
                sum - kinematics.moment_about(model, j, &kinematics.frame_position(model, hand), wrench)
            })
        };
        // Without a limit there is nothing to spare.
        let is_limited = |j: usize| {
            let effort = model.joints()[j].effort;
            effort.is_finite() && effort > 0.0
        };
        let among = |set: u64| (0..model.joint_count()).filter(move |&j| set >> j & 1 == 1 && is_limited(j));
        let arms = || among(paths & !legs.right & !legs.left);

        // [τ₀, k, b] of each joint, in shares of its limit.
        let mut shares = [[0.0; 3]; MAX_JOINTS];
        for j in arms() {
            let of_load = [-kinematics.weight_moment(model, j), of_hands(j, &lifted), of_hands(j, &turned)];
            shares[j] = of_load.map(|torque| torque / model.joints()[j].effort);
        }
        // What moves is not still enough to be judged by less.
        let judged_n = force_n.max(LEAST_SHARE * model.total_mass_kg() * GRAVITY_M_S2);
        let of_judged = least_at(count * HAND_LIMIT_NM, |moment| {
            let of_hands = (moment / (count * HAND_LIMIT_NM)).powi(4);
            let shares = arms().map(|j| shares[j]);
            shares.fold(of_hands, |sum, [own, lift, turn]| {
                sum + (own + lift * judged_n + turn * moment).powi(4)
            })
        });
        let by_force = of_judged / judged_n;
        let moment = by_force * force_n;

        let mut burden =
            Burden { torque_share: 0.0, joint: 0, bearable_n: MOST_N, moment_nm: across * moment };
        let mut note = |j: usize, own: f64, lift: f64, now: f64| {
            if now.abs() > burden.torque_share {
                (burden.torque_share, burden.joint) = (now.abs(), j as u64);
            }
            let room = if lift > 0.0 { BEARABLE_SHARE - own } else { BEARABLE_SHARE + own };
            if lift != 0.0 {
                burden.bearable_n = burden.bearable_n.min((room / lift.abs()).max(0.0));
            }
        };
        for j in arms() {
            let [own, lift, turn] = shares[j];
            note(j, own, lift + turn * by_force, own + lift * force_n + turn * moment);
        }
        let weight_n = model.total_mass_kg() * GRAVITY_M_S2;
        for side in Side::BOTH {
            let Some(foot) = self.feet[side] else { continue };
            let foot = kinematics.frame_pose::<Foot>(model, foot);
            let under = foot.transform_point(&self.zmp_in_foot[side].push(0.0));
            let up = Wrench::<World>::new(Vector3::z(), Vector3::zeros());
            for j in among(legs[side]) {
                let limit = model.joints()[j].effort;
                let by_ground = -kinematics.moment_about(model, j, &under, &up) / limit;
                let own = by_ground * weight_n - kinematics.weight_moment(model, j) / limit;
                note(j, own, by_ground, own + by_ground * force_n);
            }
        }
        burden
    }

    /// The horizontal axis across the way from the centre of mass to the hands: about it a load pulls forward.
    fn across(&self, model: &Model, kinematics: &Kinematics, hands: &[FrameId]) -> Vector3<f64> {
        let sum: Vector3<f64> = hands.iter().map(|&hand| kinematics.frame_position(model, hand)).sum();
        let ahead = sum / hands.len().max(1) as f64 - kinematics.com();
        Vector3::new(-ahead.y, ahead.x, 0.0).try_normalize(1e-6).unwrap_or_else(Vector3::zeros)
    }
}

/// Where a convex function is least between 0 and `most`: the interval shrinks by a third in every round.
fn least_at(most: f64, cost: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..ROUNDS {
        let third = (high - low) / 3.0;
        if cost(low + third) < cost(high - third) { high -= third } else { low += third }
    }
    0.5 * (low + high)
}

impl Kinematics {
    /// Moment about joint j's axis of the weights of all beyond it \[Nm\]; along it, their force \[N\].
    fn weight_moment(&self, model: &Model, j: usize) -> f64 {
        let weight_n = model.subtree_mass_kg(j + 1) * GRAVITY_M_S2;
        let weight = Wrench::new(Vector3::new(0.0, 0.0, -weight_n), Vector3::zeros());
        match weight_n > 0.0 {
            true => self.moment_about(model, j, &self.com_beyond(model, j), &weight),
            false => 0.0,
        }
    }

    /// Moment about joint j's axis of a wrench at a point; along it, its force.
    fn moment_about(&self, model: &Model, j: usize, point: &Vector3<f64>, wrench: &Wrench<World>) -> f64 {
        let (origin, axis) = self.joint(j);
        match model.joints()[j].kind {
            JointKind::Revolute => axis.dot(&((point - origin).cross(&wrench.force) + wrench.moment)),
            JointKind::Prismatic => axis.dot(&wrench.force),
        }
    }
}
