//! What the legs do in a tick: gait and stabiliser of one robot, and which feet it may trust.

use crate::robot::{BuildRobotError, Robot};
use mikoshi_config::RunSpec;
use mikoshi_config::robot::RobotConfig;
use mikoshi_humanoid::Kinematics;
use mikoshi_humanoid::balance::{
    ExternalLoad, GroundTilt, Pendulum, PerFoot, Side, Stabiliser, StabiliserConfig, StabiliserInputs,
    StabiliserState,
};
use mikoshi_humanoid::estimate::{FootContact, Pivoting};
use mikoshi_humanoid::gait::{
    FootPlacement, Foothold, Gait, GaitConfig, GaitInputs, GaitPhase, GaitReference, GaitState, GroundPose,
    HandCentre, PreviewConfig, SoleCorrection, SoleTracking, StepClock, StepTiming, StepWish, SwingConfig,
    heading, wrap,
};
use mikoshi_ipc_types::MAX_HANDS;
use mikoshi_spatial::{Base, Foot, Hand, Pose, Twist, World, Wrench};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// A foot that feels nothing stands on the ground when it is meant to be so low.
const PLANNED_CONTACT_M: f64 = 0.002;

/// In which a sole comes level again that is in the air.
const LEVEL_S: f64 = 0.1;

/// Gait and stabiliser of one robot. Immutable.
#[derive(Clone, Debug)]
pub(crate) struct Legs {
    pub gait: Gait,
    /// Absent where the scenario turns it off.
    stabiliser: Option<Stabiliser>,
    pub sole_tracking: SoleTracking,
    ground_tilt: GroundTilt,
    /// The robot as an inverted pendulum.
    pub pendulum: Pendulum,
    pub period_s: f64,
    /// Attitude of the waist over feet with heading 0.
    waist_over_feet: UnitQuaternion<f64>,
}

/// All of it that matters between ticks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LegsState {
    pub gait: GaitState,
    stabiliser: StabiliserState,
    pub sole_correction: SoleCorrection,
    /// How the ground is tilted on which each foot stands, as a rotation vector \[rad, world\].
    pub ground_tilt: PerFoot<Vector3<f64>>,
    /// How much of the base's estimate rests on each foot, 0 to 1.
    trust: PerFoot<f64>,
    /// How far each foot has turned on the ground.
    pivoting: PerFoot<Pivoting>,
    /// Base as the last tick's command has it.
    pub base_commanded: Pose<World, Base>,
    /// Of the hands' references in the last command.
    pub hand_centre: Option<HandCentre>,
    /// Steps taken.
    pub steps: u64,
}

/// What a robot feels in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Felt {
    /// Centre of mass \[m, world\].
    pub com: Vector2<f64>,
    /// Its velocity \[m/s\].
    pub com_velocity: Vector2<f64>,
    /// Base.
    pub base: Pose<World, Base>,
    /// Soles, by encoders.
    pub soles: PerFoot<Pose<World, Foot>>,
    /// Wrench of the ground on each foot, at the foot's origin.
    pub ground_wrench: PerFoot<Wrench<World>>,
    /// What the hands carry.
    pub load: ExternalLoad,
}

/// What the team asks of a hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HandReference {
    pub pose: Pose<World, Hand>,
    pub twist: Twist<World>,
    /// That the hand is expected to apply to the object, at its origin.
    pub wrench: Wrench<World>,
}

impl Default for HandReference {
    fn default() -> Self {
        Self { pose: Pose::identity(), twist: Twist::zero(), wrench: Wrench::zero() }
    }
}

/// What the legs ask of the inverse kinematics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LegTargets {
    /// The foot that is the base.
    pub stance: Side,
    /// Soles.
    pub feet: PerFoot<Pose<World, Foot>>,
    /// Centre of mass \[m\].
    pub com: Vector3<f64>,
    /// Attitude of the waist.
    pub waist_attitude: UnitQuaternion<f64>,
}

impl Legs {
    /// How long the parts of a step last.
    pub(crate) fn timing(&self) -> &StepTiming {
        &self.gait.config().timing
    }

