//! Leader-follower coordination (section 4.1), to compare symmetry with: one robot moves the object, the
//! others plan from the forces at their hands. Each robot has its own step clock.
//!
//! The leader's hands move with the object's reference as one body. A follower's hands stay where they
//! are until the force at them has changed by more than a threshold, and a delay has passed since; from
//! then on they go where the force goes away. No hand is compliant by control, as in the paper's comparison.

use crate::build::BuildCoordinatorError;
use crate::step_clock::{TeamClockState, Wishes};
use bytemuck::{Pod, Zeroable};
use mikoshi_config::RunSpec;
use mikoshi_config::scenario::Policy;
use mikoshi_cooperation::{HandInput, HandReference};
use mikoshi_humanoid::gait::StepTiming;
use mikoshi_ipc_types::MAX_ROBOTS;
use mikoshi_spatial::{Object, Pose, Twist, World};
use nalgebra::{Vector2, Vector3};

/// Time in which a follower that moves lets the force at its hands go away.
const FOLLOW_S: f64 = 0.4;

/// One robot leads. Immutable.
#[derive(Clone, Debug)]
pub(crate) struct Leading {
    leader: usize,
    detection_n: f64,
    delay_ticks: u64,
    followers_move: bool,
    period_s: f64,
    /// Stiffness between the leader and one follower through the object, follower by follower.
    stiffness_n_m: [f64; MAX_ROBOTS],
    hands_of_robots: Vec<usize>,
}

/// What is remembered between ticks.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LeadingState {
    /// The object's reference when control started.
    object_at_start: [f64; 7],
    followers: [FollowerState; MAX_ROBOTS],
    /// Of each robot.
    pub clocks: [TeamClockState; MAX_ROBOTS],
}

/// One follower.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct FollowerState {
    /// Force at its hands when control started \[N\].
    force_at_start: [f64; 2],
    /// What it takes for the object's velocity \[m/s\].
    velocity: [f64; 2],
    /// How far its hands have gone \[m\].
    displacement: [f64; 2],
    /// Ticks since it noticed that it is pulled; 0 before.
    ticks_since_noticed: u64,
}

// SAFETY: zeros are a valid value of integers and floats.
unsafe impl Zeroable for FollowerState {}
// SAFETY: `repr(C)` over fields of 8-byte units and alignment only: no padding, any bit pattern valid.
unsafe impl Pod for FollowerState {}
// SAFETY: as above.
unsafe impl Zeroable for LeadingState {}
// SAFETY: as above.
unsafe impl Pod for LeadingState {}

impl LeadingState {
    /// With the object's reference at `X_WA` and these forces at the hands.
    pub(crate) fn at_start(
        leading: Option<&Leading>,
        X_WA: &Pose<World, Object>,
        hands: &[HandInput],
    ) -> Self {
        let mut state = Self {
            object_at_start: X_WA.to_array(),
            followers: [FollowerState::default(); MAX_ROBOTS],
            clocks: [TeamClockState::default(); MAX_ROBOTS],
        };
        let Some(leading) = leading else { return state };
        let mut hands = hands.iter();
        for (follower, &count) in state.followers.iter_mut().zip(&leading.hands_of_robots) {
            follower.force_at_start = force_on_robot(hands.by_ref().take(count)).into();
        }
        state
    }
}

impl Leading {
    /// As the scenario has it; `None` where the team is coordinated by symmetry.
    pub(crate) fn new(run: &RunSpec) -> Result<Option<Self>, BuildCoordinatorError> {
        let coordination = &run.scenario.coordination;
        if coordination.policy == Policy::Symmetry {
            return Ok(None);
        }
        let names = || run.robots.iter().map(|robot| robot.member.name.as_str());
        let leader = match &coordination.leader {
            None => 0,
            Some(name) => names().position(|known| known == name).ok_or_else(|| {
                let (found, expected) = (name.clone(), names().collect::<Vec<_>>().join(", "));
                BuildCoordinatorError::UnknownLeader { found, expected }
            })?,
        };
        let hands_of_robots: Vec<usize> = run.robots.iter().map(|robot| robot.grasping_hands.len()).collect();
        let mut stiffness_n_m = [0.0; MAX_ROBOTS];
        for (follower, stiffness) in stiffness_n_m.iter_mut().enumerate().take(hands_of_robots.len()) {
            *stiffness = series_stiffness(run, leader, follower);
        }
        let period_s = run.scenario.control_period_s;
        Ok(Some(Self {
            leader,
            detection_n: coordination.detection_n,
            delay_ticks: (coordination.delay_s / period_s).round() as u64,
            followers_move: coordination.followers_move,
            period_s,
            stiffness_n_m,
            hands_of_robots,
        }))
    }

