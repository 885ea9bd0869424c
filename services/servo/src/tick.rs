//! One robot's tick, in two halves: `sense` says where it is, `act` says where it goes. No allocation,
//! no clock, no I/O, no panic path.

use crate::coast::Course;
use crate::credible;
use crate::fallback::{Fallback, FallbackState};
use crate::legs::{Felt, HandReference, Legs, LegsState};
use crate::robot::{BuildRobotError, Robot};
use mikoshi_config::RunSpec;
use mikoshi_humanoid::balance::{ExternalLoad, PerFoot, Side};
use mikoshi_humanoid::estimate::{
    BaseEstimate, BaseEstimatorState, Readings, SupportPolygon, zero_moment_point,
};
use mikoshi_humanoid::gait::{StepClock, StepWish};
use mikoshi_humanoid::statics::Burden;
use mikoshi_humanoid::{IkReport, IkScratch, IkState, IkTargets, Kinematics};
use mikoshi_ipc_types::{
    JointCommand, MAX_HANDS, MAX_JOINTS, PoseWire, RobotState, Sensors, TeamCommand, all_hands, flag, mode,
};
use mikoshi_spatial::{Hand, Pose, Sensor, Twist, World, Wrench};
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Share of its weight below which a robot has no zero moment point to speak of.
const LEAST_GROUND_FORCE: f64 = 0.1;
/// Share of its limit at which a drive gives all it has, averaged over a tick.
const FULL_TORQUE: f64 = 0.999;
/// Ticks after which a robot weighs anew what it bears: loads come and go slowly.
const BURDEN_TICKS: u64 = 16;
/// How long a drive is at its limit until the robot would have the object stand.
const EASE_LOST_S: f64 = 0.5;
/// How long nothing is at its limit until all of that is forgotten.
const EASE_GAINED_S: f64 = 15.0;
/// Slower than this part of its speed no object need go for a drive's sake: it would not spare it anything.
const LEAST_EASE: f64 = 0.4;
/// A hand that misses its reference by more is reported as behind.
const HAND_TOLERANCE_M: f64 = 0.005;

/// One robot's controller. Immutable.
#[derive(Clone, Debug)]
pub struct Servo {
    pub(crate) robot: Robot,
    pub(crate) legs: Legs,
    pub(crate) fallback: Fallback,
    period_s: f64,
    initial: ServoState,
}

/// Of [`ServoState`]'s layout: another one gets another number, so that no servo goes on from a state that it
/// would misread.
pub(crate) const STATE_VERSION: u64 = 12;

/// All that matters between ticks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ServoState {
    pub(crate) ik: IkState,
    pub(crate) base: BaseEstimatorState,
    pub(crate) legs: LegsState,
    /// What the robot feels; nothing while its sensors can't be believed.
    pub(crate) felt: Option<Felt>,
    pub(crate) hand_pose_commanded: [PoseWire; MAX_HANDS],
    pub(crate) hand_error_max_m: f64,
    pub(crate) joint_margin_rad: f64,
    pub(crate) flags: u64,
    /// Of the last command: bit h for grasping hand h.
    pub(crate) closed_hands: u64,
    pub(crate) fallback: FallbackState,
    pub(crate) burden: Burden,
    /// Part of the object's speed that drives leave, 0 to 1: less where they are at their limits while the robot walks.
    pub(crate) ease: f64,
}

/// Workspaces: filled with NaN between ticks they change nothing.
#[derive(Clone, Debug)]
pub struct ServoScratch {
    pub(crate) measured: Kinematics,
    ik: IkScratch,
}

/// Why half a tick could not be computed. The state is as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.text())]
#[allow(missing_docs)]
pub enum ServoError {
    HandReference,
    StepClock,
    InverseKinematics,
    Upside,
}

impl ServoError {
    /// In words that a tick can pass on: without allocation.
    pub fn text(self) -> &'static str {
        match self {
            Self::HandReference => "a hand reference is not a pose",
            Self::StepClock => "the team's step clock is none",
            Self::Upside => "the robot does not stand upright",
            Self::InverseKinematics => "the inverse kinematics rejects its inputs",
        }
    }
}