    /// Of robot `index` of this run, which stands as `kinematics` says with its base at `X_WB`; and their state at tick 0.
    pub(crate) fn new(
        run: &RunSpec,
        index: usize,
        robot: &Robot,
        kinematics: &Kinematics,
        X_WB: &Pose<World, Base>,
    ) -> Result<(Self, LegsState), BuildRobotError> {
        let scenario = &run.scenario;
        let period_s = scenario.control_period_s;
        let soles = robot.soles;
        let feet = PerFoot::from_fn(|side| kinematics.frame_pose::<Foot>(&robot.model, soles[side]));
        let com = kinematics.com();
        let com_height_m = com.z - (feet.right.translation.z + feet.left.translation.z) / 2.0;
        let pendulum = Pendulum { mass_kg: robot.model.total_mass_kg(), com_height_m };
        let standard = GaitConfig::standard(robot.sole_rectangles);
        let config = GaitConfig {
            timing: StepTiming::standard(period_s).with_supports(
                period_s,
                scenario.gait.double_support_s,
                scenario.gait.single_support_s,
            ),
            swing: SwingConfig { lift_m: scenario.gait.lift_m, ..SwingConfig::default() },
            preview: PreviewConfig { control_period_s: period_s, com_height_m, ..PreviewConfig::default() },
            adjusts_steps: scenario.balance.adjusts_steps,
            mirrored: scenario.gait.mirror_opposed && faces_back(run, index),
            ..standard
        };
        let stabiliser =
            StabiliserConfig::standard(period_s, pendulum, robot.sole_rectangles, config.zmp_in_foot)
                .for_leg_drives(strongest_leg_damping(&run.robots[index].config, robot));
        let gait = Gait::new(config)?;
        let on_ground = PerFoot::from_fn(|side| GroundPose::of(&feet[side]));
        let waist: Pose<World, Base> = kinematics.frame_pose(&robot.model, robot.waist);
        let state = LegsState {
            gait: gait.standing(on_ground, com.xy()),
            stabiliser: StabiliserState::default(),
            sole_correction: PerFoot { right: Twist::zero(), left: Twist::zero() },
            ground_tilt: PerFoot { right: Vector3::zeros(), left: Vector3::zeros() },
            trust: PerFoot { right: 1.0, left: 1.0 },
            pivoting: PerFoot { right: Pivoting::default(), left: Pivoting::default() },
            base_commanded: *X_WB,
            hand_centre: None,
            steps: 0,
        };
        let legs = Self {
            gait,
            stabiliser: scenario.balance.stabiliser.then(|| Stabiliser::new(stabiliser)),
            sole_tracking: SoleTracking::default(),
            ground_tilt: GroundTilt::standard(robot.sole_rectangles, pendulum.weight_n()),
            pendulum,
            period_s,
            waist_over_feet: yawed(-mean_yaw(&on_ground)) * waist.rotation,
        };
        Ok((legs, state))
    }

    /// Of a robot that was found to stand on these feet, after what was known in `before`: how its feet belong under its
    /// hands it still knows.
    pub(crate) fn stand_anew(
        &self,
        before: &LegsState,
        feet: &PerFoot<Pose<World, Foot>>,
        com: Vector2<f64>,
        X_WB: &Pose<World, Base>,
    ) -> LegsState {
        let mut gait = self.gait.standing(PerFoot::from_fn(|side| GroundPose::of(&feet[side])), com);
        gait.placement = before.gait.placement;
        let tolerance_m = self.gait.config().swing.plane_tolerance_m;
        for side in Side::BOTH {
            let foot = Foothold { height: feet[side].translation.z, ..gait.feet[side] };
            gait.feet[side] = foot.on_plane_within(gait.ground.plane_m, tolerance_m);
        }
        LegsState {
            gait,
            stabiliser: StabiliserState::default(),
            sole_correction: PerFoot { right: Twist::zero(), left: Twist::zero() },
            ground_tilt: PerFoot { right: Vector3::zeros(), left: Vector3::zeros() },
            trust: PerFoot { right: 1.0, left: 1.0 },
            pivoting: PerFoot { right: Pivoting::default(), left: Pivoting::default() },
            base_commanded: *X_WB,
            hand_centre: None,
            steps: before.steps,
        }
    }

    /// Which feet say where the base is: those that stand, by the phase of the gait and not by force,
    /// since at touch-down a foot bears before it has come to rest; and gradually, so that feet which
    /// disagree don't make the base jump.
    pub(crate) fn contacts(&self, state: &LegsState) -> PerFoot<FootContact> {
        PerFoot::from_fn(|side| FootContact {
            pose: state.pivoting[side].turn(state.gait.feet[side]).in_world(),
            weight: state.trust[side],
        })
    }

