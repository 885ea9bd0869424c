//! The hands of a robot that holds nothing, on their way: one body that walks, and palms that are drawn back from it.

use bytemuck::{Pod, Zeroable};
use mikoshi_cooperation::HandReference;
use mikoshi_ipc_types::MAX_HANDS;
use mikoshi_spatial::{Hand, Object, Pose, Twist, World, Wrench};
use nalgebra::{UnitQuaternion, Vector3};

/// How fast it may gain and lose speed: within what feet follow that do not step yet.
const ACCELERATION_M_S2: f64 = 0.05;
const ACCELERATION_RAD_S2: f64 = 0.05;
/// How fast it may turn.
const SPEED_RAD_S: f64 = 0.06;
/// Near its goal it goes at this rate of what is left \[1/s\].
const RATE_HZ: f64 = 2.0;
/// How fast palms are drawn back, and how fast they may gain and lose that.
const DRAW_M_S: f64 = 0.03;
const DRAW_M_S2: f64 = 0.05;
/// It has come where it is to be when no more than this is left: hands take hold of where they are.
const ARRIVED_M: f64 = 0.001;
const ARRIVED_RAD: f64 = 0.002;

/// Where it is, and how it moves: all that matters between ticks.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rig {
    /// Frame G: Σa where the hands hold, and away from it where they are away.
    frame: [f64; 7],
    twist: [f64; 6],
    draw_m: f64,
    draw_m_s: f64,
    /// Hands in G, not drawn back.
    hands: [[f64; 7]; MAX_HANDS],
}

// SAFETY: zeros are a valid value of floats.
unsafe impl Zeroable for Rig {}
// SAFETY: `repr(C)` over floats only: no padding, any bit pattern valid.
unsafe impl Pod for Rig {}

/// Where a rig is to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Goal {
    /// Of frame G.
    pub frame: Pose<World, Object>,
    /// How far palms are to be drawn back \[m\].
    pub draw_m: f64,
    /// How fast G may go \[m/s\].
    pub speed_m_s: f64,
    /// The part of that which feet leave, 0 to 1.
    pub speed_share: f64,
}

impl Rig {
    /// Of hands at rest with these references, about an object at `X_WA`.
    pub(crate) fn at(X_WA: &Pose<World, Object>, references: &[HandReference]) -> Self {
        let mut rig = Self { frame: X_WA.to_array(), ..Self::zeroed() };
        for (hand, reference) in rig.hands.iter_mut().zip(references) {
            *hand = (X_WA.inverse() * reference.pose).to_array();
        }
        rig
    }

    /// Whether there is one.
    pub(crate) fn is_there(&self) -> bool {
        self.frame != [0.0; 7]
    }

    /// One tick on its way. `None`, and nothing has changed, if what is stored is no pose.
    pub(crate) fn advance(&mut self, goal: &Goal, period_s: f64) -> Option<()> {
        let X_WG = self.frame()?;
        let left = X_WG.displacement_to(&goal.frame);
        let last = Twist::<World>::from_array(&self.twist);
        let share = goal.speed_share;
        let (most_m_s, most_rad_s) = (goal.speed_m_s * share, SPEED_RAD_S * share);
        let twist = Twist::new(
            steered(&last.linear, &left.linear, most_m_s, ACCELERATION_M_S2, period_s),
            steered(&last.angular, &left.angular, most_rad_s, ACCELERATION_RAD_S2, period_s),
        );
        let draw_left = Vector3::new(goal.draw_m - self.draw_m, 0.0, 0.0);
        let draw = Vector3::new(self.draw_m_s, 0.0, 0.0);
        self.draw_m_s = steered(&draw, &draw_left, DRAW_M_S, DRAW_M_S2, period_s).x;
        self.draw_m += self.draw_m_s * period_s;
        self.twist = twist.to_array();
        self.frame = X_WG.displaced(&(twist * period_s)).to_array();
        Some(())
    }

    /// It stays where it is.
    pub(crate) fn rest(&mut self) {
        (self.twist, self.draw_m_s) = ([0.0; 6], 0.0);
    }

    /// Frame G; `None` if what is stored is no pose.
    pub(crate) fn frame(&self) -> Option<Pose<World, Object>> {
        Pose::from_array(&self.frame)
    }

    /// Whether G is within so much of where it is to be.
    pub(crate) fn is_near(&self, goal: &Goal, m: f64, rad: f64) -> bool {
        self.frame().is_some_and(|X_WG| {
            let left = X_WG.displacement_to(&goal.frame);
            left.linear.norm() <= m && left.angular.norm() <= rad
        })
    }

    /// Whether it is there.
    pub(crate) fn has_arrived(&self, goal: &Goal) -> bool {
        self.is_near(goal, ARRIVED_M, ARRIVED_RAD)
    }

    /// Whether palms are where they are to be.
    pub(crate) fn has_drawn(&self, goal: &Goal) -> bool {
        (self.draw_m - goal.draw_m).abs() <= ARRIVED_M
    }