impl Servo {
    /// For robot `index` of this run.
    ///
    /// # Errors
    /// The robot's description can't be used.
    pub fn new(run: &RunSpec, index: usize) -> Result<Self, BuildRobotError> {
        let spec = &run.robots[index];
        let robot = Robot::new(spec, run.scenario.control_period_s)?;
        let mut kinematics = robot.kinematics();
        let X_WB = Pose::from_array(&spec.initial_base_pose).unwrap_or_else(Pose::identity);
        kinematics.update(&robot.model, &X_WB, &spec.initial_posture_rad);
        let mut hand_pose_commanded = [Pose::<World, Hand>::identity().to_array(); MAX_HANDS];
        for (array, &palm) in hand_pose_commanded.iter_mut().zip(&robot.palms) {
            *array = kinematics.frame_pose::<Hand>(&robot.model, palm).to_array();
        }
        let (legs, legs_state) = Legs::new(run, index, &robot, &kinematics, &X_WB)?;
        let fallback = Fallback::new(&run.scenario, &robot, &legs)?;
        let ik = IkState::at_rest(&spec.initial_posture_rad);
        let initial = ServoState {
            fallback: fallback.none(&legs, &legs_state, &ik),
            ik,
            base: robot.base_estimator.start(&robot.model, &X_WB, &spec.initial_posture_rad),
            legs: legs_state,
            felt: Some(Felt {
                com: kinematics.com().xy(),
                com_velocity: Vector2::zeros(),
                base: X_WB,
                soles: PerFoot::from_fn(|side| kinematics.frame_pose(&robot.model, robot.soles[side])),
                ground_wrench: PerFoot { right: Wrench::zero(), left: Wrench::zero() },
                load: ExternalLoad::NONE,
            }),
            hand_pose_commanded,
            hand_error_max_m: 0.0,
            joint_margin_rad: mikoshi_humanoid::ik::joint_margin(&robot.model, &spec.initial_posture_rad),
            flags: 0,
            ease: 1.0,
            burden: robot.burden(&kinematics, 0.0, None),
            closed_hands: match run.scenario.begins_closed(&spec.member.name) {
                true => all_hands(robot.palms.len()),
                false => 0,
            },
        };
        Ok(Self { robot, legs, fallback, period_s: run.scenario.control_period_s, initial })
    }

    /// The state at tick 0.
    pub fn initial_state(&self) -> ServoState {
        self.initial
    }

    /// Joints of its robot.
    pub fn joint_count(&self) -> usize {
        self.robot.model.joint_count()
    }

    /// Whether these readings may be its robot's.
    pub(crate) fn believes(&self, sensors: &Sensors) -> bool {
        credible::are_credible(sensors, &self.robot.model)
    }

    /// Whether its robot in this state may be asked for this after `last`.
    pub(crate) fn accepts(
        &self,
        command: &TeamCommand,
        last: Option<&TeamCommand>,
        robot: &RobotState,
    ) -> bool {
        let is_clock = StepClock::from_words(command.step_clock).is_some();
        is_clock && credible::is_credible(command, last, robot, self.robot.palms.len())
    }

    /// Leads a command on by a tick that nobody has commanded: a step is finished and no other begun, hands
    /// coast to rest.
    pub(crate) fn lead_on(&self, course: &mut Course, command: &mut TeamCommand) {
        course.lead_on(command, self.legs.timing(), self.period_s);
    }

    /// Takes note of a command that follows `last`, as far as one can go on by it.
    pub(crate) fn note_course(&self, course: &mut Course, last: Option<&TeamCommand>, command: &TeamCommand) {
        course.note(last, command, self.period_s);
    }

    /// Workspaces of its size.
    pub fn scratch(&self) -> ServoScratch {
        ServoScratch { measured: self.robot.kinematics(), ik: IkScratch::new(&self.robot.model) }
    }