    /// Where each foot stands; `None` in the air.
    pub(crate) fn standing(&self, state: &LegsState) -> PerFoot<Option<Pose<World, Foot>>> {
        let reference = self.gait.reference(&state.gait);
        PerFoot::from_fn(|side| {
            let foot = &reference.feet[side];
            foot.in_contact.then_some(foot.pose)
        })
    }

    /// What the robot tells the team about its feet.
    pub(crate) fn wish(&self, state: &LegsState) -> StepWish {
        self.gait.wish(&state.gait, state.hand_centre.as_ref())
    }

    /// How much of its speed the object may keep.
    pub(crate) fn speed_share(&self, state: &LegsState) -> f64 {
        self.gait.speed_share(&state.gait, state.hand_centre.as_ref())
    }

    /// One tick: the feet follow the team's clock and the references of the hands that carry, the centre of
    /// mass the feet, and the soles what is felt. A robot that feels nothing any more moves as planned.
    pub(crate) fn act(
        &self,
        state: &mut LegsState,
        clock: StepClock,
        hands: &[HandReference],
        felt: Option<&Felt>,
    ) -> LegTargets {
        self.place_feet(state, hands);
        // The centre of mass is planned for what the hands will carry. What they feel beside it is for the
        // stabiliser: internal forces come and go, and a plan that followed them would stir them up.
        let expected = hands.iter().map(|hand| (hand.pose.translation, hand.wrench));
        let load = ExternalLoad::of_hands(&self.pendulum, 0.0, expected);
        let now = self.gait.reference(&state.gait);
        let stabilisation = self.stabiliser.as_ref().map(|stabiliser| {
            let inputs =
                felt.map_or_else(|| stabiliser_inputs_as_planned(&now), |felt| stabiliser_inputs(&now, felt));
            let inputs = StabiliserInputs { rests: rests(state), ..inputs };
            stabiliser.act(&mut state.stabiliser, &inputs)
        });
        let was_swinging = is_swinging(&state.gait);
        let next = self.gait.act(
            &mut state.gait,
            &GaitInputs {
                clock,
                hand_centre: state.hand_centre,
                foot_force: PerFoot::from_fn(|side| match felt {
                    Some(felt) => felt.ground_wrench[side].force.z,
                    None => self.foot_force_as_planned(&now.feet[side].pose),
                }),
                soles: felt.map(|felt| PerFoot::from_fn(|side| GroundPose::of(&felt.soles[side]))),
                sole_heights: felt.map(|felt| PerFoot::from_fn(|side| felt.soles[side].translation.z)),
                load,
                divergent_component: felt
                    .map(|felt| self.pendulum.divergent_component(&felt.com, &felt.com_velocity)),
                soles_turn: PerFoot::from_fn(|side| {
                    let turns = |stabiliser: &Stabiliser| stabiliser.turns(&state.stabiliser, side);
                    self.stabiliser.as_ref().is_some_and(turns)
                }),
            },
        );
        state.steps += u64::from(is_swinging(&state.gait) && !was_swinging);
        self.shift_trust(state);
        if let Some(felt) = felt {
            self.follow_pivots(state, felt);
        }
        self.correct_soles(state, &now, &next, felt);

        self.follow_ground(state, &next, felt);

        let soles = PerFoot::from_fn(|side| {
            let tilt = Twist::new(Vector3::zeros(), state.ground_tilt[side]);
            next.feet[side].pose.displaced(&(state.sole_correction[side] + tilt))
        });
        let feet = PerFoot::from_fn(|side| {
            stabilisation.map_or(soles[side], |stabilisation| stabilisation.apply(side, &soles[side]))
        });
        let com_offset = stabilisation.map_or_else(Vector2::zeros, |stabilisation| stabilisation.com_offset);
        self.targets(&next, &soles, &feet, com_offset)
    }

