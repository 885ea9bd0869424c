//! Steps that change while they are made: where a swinging foot had better land, and when, for a robot whose
//! divergent component is not where its plan has it.
//!
//! Source: Khadiv, Herzog, Moosavian, Righetti, "Walking control based on step timing adaptation", IEEE T-RO 2020,
//! section III: over a foot that stands at p, the divergent component reaches `p + (ξ − p) τ` by the landing, with
//! τ = exp(ω t), and shall then be as far from the new foothold u as it is after a step that nobody disturbs:
//! `u + b = p + (ξ − p) τ`. That is linear in u and τ, and the step nearest to the planned one is a least-squares
//! problem within bounds.

use super::ground_pose::GroundPose;
use super::step_planner::StepLimits;
use crate::balance::{PerFoot, Side};
use crate::estimate::SoleRectangle;
use nalgebra::{Rotation2, Vector2};

/// How steps are adjusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepAdjustment {
    /// ω of the robot as a pendulum \[1/s\].
    pub frequency_1_s: f64,
    /// Share of the way to a sole's edge by which the divergent component may be off before a step is adjusted: up to
    /// there the stabiliser, whose zero moment point goes twice as far, brings it back.
    pub room_share: f64,
    /// How much of a sole at its edges nobody counts on \[m\].
    pub sole_margin_m: f64,
    /// By how far a foothold is moved rather than have τ changed by one \[m\].
    pub timing_weight_m: f64,
    /// Least time from a decision to the landing \[s\].
    pub least_swing_s: f64,
    /// Before a landing that is nearer than this the foothold stays \[s\].
    pub settled_s: f64,
    /// Time constant in which the plan takes over where the robot is \[s\].
    pub take_over_s: f64,
}

/// A step that goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepInHand {
    /// The foot that swings.
    pub swing: Side,
    /// Where the other one stands.
    pub stance: GroundPose,
    /// The extended zero moment point that is planned under it \[m, world\].
    pub pivot: Vector2<f64>,
    /// Foothold as planned when the foot left the ground.
    pub planned: GroundPose,
    /// b: divergent component against the foothold at a landing that nobody disturbs \[m\]; as it follows from the
    /// plan's divergent component while nobody has disturbed this step.
    pub offset: Option<Vector2<f64>>,
    /// Until it lands \[s\].
    pub seconds_left: f64,
    /// ξ as planned \[m\].
    pub planned_dcm: Vector2<f64>,
}

/// How a step goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdjustedStep {
    /// Where it is to land.
    pub to: GroundPose,
    /// b, which stays until it has landed.
    pub offset: Vector2<f64>,
    /// When it had better land \[s from now\], no later than planned.
    pub land_in_s: f64,
    /// By how much the plan's divergent component is to go to where the robot is \[m\].
    pub take_over: Vector2<f64>,
}

impl StepAdjustment {
    /// For a pendulum of this frequency.
    pub fn standard(frequency_1_s: f64) -> Self {
        Self {
            frequency_1_s,
            room_share: 0.5,
            sole_margin_m: 0.01,
            timing_weight_m: 0.08,
            least_swing_s: 0.2,
            settled_s: 0.08,
            take_over_s: 0.03,
        }
    }

    /// What of an error of the divergent component \[m, world\] is left to steps over a foot that stands.
    pub fn excess(
        &self,
        error: &Vector2<f64>,
        soles: &PerFoot<SoleRectangle>,
        zmp_in_foot: &PerFoot<Vector2<f64>>,
        side: Side,
        stance: &GroundPose,
    ) -> Vector2<f64> {
        let local = Rotation2::new(-stance.yaw) * error;
        let (sole, rest) = (&soles[side], &zmp_in_foot[side]);
        let beyond = |error: f64, min: f64, max: f64, rest: f64| {
            let room = |edge: f64| self.room_share * (edge - self.sole_margin_m).max(0.0);
            error - error.clamp(-room(rest - min), room(max - rest))
        };
        let excess = Vector2::new(
            beyond(local.x, sole.x_min, sole.x_max, rest.x),
            beyond(local.y, sole.y_min, sole.y_max, rest.y),
        );
        // Nothing turned is nothing, but for its sign.
        if excess == Vector2::zeros() { excess } else { Rotation2::new(stance.yaw) * excess }
    }

    /// The step that is nearest to the planned one, with `excess` of the divergent component's error to be stepped
    /// after; `None` where there is nothing to adjust, or no time left.
    ///
    /// With v = ξ − p and D = u₀ + b − p for the planned foothold u₀, a landing at τ needs the foothold u₀ + v τ − D. The
    /// least of `|v τ − D|² + w² (τ − τ₀)²` is at `τ = (v·D + w² τ₀) / (v² + w²)`.
    pub fn adjust(
        &self,
        step: &StepInHand,
        excess: &Vector2<f64>,
        limits: &StepLimits,
        period_s: f64,
    ) -> Option<AdjustedStep> {
        if step.offset.is_none() && *excess == Vector2::zeros() || step.seconds_left < self.settled_s {
            return None;
        }
        let omega = self.frequency_1_s;
        let planned_growth = (omega * step.seconds_left).exp();
        let planned = step.planned_dcm - step.pivot;
        let offset = step.offset.unwrap_or(planned * planned_growth + step.pivot - step.planned.position);
        let goal = step.planned.position + offset - step.pivot;
        let way = planned + excess;

        let weight = self.timing_weight_m * self.timing_weight_m;
        // Who falls away from the foothold has nothing of a sooner landing.
        let helps = excess.dot(&goal) > 0.0 || step.offset.is_some() && way.dot(&goal) > 0.0;
        let growth = match helps {
            true => (way.dot(&goal) + weight * planned_growth) / (way.norm_squared() + weight),
            false => planned_growth,
        };
        let least = (omega * self.least_swing_s.min(step.seconds_left)).exp();
        let land_in_s = growth.clamp(least, planned_growth).ln() / omega;

        let moved = way * planned_growth - goal;
        let wished = GroundPose { position: step.planned.position + moved, ..step.planned };
        let to = limits.foothold(step.swing, &step.stance, &wished);
        let reached = (goal + (to.position - step.planned.position)) / planned_growth - planned;
        let share = (period_s / self.take_over_s).min(1.0);
        let take_over = reached.cap_magnitude(excess.norm()) * share;
        Some(AdjustedStep { to, offset, land_in_s, take_over })
    }
}