    /// Where the robot is: base, hands, what the hands apply to the object, what the ground applies to it;
    /// and what it wishes of the team's step clock.
    pub fn sense(
        &self,
        state: &mut ServoState,
        scratch: &mut ServoScratch,
        sensors: &Sensors,
        out: &mut RobotState,
    ) {
        let kinematics = &mut scratch.measured;
        if state.felt.is_none() {
            // How fast the base is nobody has told meanwhile.
            state.base.imu_velocity = None;
        }
        let base = self.estimate_base(state, kinematics, sensors);
        let load = self.sense_hands(kinematics, sensors, out);
        state.felt = Some(self.sense_balance(&state.legs, kinematics, &base, load, sensors, out));
        out.base_pose = base.pose.to_array();
        out.holding_hands = sensors.holding_hands;

        let torques = self.robot.model.joints().iter().zip(&sensors.joint_torque_nm);
        let is_at_limit =
            torques.into_iter().any(|(joint, torque)| torque.abs() >= FULL_TORQUE * joint.effort);
        self.take_it_easy(state, is_at_limit);
        self.say_what_is_wished(state, out);
        out.flags |= set(flag::TORQUE_LIMIT, is_at_limit);
    }

    /// A tick in which the sensors can't be believed: `out` is what was said last, and stays where nothing
    /// better is known. The robot goes on as planned, without feedback.
    pub(crate) fn sense_nothing(&self, state: &mut ServoState, out: &mut RobotState) {
        state.felt = None;
        self.say_what_is_wished(state, out);
    }

    /// A robot that walks at the limits of its drives wants to go slower, and forgets it by and by.
    fn take_it_easy(&self, state: &mut ServoState, has_no_torque_left: bool) {
        let is_strained = has_no_torque_left || state.flags & flag::VELOCITY_LIMIT != 0;
        let walks = state.legs.gait.clock != StepClock::Standing;
        state.ease = match is_strained && walks {
            true => (state.ease - self.period_s / EASE_LOST_S).max(LEAST_EASE),
            false => (state.ease + self.period_s / EASE_GAINED_S).min(1.0),
        };
    }

    fn say_what_is_wished(&self, state: &ServoState, out: &mut RobotState) {
        let wish = self.legs.wish(&state.legs);
        let is_behind = state.flags & flag::HANDS_BEHIND != 0;
        out.flags = state.flags | wish_flags(&StepWish { ready: wish.ready && !is_behind, ..wish });
        out.step_urgency = wish.urgency;
        out.land_in_ticks = wish.land_in_ticks;
        out.speed_share = self.legs.speed_share(&state.legs) * state.ease;
        out.steps = state.legs.steps;
        out.hand_pose_commanded = state.hand_pose_commanded;
        out.joint_margin_min_rad = state.joint_margin_rad;
        out.hand_error_max_m = state.hand_error_max_m;
        out.bearable_n = state.burden.bearable_n;
        out.static_torque_share = state.burden.torque_share;
        out.bearing_moment_nm = state.burden.moment_nm.into();
    }

    fn estimate_base(
        &self,
        state: &mut ServoState,
        kinematics: &mut Kinematics,
        sensors: &Sensors,
    ) -> BaseEstimate {
        let joints = self.robot.model.joint_count().min(MAX_JOINTS);
        let (joint_position, _) = sensors.joint_position_rad.split_at(joints);
        let (joint_velocity, _) = sensors.joint_velocity_rad_s.split_at(joints);
        let readings = Readings {
            joint_position,
            joint_velocity,
            angular_velocity: Vector3::from(sensors.imu_angular_velocity_rad_s),
            specific_force: Vector3::from(sensors.imu_specific_force_m_s2),
        };
        let feet = self.legs.contacts(&state.legs);
        self.robot.base_estimator.update(&self.robot.model, &mut state.base, kinematics, &readings, &feet)
    }

