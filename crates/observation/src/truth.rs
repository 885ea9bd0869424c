//! Where object and feet truly are, and what is truly in the object, seen through the frames that control
//! creates when it starts.

use crate::canonical::Observation;
use crate::figures::{ObservedRobot, ObservedRun};
use mikoshi_cooperation::VirtualStick;
use mikoshi_ipc_types::{RobotTruth, mode};
use mikoshi_spatial::{Hand, Object, Pose, World, Wrench};
use nalgebra::Vector2;

/// A sole is set down while it bears more than this share of the robot's weight.
const LOADED_SHARE: f64 = 0.05;

/// A sole this far over where it stood takes a step.
const LIFTED_M: f64 = 0.01;
/// Standard gravity, as the simulator has it.
const GRAVITY_M_S2: f64 = 9.81;

impl ObservedRobot {
    /// Its weight.
    pub fn weight_n(&self) -> f64 {
        self.mass_kg * GRAVITY_M_S2
    }
}

/// Whether a foot is set down.
pub fn is_loaded(truth: &RobotTruth, foot: usize, weight_n: f64) -> bool {
    truth.ground_wrench.get(foot).is_some_and(|wrench| wrench[2] > LOADED_SHARE * weight_n)
}

/// Follows a foot from where it is set down to where it is set down next. Ticks come in order.
#[derive(Clone, Copy, Debug, Default)]
pub struct FootTracker {
    /// Where it was set down, until it is lifted.
    touchdown: Option<Vector2<f64>>,
    /// Where it was set down before it was lifted.
    lifted_from: Option<Vector2<f64>>,
    standing_z: f64,
    slip_m: f64,
}

impl FootTracker {
    /// Takes in one tick; the length of the step if one has just ended.
    pub fn observe(&mut self, truth: &RobotTruth, foot: usize, weight_n: f64) -> Option<f64> {
        let [x, y, z, ..] = *truth.sole_pose.get(foot)?;
        let position = Vector2::new(x, y);
        if !is_loaded(truth, foot, weight_n) {
            if z > self.standing_z + LIFTED_M && self.lifted_from.is_none() {
                self.lifted_from = self.touchdown.take();
            }
            return None;
        }
        let Some(touchdown) = self.touchdown else {
            self.touchdown = Some(position);
            self.standing_z = z;
            return self.lifted_from.take().map(|from| (position - from).norm());
        };
        self.slip_m = self.slip_m.max((position - touchdown).norm());
        None
    }

    /// Whether it has been set down, and not been lifted since.
    pub fn is_down(&self) -> bool {
        self.touchdown.is_some()
    }

    /// Its largest horizontal displacement since it was set down.
    pub fn slip_m(&self) -> f64 {
        self.slip_m
    }
}

/// Follows the object through a run, by ground truth. Ticks come in order.
#[derive(Clone, Debug)]
pub struct ObjectTracker {
    /// Grasping hands of each robot.
    hands: Vec<usize>,
    /// Coefficients of each internal force: the rows of C.
    c: Vec<Vec<f64>>,
    /// Without a law to follow there is no Σa but the body's own frame.
    is_uncontrolled: bool,
    X_BodyA: Option<Pose<Object, Object>>,
    sticks: Vec<VirtualStick>,
    /// The hands that took no part in the last tick, as a set.
    absent: u64,
}

/// A row of C when some hands take no part any more, a set in hand order. Only rows of a tree lose hands: between what is
/// left of their two groups they are `|L||R|/(|L|+|R|) · (mean of L − mean of R)`, and zero where one is empty.
fn among_those_left(coefficients: &[f64], absent: u64) -> impl Iterator<Item = f64> {
    let is_left = move |hand: usize| absent >> hand & 1 == 0;
    let count = |is_of: fn(f64) -> bool| {
        coefficients.iter().enumerate().filter(|(hand, c)| is_left(*hand) && is_of(**c)).count() as f64
    };
    let (left, right) = (count(|c| c > 0.0), count(|c| c < 0.0));
    coefficients.iter().enumerate().map(move |(hand, &c)| match (absent, c) {
        (0, _) => c,
        _ if !is_left(hand) || c == 0.0 || left * right == 0.0 => 0.0,
        (_, 0.0..) => right / (left + right),
        _ => -left / (left + right),
    })
}