    /// Of a reference, with soles as they are commanded and, beside that, stabilised; the waist looks where soles
    /// do and not where footholds are, which move when a foot lands: it would jerk.
    pub(crate) fn targets(
        &self,
        reference: &GaitReference,
        soles: &PerFoot<Pose<World, Foot>>,
        stabilised: &PerFoot<Pose<World, Foot>>,
        com_offset: Vector2<f64>,
    ) -> LegTargets {
        let on_ground = PerFoot::from_fn(|side| GroundPose::of(&soles[side]));
        LegTargets {
            stance: reference.stance,
            feet: *stabilised,
            com: reference.com + com_offset.push(0.0),
            waist_attitude: yawed(mean_yaw(&on_ground)) * self.waist_over_feet,
        }
    }

    /// Where the feet belong under the hands is recorded when the hands begin to carry, and forgotten when
    /// they don't any more.
    fn place_feet(&self, state: &mut LegsState, hands: &[HandReference]) {
        let mut poses = [Pose::identity(); MAX_HANDS];
        let mut motions = [(Pose::identity(), Twist::zero()); MAX_HANDS];
        for ((pose, motion), hand) in poses.iter_mut().zip(&mut motions).zip(hands) {
            *pose = hand.pose;
            *motion = (hand.pose, hand.twist);
        }
        if hands.is_empty() {
            state.gait.placement = None;
        } else if state.gait.placement.is_none() {
            let feet = PerFoot::from_fn(|side| state.gait.feet[side].pose);
            let grasping = poses.get(..hands.len()).unwrap_or(&poses);
            state.gait.placement = FootPlacement::record(grasping, &feet);
        }
        let moving = motions.get(..hands.len()).unwrap_or(&motions);
        state.hand_centre = state.gait.placement.and_then(|placement| placement.centre(moving));
    }

    /// What has sagged is lifted, and what has come to stand loses its correction; a foothold that is moved
    /// to where the foot is or belongs gains one, so that the sole stays where it is.
    fn correct_soles(
        &self,
        state: &mut LegsState,
        now: &GaitReference,
        next: &GaitReference,
        felt: Option<&Felt>,
    ) {
        for side in Side::BOTH {
            let (was, is) = (&now.feet[side], &next.feet[side]);
            let correction = &mut state.sole_correction[side];
            match felt {
                Some(felt) if !is.in_contact => {
                    let foot = was.pose.translation;
                    let (measured, commanded) = (&felt.base, &state.base_commanded);
                    self.sole_tracking.follow(correction, &foot, measured, commanded, self.period_s);
                }
                None if !is.in_contact => self.sole_tracking.fade(correction, self.period_s),
                _ => {
                    *correction += is.pose.displacement_to(&was.pose);
                    self.sole_tracking.fade(correction, self.period_s);
                }
            }
        }
    }

    /// Soles are tilted as the ground is on which they stand; in the air they come level again.
    fn follow_ground(&self, state: &mut LegsState, next: &GaitReference, felt: Option<&Felt>) {
        // Without a stabiliser soles stay where they are planned. What a robot stands on it knows: soles that went on to
        // learn would hunt each other.
        if self.stabiliser.is_none() || matches!(state.gait.phase, GaitPhase::Standing { .. }) {
            return;
        }
        let lean = felt.map(|felt| self.ground_tilt.lean(&felt.base, &state.base_commanded));
        let trust = state.trust.right + state.trust.left;
        for side in Side::BOTH {
            let sole_tilt = state.stabiliser.sole_tilt[side];
            let tilt = &mut state.ground_tilt[side];
            if !next.feet[side].in_contact {
                *tilt *= 1.0 - (self.period_s / LEVEL_S).min(1.0);
            } else if let (Some(felt), Some(lean), true) = (felt, &lean, trust > 0.0) {
                let share = state.trust[side] / trust;
                let (sole, wrench) = (&felt.soles[side], &felt.ground_wrench[side]);
                let rectangle = &self.ground_tilt.soles[side];
                self.ground_tilt.follow(tilt, lean, rectangle, sole, wrench, (share, self.period_s));
                self.ground_tilt.learn(tilt, &sole_tilt, sole, self.period_s);
            }
        }
    }

    /// What a foot bears that is where this reference has it: the ground comes where the plane is.
    pub(crate) fn foot_force_as_planned(&self, foot: &Pose<World, Foot>) -> f64 {
        if foot.translation.z <= PLANNED_CONTACT_M { self.pendulum.weight_n() } else { 0.0 }
    }

