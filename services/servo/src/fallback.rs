//! What becomes of a robot whose servo is lost: a plan of how to come to rest on both feet with the object in its
//! hands, made ahead of time, a part with each command.
//!
//! A plan begins with what the robot does in some tick, and takes [`FALLBACK_PARTS`] ticks to be made and sent. It is
//! for a loss in the as many ticks that follow: until their end legs go on as the team's clock has it, so that the
//! plan is what the robot does anyway; then they finish a swing and stand. Hands go on with the object until the team
//! has noticed, and then come to rest as it does. The plan takes the loss to come at the first of these ticks; its
//! last part says where the joints are if it comes at their end, and the object has gone on meanwhile.
//!
//! ```text
//!   making it            for a loss in these           legs: a last swing, then rest
//! ├─────────────────────┼─────────────────────┼──────────────────────────────────────────▶ ticks
//! 0                     N                     2N         hands: stale limit, then to rest
//! ```

use crate::foresight::{Foresight, REST_S};
use crate::legs::{HandReference, Legs, LegsState};
use crate::robot::Robot;
use mikoshi_config::scenario::Scenario;
use mikoshi_humanoid::gait::HandCentre;
use mikoshi_humanoid::ik::ConfigureIkError;
use mikoshi_humanoid::{IkScratch, IkState, IkTargets, WholeBodyIk};
use mikoshi_ipc_types::{FALLBACK_PARTS, JointCommand, MAX_HANDS};
use mikoshi_spatial::{Hand, Pose, Twist, World};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

const PARTS: u64 = FALLBACK_PARTS as u64;
/// Of a plan that is not made.
const NO_PART: u64 = PARTS;

/// How plans are made. Immutable.
#[derive(Clone, Debug)]
pub(crate) struct Fallback {
    ik: WholeBodyIk,
    period_s: f64,
    /// From one knot to the next, if the object does not need longer to come to rest than legs.
    spacing_ticks: u64,
    /// When the object begins to slow down, from the plan's beginning.
    braking_ticks: u64,
    /// How it does \[m/s² and rad/s²\].
    deceleration: [f64; 2],
}

/// A plan that is being made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FallbackState {
    /// The next part.
    part: u64,
    /// Ticks from the plan's beginning to where `legs` and `ik` are.
    ahead_ticks: u64,
    spacing_ticks: u64,
    legs: Foresight,
    ik: IkState,
    /// At the plan's beginning.
    hands: [Option<MovingHand>; MAX_HANDS],
    centre: Option<HandCentre>,
}

/// Where a hand is to be, and how it moves with the object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct MovingHand {
    pose: Pose<World, Hand>,
    twist: Twist<World>,
    /// Change of the twist \[m/s² and rad/s²\].
    acceleration: Twist<World>,
}

impl Fallback {
    /// For this robot with these legs.
    pub(crate) fn new(scenario: &Scenario, robot: &Robot, legs: &Legs) -> Result<Self, ConfigureIkError> {
        let ticks = PARTS + legs.ticks_to_rest();
        // A first knot at the first tick of a loss, the last one when all is at rest.
        let spacing_ticks = ticks.div_ceil(PARTS - 2);
        Ok(Self {
            ik: WholeBodyIk::new(&robot.model, robot.ik.config().with_longer_ticks(spacing_ticks))?,
            period_s: scenario.control_period_s,
            spacing_ticks,
            braking_ticks: PARTS + scenario.safety.stale_limit_ticks + scenario.coordination_delay_ticks,
            // Without a motion of its own an object goes where a job has it, and stops at once.
            deceleration: scenario.object_braking().unwrap_or([f64::INFINITY; 2]),
        })
    }

    /// Ticks in which any plan has come to its end that began with the last command.
    pub(crate) fn longest_plan_ticks(&self) -> u64 {
        let rest_ticks = (MOST_REST_S / self.period_s).ceil() as u64;
        let knots = PARTS - 2;
        let spacing_ticks = self.spacing_ticks.max((self.braking_ticks + rest_ticks).div_ceil(knots));
        3 * PARTS + spacing_ticks * knots
    }

    /// None yet.
    pub(crate) fn none(&self, legs: &Legs, state: &LegsState, ik: &IkState) -> FallbackState {
        FallbackState {
            part: NO_PART,
            ahead_ticks: 0,
            spacing_ticks: self.spacing_ticks,
            legs: legs.foresee(state),
            ik: *ik,
            hands: [None; MAX_HANDS],
            centre: None,
        }
    }