/// The object in one tick.
#[derive(Clone, Debug)]
pub struct TrackedObject {
    /// The object's body.
    pub X_WBody: Pose<World, Object>,
    /// Σa, fixed to the body where control had it when it started to follow a reference; before, the body's
    /// own frame. The paper lets it be anywhere on the object, and creates it with the virtual sticks.
    pub X_WA: Pose<World, Object>,
    /// What Σa is asked to follow, while it is.
    pub X_WA_ref: Option<Pose<World, Object>>,
    /// Generalized internal forces from the true, unfiltered wrenches, in the object's axes: eqs. 11, 28.
    pub internal: Vec<Wrench<Object>>,
}

impl ObjectTracker {
    /// Nothing observed yet.
    pub fn new(run: &ObservedRun) -> Self {
        Self {
            hands: run.robots.iter().map(|robot| robot.hands).collect(),
            c: run.internal_rows.iter().map(|(_, coefficients)| coefficients.clone()).collect(),
            is_uncontrolled: !run.is_controlled,
            X_BodyA: None,
            sticks: Vec::new(),
            absent: 0,
        }
    }

    /// Takes in one tick; none if the object's pose is no pose.
    pub fn observe(&mut self, observation: &Observation) -> Option<TrackedObject> {
        let X_WBody = Pose::<World, Object>::from_array(&observation.object_truth.payload.pose)?;
        let team_state = &observation.team_state.payload;
        let is_hybrid = mode::is_hybrid(team_state.team_mode);
        let X_WA_ref = Pose::<World, Object>::from_array(&team_state.object_pose_ref)
            .filter(|_| is_hybrid || self.is_uncontrolled);
        let X_WA = match X_WA_ref {
            Some(X_WA_ref) => X_WBody * *self.X_BodyA.get_or_insert_with(|| X_WBody.inverse() * X_WA_ref),
            None => X_WBody,
        };
        let internal = self.internal_forces(&X_WA, is_hybrid, observation);
        Some(TrackedObject { X_WBody, X_WA, X_WA_ref, internal })
    }

    /// Σa in the body of the object, once there is one.
    pub fn X_BodyA(&self) -> Option<&Pose<Object, Object>> {
        self.X_BodyA.as_ref()
    }

    fn internal_forces(
        &mut self,
        X_WA: &Pose<World, Object>,
        is_hybrid: bool,
        observation: &Observation,
    ) -> Vec<Wrench<Object>> {
        let tips = self.tip_wrenches(X_WA, is_hybrid, observation);
        let absent = observation.team_state.payload.absent_hands;
        let row = |coefficients: &Vec<f64>| {
            let left = among_those_left(coefficients, absent);
            let force_W = tips.iter().zip(left).fold(Wrench::zero(), |sum, (tip, c)| sum + *tip * c);
            force_W.expressed_in(&X_WA.inverse())
        };
        self.c.iter().map(row).collect()
    }

    /// True wrenches at the tips of the virtual sticks, in hand order (eq. A1). The sticks are those of the
    /// true hands when the law started; before, they lead to the object's frame as it is.
    fn tip_wrenches(
        &mut self,
        X_WA: &Pose<World, Object>,
        is_hybrid: bool,
        observation: &Observation,
    ) -> Vec<Wrench<World>> {
        let hands = self.hands.iter().zip(&observation.robot_truth).flat_map(|(hands, truth)| {
            truth.payload.hand_pose.iter().zip(&truth.payload.hand_wrench).take(*hands)
        });
        let hands = hands.map(|(pose, wrench)| {
            let X_WH = Pose::<World, Hand>::from_array(pose).unwrap_or_else(Pose::identity);
            (X_WH, Wrench::<World>::from_array(wrench))
        });
        let hands: Vec<_> = hands.collect();
        if is_hybrid && self.sticks.is_empty() {
            self.sticks = hands.iter().map(|(X_WH, _)| VirtualStick::at_grasp(X_WH, X_WA)).collect();
        }
        // Who has come holds where he is.
        let absent = observation.team_state.payload.absent_hands;
        let came = core::mem::replace(&mut self.absent, absent) & !absent;
        for (hand, (stick, (X_WH, _))) in self.sticks.iter_mut().zip(&hands).enumerate() {
            if came >> hand & 1 != 0 {
                *stick = VirtualStick::at_grasp(X_WH, X_WA);
            }
        }
        let stick = |hand: usize, X_WH: &Pose<World, Hand>| {
            self.sticks.get(hand).copied().unwrap_or_else(|| VirtualStick::at_grasp(X_WH, X_WA))
        };
        hands.iter().enumerate().map(|(i, (X_WH, wrench))| stick(i, X_WH).tip_wrench(X_WH, wrench)).collect()
    }
}