    /// Hands and what they apply to the object; what that does to the balance.
    fn sense_hands(&self, kinematics: &Kinematics, sensors: &Sensors, out: &mut RobotState) -> ExternalLoad {
        let (robot, model) = (&self.robot, &self.robot.model);
        for (hand, (&palm, sensor)) in robot.palms.iter().zip(&robot.wrist_sensors).enumerate() {
            let X_WH: Pose<World, Hand> = kinematics.frame_pose(model, palm);
            let reading = Wrench::<Sensor>::from_array(&sensors.wrist_wrench[hand]);
            let on_object = sensor.applied_wrench(model, kinematics, &reading, None, &X_WH.translation);
            out.hand_pose[hand] = X_WH.to_array();
            out.hand_wrench[hand] = on_object.to_array();
        }
        let hands = out.hand_pose.iter().zip(&out.hand_wrench).take(robot.palms.len());
        let points = hands.map(|(pose, wrench)| {
            (Vector3::new(pose[0], pose[1], pose[2]), Wrench::<World>::from_array(wrench))
        });
        ExternalLoad::of_hands(&self.legs.pendulum, 0.0, points)
    }

    /// Centre of mass, zero moment point and capture point, and how far they are from the edge.
    fn sense_balance(
        &self,
        legs: &LegsState,
        kinematics: &Kinematics,
        base: &BaseEstimate,
        load: ExternalLoad,
        sensors: &Sensors,
        out: &mut RobotState,
    ) -> Felt {
        let (robot, model) = (&self.robot, &self.robot.model);
        let (joint_velocity, _) = sensors.joint_velocity_rad_s.split_at(model.joint_count().min(MAX_JOINTS));
        let com = kinematics.com();
        let com_velocity = kinematics.com_velocity(model, &base.twist, joint_velocity).xy();
        let capture_point = self.legs.pendulum.divergent_component(&com.xy(), &com_velocity);

        let contacts = self.legs.contacts(legs);
        let mut ground_wrench = PerFoot { right: Wrench::zero(), left: Wrench::zero() };
        let mut on_robot = Wrench::<World>::zero();
        for (side, reading) in Side::BOTH.into_iter().zip(&sensors.ankle_wrench) {
            let reading = Wrench::<Sensor>::from_array(reading);
            let at = contacts[side].pose.translation;
            let on_ground = robot.ankle_sensors[side].applied_wrench(model, kinematics, &reading, None, &at);
            ground_wrench[side] = -on_ground;
            on_robot += ground_wrench[side].shifted(&at);
        }
        let least_force_n = LEAST_GROUND_FORCE * self.legs.pendulum.weight_n();
        // Without a grip on the ground the margin is that of the capture point alone.
        let zmp = zero_moment_point(&on_robot, 0.0, least_force_n).unwrap_or(capture_point);
        // A foot that has not found its ground may bear all the same.
        let planned = self.legs.standing(legs);
        let soles = PerFoot::from_fn(|side| kinematics.frame_pose(model, robot.soles[side]));
        let standing = PerFoot::from_fn(|side| {
            let bears = ground_wrench[side].force.z > least_force_n;
            planned[side].or(bears.then_some(soles[side]))
        });
        let support = SupportPolygon::of_feet(&robot.sole_rectangles, &standing);

        out.com_position_m = com.into();
        out.zmp_position_m = zmp.into();
        out.zmp_margin_m = support.signed_distance(&zmp);
        out.capture_point_margin_m = support.signed_distance(&capture_point);
        Felt { com: com.xy(), com_velocity, base: base.pose, soles, ground_wrench, load }
    }

    /// Where the robot goes.
    pub fn act(
        &self,
        state: &mut ServoState,
        scratch: &mut ServoScratch,
        command: Option<&TeamCommand>,
        out: &mut JointCommand,
    ) -> Result<(), ServoError> {
        if let Some(command) = command.filter(|command| command.team_mode != mode::HOLD) {
            // The state changes only when nothing can fail any more.
            let (mut legs, mut ik) = (state.legs, state.ik);
            let hands = self.hand_references(command)?;
            let hands = hands.get(..self.robot.palms.len()).unwrap_or(&hands);
            let targets = self.targets(&mut legs, state.felt.as_ref(), command, hands)?;
            let report = self
                .robot
                .ik
                .solve(&self.robot.model, &mut ik, &mut scratch.ik, &targets)
                .map_err(|_| ServoError::InverseKinematics)?;
            (state.legs, state.ik) = (legs, ik);
            if command.state_tick.is_multiple_of(BURDEN_TICKS) {
                self.weigh(state, &scratch.ik.kinematics, targets.stance);
            }
            self.remember(state, &report);
            self.fallback.begin(&mut state.fallback, (&self.legs, &state.legs), &state.ik, hands);
            self.fallback.go_on(&mut state.fallback, &self.legs, &self.robot, &mut scratch.ik, out);
        }
        out.joint_position_ref_rad = state.ik.joint_position;
        out.joint_velocity_ref_rad_s = state.ik.joint_velocity;
        state.closed_hands = command.map_or(state.closed_hands, |command| command.closed_hands);
        out.closed_hands = state.closed_hands;
        Ok(())
    }