    /// Where a hand is to hold an object at `X_WA`; `None` if what is stored is no pose.
    pub(crate) fn place(&self, hand: usize, X_WA: &Pose<World, Object>) -> Option<Pose<World, Hand>> {
        let X_GH = Pose::<Object, Hand>::from_array(self.hands.get(hand)?)?;
        Some(*X_WA * X_GH)
    }

    /// References of its hands.
    pub(crate) fn refer(&self, references: &mut [HandReference]) {
        let Some(X_WG) = self.frame() else { return };
        let twist = Twist::<World>::from_array(&self.twist);
        let drawn = Pose::<Hand, Hand>::new(Vector3::new(0.0, 0.0, self.draw_m), UnitQuaternion::identity());
        for (hand, reference) in references.iter_mut().enumerate() {
            let Some(place) = self.place(hand, &X_WG) else { return };
            let pose = place * drawn;
            let along = pose.rotation * Vector3::new(0.0, 0.0, self.draw_m_s);
            let moved = twist.shifted(&(pose.translation - X_WG.translation));
            let twist = Twist::new(moved.linear + along, moved.angular);
            *reference = HandReference { pose, twist, wrench: Wrench::zero() };
        }
    }
}

/// The velocity after a tick of something that has `left` to go: no faster than `most`, than what it can brake from with
/// `acceleration`, and in the end than a rate of what is left; changed by no more than `acceleration`.
fn steered(
    last: &Vector3<f64>,
    left: &Vector3<f64>,
    most: f64,
    acceleration: f64,
    period_s: f64,
) -> Vector3<f64> {
    let distance = left.norm();
    let speed = most.min((acceleration * distance).sqrt()).min(RATE_HZ * distance);
    let wanted = if distance > 0.0 { left * (speed / distance) } else { Vector3::zeros() };
    let change = wanted - last;
    let (length, step) = (change.norm(), acceleration * period_s);
    if length > step { last + change * (step / length) } else { wanted }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.005;

    fn reference() -> HandReference {
        let pose = Pose::new(Vector3::new(-0.3, 0.2, 1.0), UnitQuaternion::from_euler_angles(0.3, -0.4, 0.2));
        HandReference { pose, twist: Twist::zero(), wrench: Wrench::zero() }
    }

    fn goal(x: f64, yaw: f64, draw_m: f64) -> Goal {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
        let frame = Pose::new(Vector3::new(x, 0.0, 1.0), rotation);
        Goal { frame, draw_m, speed_m_s: 0.06, speed_share: 1.0 }
    }

    #[test]
    fn it_arrives_at_rest_and_no_reference_jumps_on_the_way() {
        let X_WA = Pose::new(Vector3::new(0.0, 0.0, 1.0), UnitQuaternion::identity());
        let mut references = [reference()];
        let mut rig = Rig::at(&X_WA, &references);
        let goal = goal(-0.5, 0.3, 0.05);
        let mut last = references[0];
        for tick in 0..6000 {
            rig.advance(&goal, PERIOD_S).expect("a pose");
            rig.refer(&mut references);
            let step = last.pose.displacement_to(&references[0].pose);
            // Walking, turning on a lever of half a metre, and a palm that is drawn back.
            assert!(step.linear.norm() < (0.06 + 0.06 * 0.5 + 0.03) * PERIOD_S, "{tick}: {step:?}");
            let change = (references[0].twist - last.twist).linear.norm();
            assert!(change < 2.5 * (ACCELERATION_M_S2 + DRAW_M_S2) * PERIOD_S, "{tick}: {change}");
            // What it says of its velocity is what it does.
            let said = references[0].twist.linear * PERIOD_S;
            assert!((said - step.linear).norm() < 2e-5, "{tick}: {said:?} {step:?}");
            last = references[0];
        }
        assert!(rig.has_arrived(&goal) && rig.has_drawn(&goal), "{rig:?}");
        assert!(last.twist.linear.norm() < 1e-4);
        let home = Goal { frame: X_WA, draw_m: 0.0, ..goal };
        assert!(!rig.has_arrived(&home) && !rig.has_drawn(&home));
        for _ in 0..6000 {
            rig.advance(&home, PERIOD_S).expect("a pose");
        }
        rig.refer(&mut references);
        let off = reference().pose.displacement_to(&references[0].pose);
        assert!(off.linear.norm() < 1e-4, "{off:?}");
    }

    #[test]
    fn it_slows_down_for_feet_and_what_rests_stays() {
        let X_WA = Pose::new(Vector3::zeros(), UnitQuaternion::identity());
        let mut rig = Rig::at(&X_WA, &[reference()]);
        let goal = Goal { speed_share: 0.0, ..goal(-0.5, 0.0, 0.0) };
        for _ in 0..100 {
            rig.advance(&goal, PERIOD_S).expect("a pose");
        }
        assert_eq!(rig.frame, X_WA.to_array());
        let free = Goal { speed_share: 1.0, ..goal };
        for _ in 0..100 {
            rig.advance(&free, PERIOD_S).expect("a pose");
        }
        let fast = rig;
        rig.rest();
        assert!(fast.twist != rig.twist && fast.frame == rig.frame);
    }
}