    /// One tick: `references` hold the hands' poses when control started, and become the references of
    /// this tick. `None` if the state is none.
    pub(crate) fn act(
        &self,
        state: &mut LeadingState,
        object: (&Pose<World, Object>, &Twist<World>),
        hands: &[HandInput],
        references: &mut [HandReference],
    ) -> Option<()> {
        let (X_WA_ref, twist) = object;
        let X_WA_start = Pose::<World, Object>::from_array(&state.object_at_start)?;
        let mut first = 0;
        for (robot, &count) in self.hands_of_robots.iter().enumerate() {
            let range = first..first + count;
            first = range.end;
            let (hands, references) = (hands.get(range.clone())?, references.get_mut(range)?);
            if robot == self.leader {
                for reference in references {
                    let X_AH = X_WA_start.inverse() * reference.pose;
                    reference.pose = *X_WA_ref * X_AH;
                    let lever = reference.pose.translation - X_WA_ref.translation;
                    reference.twist = twist.shifted(&lever);
                }
                continue;
            }
            let follower = state.followers.get_mut(robot)?;
            self.follow(follower, *self.stiffness_n_m.get(robot)?, force_on_robot(hands.iter()));
            let moved = |v: &[f64; 2]| Twist::new(Vector3::new(v[0], v[1], 0.0), Vector3::zeros());
            for reference in references {
                reference.pose = reference.pose.displaced(&moved(&follower.displacement));
                reference.twist = moved(&follower.velocity);
            }
        }
        Some(())
    }

    /// A follower lets the force f go away within [`FOLLOW_S`] = T: `v = v̂ + 2 f / (k T)`, where the
    /// estimate of the object's velocity learns from what is left: `dv̂/dt = f / (k T²)`.
    fn follow(&self, follower: &mut FollowerState, stiffness_n_m: f64, force: Vector2<f64>) {
        let pulled = force - Vector2::from(follower.force_at_start);
        if follower.ticks_since_noticed > 0 || pulled.norm() > self.detection_n {
            follower.ticks_since_noticed = follower.ticks_since_noticed.saturating_add(1);
        }
        if !self.followers_move || follower.ticks_since_noticed <= self.delay_ticks {
            return;
        }
        let stretched = pulled / stiffness_n_m;
        let estimate = Vector2::from(follower.velocity) + stretched * (self.period_s / (FOLLOW_S * FOLLOW_S));
        let velocity = estimate + stretched * (2.0 / FOLLOW_S);
        follower.velocity = estimate.into();
        follower.displacement = (Vector2::from(follower.displacement) + velocity * self.period_s).into();
    }

    /// Every robot has its own clock; a follower that doesn't move doesn't step either. `None` if the
    /// state is none.
    pub(crate) fn advance_clocks(
        &self,
        state: &mut LeadingState,
        timing: &StepTiming,
        wishes: &Wishes,
    ) -> Option<()> {
        for (robot, clock) in state.clocks.iter_mut().enumerate().take(self.hands_of_robots.len()) {
            let may_walk = robot == self.leader || self.followers_move;
            *clock = clock.advance(timing, &wishes.of_robot(robot), may_walk)?;
        }
        Some(())
    }
}

/// What the object does to a robot, along the ground \[N\].
fn force_on_robot<'a>(hands: impl Iterator<Item = &'a HandInput>) -> Vector2<f64> {
    hands.map(|hand| -hand.wrench.force.xy()).sum()
}

/// k of eq. 42: of all the leader's hands in series with all the follower's.
fn series_stiffness(run: &RunSpec, leader: usize, follower: usize) -> f64 {
    let hands = |robot: usize| run.robots.get(robot).map_or(1, |robot| robot.grasping_hands.len()) as f64;
    run.scenario.hybrid.hand_stiffness_n_m * hands(leader) * hands(follower)
        / (hands(leader) + hands(follower))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leading() -> Leading {
        Leading {
            leader: 0,
            detection_n: 5.0,
            delay_ticks: 100,
            followers_move: true,
            period_s: 0.005,
            stiffness_n_m: [1000.0; MAX_ROBOTS],
            hands_of_robots: vec![2, 2],
        }
    }

    /// The follower of an object that moves at 0.1 m/s, through its spring.
    fn follow(leading: &Leading, ticks: u64) -> (FollowerState, f64) {
        let mut follower = FollowerState::default();
        let mut stretched = 0.0;
        for tick in 1..=ticks {
            stretched = 0.1 * tick as f64 * 0.005 - follower.displacement[0];
            leading.follow(&mut follower, 1000.0, Vector2::new(1000.0 * stretched, 0.0));
        }
        (follower, stretched)
    }

    #[test]
    fn a_follower_stays_until_it_has_noticed_and_its_delay_is_over() {
        // 5 N are noticed after 50 ms, i.e. in tick 11; 100 ticks later the follower moves.
        assert_eq!(follow(&leading(), 110).0.displacement, [0.0, 0.0]);
        assert!(follow(&leading(), 112).0.displacement[0] > 0.0);
        let never = Leading { followers_move: false, ..leading() };
        assert_eq!(follow(&never, 1000).0.displacement, [0.0, 0.0]);
    }

    #[test]
    fn a_follower_that_moves_ends_up_as_fast_as_the_object_and_without_force() {
        let (follower, stretched) = follow(&leading(), 1000);
        assert!((follower.velocity[0] - 0.1).abs() < 1e-3, "{follower:?}");
        assert!(stretched.abs() < 1e-3, "{stretched}");
    }
}