    /// What the robot bears as it is commanded to stand, by what its hands feel.
    fn weigh(&self, state: &mut ServoState, kinematics: &Kinematics, stance: Side) {
        if let Some(felt) = &state.felt {
            let lifted_n = (felt.load.kappa - 1.0).max(0.0) * self.legs.pendulum.weight_n();
            state.burden = self.robot.burden(kinematics, lifted_n, Some(stance));
        }
    }

    fn hand_references(&self, command: &TeamCommand) -> Result<[HandReference; MAX_HANDS], ServoError> {
        let mut references = [HandReference::default(); MAX_HANDS];
        let motions = command.hand_twist_ref.iter().zip(&command.hand_wrench_ref);
        let asked = references.iter_mut().zip(&command.hand_pose_ref).zip(motions);
        for ((reference, pose), (twist, wrench)) in asked.take(self.robot.palms.len()) {
            let pose = Pose::<World, Hand>::from_array(pose).ok_or(ServoError::HandReference)?;
            let (twist, wrench) = (Twist::from_array(twist), Wrench::from_array(wrench));
            *reference = HandReference { pose, twist, wrench };
        }
        Ok(references)
    }

    fn targets(
        &self,
        legs: &mut LegsState,
        felt: Option<&Felt>,
        command: &TeamCommand,
        references: &[HandReference],
    ) -> Result<IkTargets, ServoError> {
        let clock = StepClock::from_words(command.step_clock).ok_or(ServoError::StepClock)?;
        let mut hands = [None; MAX_HANDS];
        for (target, reference) in hands.iter_mut().zip(references) {
            *target = Some(reference.pose);
        }
        // Open hands carry nothing, and the feet need not follow them.
        let is_stopped_holding = command.team_mode == mode::SAFE_STOP && command.closed_hands != 0;
        let holds = mode::is_hybrid(command.team_mode) || is_stopped_holding;
        let grasping = if holds { references } else { Default::default() };
        let legs = self.legs.act(legs, clock, grasping, felt);
        Ok(IkTargets {
            stance: legs.stance,
            feet: legs.feet,
            com: legs.com,
            waist_attitude: legs.waist_attitude,
            hands,
        })
    }

    fn remember(&self, state: &mut ServoState, report: &IkReport) {
        for (array, pose) in state.hand_pose_commanded.iter_mut().zip(&report.hand_poses) {
            *array = pose.to_array();
        }
        state.legs.base_commanded = report.base_pose;
        state.hand_error_max_m = report.hand_error_m.iter().copied().fold(0.0, f64::max);
        state.joint_margin_rad = report.joint_margin;
        state.flags = set(flag::JOINT_LIMIT, report.at_position_limit != 0)
            | set(flag::VELOCITY_LIMIT, report.at_velocity_limit != 0)
            | set(flag::HANDS_BEHIND, state.hand_error_max_m > HAND_TOLERANCE_M);
    }
}

/// What the robot wishes, as its frame carries it.
fn wish_flags(wish: &StepWish) -> u64 {
    set(flag::WANTS_STEP, wish.wants_step)
        | set(flag::CAN_STOP, wish.can_stop)
        | set(flag::READY_TO_STEP, wish.ready)
        | set(flag::LEFT_FIRST, wish.first_swing == Side::Left)
}

fn set(bit: u64, is_set: bool) -> u64 {
    if is_set { bit } else { 0 }
}

impl ServoScratch {
    /// Overwrites every number with NaN.
    pub fn poison(&mut self) {
        self.measured.fill_with_nan();
        self.ik.fill_with_nan();
    }
}