    /// Begins a plan if none is being made, by what legs, joints and hands do in this tick.
    pub(crate) fn begin(
        &self,
        state: &mut FallbackState,
        legs: (&Legs, &LegsState),
        ik: &IkState,
        hands: &[HandReference],
    ) {
        if state.part < NO_PART {
            return;
        }
        let (legs, legs_state) = legs;
        let before = state.hands;
        *state = FallbackState { part: 0, ..self.none(legs, legs_state, ik) };
        state.centre = legs_state.hand_centre;
        let mut braking_s: f64 = 0.0;
        for ((own, hand), before) in state.hands.iter_mut().zip(hands).zip(before) {
            let acceleration =
                before.map_or_else(Twist::zero, |before| self.acceleration(&before.twist, &hand.twist));
            *own = Some(MovingHand { pose: hand.pose, twist: hand.twist, acceleration });
            let [linear, angular] = self.deceleration;
            braking_s =
                braking_s.max(hand.twist.linear.norm() / linear).max(hand.twist.angular.norm() / angular);
        }
        // What slows down for longer than legs take has its knots farther apart.
        let ticks = self.braking_ticks + (braking_s.min(MOST_REST_S) / self.period_s).ceil() as u64;
        state.spacing_ticks = state.spacing_ticks.max(ticks.saturating_sub(PARTS).div_ceil(PARTS - 2));
    }

    /// The next part of the plan.
    pub(crate) fn go_on(
        &self,
        state: &mut FallbackState,
        legs: &Legs,
        robot: &Robot,
        scratch: &mut IkScratch,
        out: &mut JointCommand,
    ) {
        if state.part >= NO_PART {
            return;
        }
        let is_last = state.part + 1 == PARTS;
        let until = PARTS + state.spacing_ticks * state.part.min(PARTS - 2);
        while state.ahead_ticks < until {
            state.ahead_ticks += 1;
            let centre = state.centre.map(|centre| HandCentre {
                pose: centre.after(state.ahead_ticks as f64 * self.period_s),
                ..centre
            });
            legs.go_on(&mut state.legs, centre, state.ahead_ticks < 2 * PARTS);
        }
        let targets = legs.foreseen(&state.legs);
        let late_ticks = if is_last { PARTS } else { 0 };
        let targets = IkTargets {
            stance: targets.stance,
            feet: targets.feet,
            com: targets.com,
            waist_attitude: targets.waist_attitude,
            hands: state.hands.map(|hand| hand.map(|hand| self.hand(&hand, until, late_ticks))),
        };
        if self.ik.solve(&robot.model, &mut state.ik, scratch, &targets).is_err() {
            state.part = NO_PART;
            return;
        }
        out.fallback_position_rad = state.ik.joint_position;
        out.fallback_ahead_ticks = until - state.part;
        state.part += 1;
        out.fallback_part = state.part;
    }

    /// How a twist changes that was `before` when the last plan began, if that is how an object changes its motion.
    fn acceleration(&self, before: &Twist<World>, now: &Twist<World>) -> Twist<World> {
        let [linear, angular] = self.deceleration;
        let change = (*now - *before) * (1.0 / (PARTS as f64 * self.period_s));
        let bounded = |change: Vector3<f64>, most: f64| {
            if most.is_finite() { change.cap_magnitude(most) } else { Vector3::zeros() }
        };
        Twist::new(bounded(change.linear, linear), bounded(change.angular, angular))
    }

    /// A hand so many ticks on, where the loss comes `late_ticks` after the first tick that the plan is for: it has
    /// gone on as it did, and then slowed down.
    fn hand(&self, hand: &MovingHand, ticks: u64, late_ticks: u64) -> Pose<World, Hand> {
        let seconds = |ticks: u64| ticks as f64 * self.period_s;
        let going_on_s = seconds(ticks.min(self.braking_ticks) + late_ticks);
        let braking_s = seconds(ticks.saturating_sub(self.braking_ticks));
        let MovingHand { pose, twist, acceleration } = hand;
        let [linear, angular] = self.deceleration;
        pose.displaced(&Twist::new(
            way(&twist.linear, &acceleration.linear, going_on_s, linear, braking_s),
            way(&twist.angular, &acceleration.angular, going_on_s, angular, braking_s),
        ))
    }
}

/// What is travelled at the velocity v, which changes by a, in `going_on_s`, and then in `braking_s`, in which the
/// speed falls at `deceleration` to zero.
fn way(
    v: &Vector3<f64>,
    a: &Vector3<f64>,
    going_on_s: f64,
    deceleration: f64,
    braking_s: f64,
) -> Vector3<f64> {
    let velocity = v + a * going_on_s;
    let stop_s = velocity.norm() / deceleration;
    let s = braking_s.min(stop_s);
    let slowing = if s > 0.0 { velocity * (s - s * s / (2.0 * stop_s)) } else { Vector3::zeros() };
    v * going_on_s + a * (going_on_s * going_on_s / 2.0) + slowing
}

/// A hand that would slow down for longer is not foreseen to the end.
const MOST_REST_S: f64 = 3.0 * REST_S;