    fn shift_trust(&self, state: &mut LegsState) {
        let stands = |side: Side| match state.gait.phase {
            GaitPhase::Standing { .. } => true,
            GaitPhase::Finishing { landing, .. } => landing.is_none_or(|foot| foot.side != side),
            _ => side == state.gait.stance,
        };
        let most = self.period_s / self.seconds_of_double_support();
        let is_up =
            PerFoot::from_fn(|side| state.gait.phase.swinging_foot().is_some_and(|foot| foot.side == side));
        for side in Side::BOTH {
            let target = if stands(side) { 1.0 } else { 0.0 };
            let trust = &mut state.trust[side];
            *trust = if is_up[side] { 0.0 } else { *trust + (target - *trust).clamp(-most, most) };
        }
    }

    /// What feet do that turn on the ground the estimate of the base knows, and nobody else: commands that followed them
    /// would have them turn on.
    fn follow_pivots(&self, state: &mut LegsState, felt: &Felt) {
        let stands = is_standing(&state.gait);
        for side in Side::BOTH {
            let pivoting = &mut state.pivoting[side];
            let is_up = state.gait.phase.swinging_foot().is_some_and(|foot| foot.side == side);
            *pivoting = if is_up {
                Pivoting::default()
            } else {
                let sole = heading(&felt.soles[side].rotation);
                pivoting.after(wrap(sole - state.gait.feet[side].pose.yaw), stands, self.period_s)
            };
        }
    }

    fn seconds_of_double_support(&self) -> f64 {
        self.gait.config().timing.double_support as f64 * self.period_s
    }
}

fn stabiliser_inputs(now: &GaitReference, felt: &Felt) -> StabiliserInputs {
    StabiliserInputs {
        com_ref: now.com.xy(),
        com_velocity_ref: now.com_velocity.xy(),
        com_acceleration_ref: now.com_acceleration.xy(),
        com: felt.com,
        com_velocity: felt.com_velocity,
        standing: PerFoot::from_fn(|side| now.feet[side].in_contact.then_some(now.feet[side].pose)),
        ground_wrench: felt.ground_wrench,
        load: felt.load,
        rests: false,
    }
}

/// The largest velocity gain of a drive between the root and a sole \[Nms/rad\].
fn strongest_leg_damping(config: &RobotConfig, robot: &Robot) -> f64 {
    let model = &robot.model;
    let legs = Side::BOTH.iter().fold(0, |set, &side| set | model.path(model.frame(robot.soles[side]).body));
    let joints = model.joints().iter().enumerate().filter(|(index, _)| legs >> index & 1 == 1);
    let drives = joints.filter_map(|(_, joint)| config.drive_of(&joint.name));
    drives.map(|drive| drive.kv_nms_rad).fold(0.0, f64::max)
}

/// As if all were as planned: what the stabiliser has done so far fades.
fn stabiliser_inputs_as_planned(now: &GaitReference) -> StabiliserInputs {
    StabiliserInputs {
        com_ref: now.com.xy(),
        com_velocity_ref: now.com_velocity.xy(),
        com_acceleration_ref: now.com_acceleration.xy(),
        com: now.com.xy(),
        com_velocity: now.com_velocity.xy(),
        standing: PerFoot { right: None, left: None },
        ground_wrench: PerFoot { right: Wrench::zero(), left: Wrench::zero() },
        load: ExternalLoad::NONE,
        rests: false,
    }
}

/// Whether a robot stands that has found its ground not to be level: soles that lie flat rattle on nothing.
fn rests(state: &LegsState) -> bool {
    let is_level = Side::BOTH.iter().all(|&side| state.ground_tilt[side] == Vector3::zeros());
    is_standing(&state.gait) && !is_level
}

fn is_standing(gait: &GaitState) -> bool {
    matches!(gait.phase, GaitPhase::Standing { .. })
}

fn is_swinging(gait: &GaitState) -> bool {
    matches!(gait.phase, GaitPhase::SingleSupport { .. })
}

/// Whether a robot looks against the first one.
fn faces_back(run: &RunSpec, index: usize) -> bool {
    let yaw = |index: usize| run.robots.get(index).map_or(0.0, |robot| robot.member.yaw_deg.to_radians());
    (yaw(index) - yaw(0)).cos() < -1e-9
}

fn mean_yaw(feet: &PerFoot<GroundPose>) -> f64 {
    feet.right.yaw + wrap(feet.left.yaw - feet.right.yaw) / 2.0
}

fn yawed(yaw: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw)
}
