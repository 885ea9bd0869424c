//! One robot's tick, in two halves: `sense` says where it is, `act` says where it goes. No allocation,
//! no clock, no I/O, no panic path.

use crate::robot::{BuildRobotError, Robot};
use mikoshi_config::RunSpec;
use mikoshi_humanoid::balance::{Pendulum, PerFoot, Side};
use mikoshi_humanoid::estimate::{
    BaseEstimate, BaseEstimatorState, FootContact, Readings, SupportPolygon, zero_moment_point,
};
use mikoshi_humanoid::{IkReport, IkScratch, IkState, IkTargets, Kinematics};
use mikoshi_ipc_types::{
    JointCommand, MAX_HANDS, MAX_JOINTS, PoseWire, RobotState, Sensors, TeamCommand, flag, mode,
};
use mikoshi_spatial::{Base, Foot, Hand, Pose, Sensor, World, Wrench};
use nalgebra::{UnitQuaternion, Vector3};

/// Share of its weight below which a robot has no zero moment point to speak of.
const LEAST_GROUND_FORCE: f64 = 0.1;
/// A hand that misses its reference by more is reported as behind.
const HAND_TOLERANCE_M: f64 = 0.005;

/// One robot's controller. Immutable.
#[derive(Clone, Debug)]
pub struct Servo {
    robot: Robot,
    initial: ServoState,
    stance: Stance,
}

/// Where the robot stands, and how.
#[derive(Clone, Copy, Debug)]
struct Stance {
    soles: PerFoot<Pose<World, Foot>>,
    com: Vector3<f64>,
    waist: UnitQuaternion<f64>,
}

/// All that matters between ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoState {
    ik: IkState,
    base: BaseEstimatorState,
    hand_pose_commanded: [PoseWire; MAX_HANDS],
    hand_error_max_m: f64,
    joint_margin_rad: f64,
    flags: u64,
}

/// Workspaces: filled with NaN between ticks they change nothing.
#[derive(Clone, Debug)]
pub struct ServoScratch {
    measured: Kinematics,
    ik: IkScratch,
}

/// Why half a tick could not be computed. The state is as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)]
pub enum ServoError {
    #[error("a hand reference is not a pose")]
    HandReference,
    #[error("the inverse kinematics rejects its inputs")]
    InverseKinematics,
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
        let waist = robot.ik.config().waist;
        let stance = Stance {
            soles: PerFoot::from_fn(|side| kinematics.frame_pose(&robot.model, robot.soles[side])),
            com: kinematics.com(),
            waist: kinematics.frame_pose::<Base>(&robot.model, waist).rotation,
        };
        let initial = ServoState {
            ik: IkState::at_rest(&spec.initial_posture_rad),
            base: robot.base_estimator.start(&robot.model, &X_WB, &spec.initial_posture_rad),
            hand_pose_commanded,
            hand_error_max_m: 0.0,
            joint_margin_rad: mikoshi_humanoid::ik::joint_margin(&robot.model, &spec.initial_posture_rad),
            flags: 0,
        };
        Ok(Self { robot, initial, stance })
    }

    /// The state at tick 0.
    pub fn initial_state(&self) -> ServoState {
        self.initial
    }

    /// Workspaces of its size.
    pub fn scratch(&self) -> ServoScratch {
        ServoScratch { measured: self.robot.kinematics(), ik: IkScratch::new(&self.robot.model) }
    }

    /// Where the robot is: base, hands, what the hands apply to the object, what the ground applies to it.
    pub fn sense(
        &self,
        state: &mut ServoState,
        scratch: &mut ServoScratch,
        sensors: &Sensors,
        out: &mut RobotState,
    ) {
        let (robot, model) = (&self.robot, &self.robot.model);
        let kinematics = &mut scratch.measured;
        let base = self.estimate_base(&mut state.base, kinematics, sensors);

        for (hand, (&palm, sensor)) in robot.palms.iter().zip(&robot.wrist_sensors).enumerate() {
            let X_WH: Pose<World, Hand> = kinematics.frame_pose(model, palm);
            let reading = Wrench::<Sensor>::from_array(&sensors.wrist_wrench[hand]);
            let on_object = sensor.applied_wrench(model, kinematics, &reading, None, &X_WH.translation);
            out.hand_pose[hand] = X_WH.to_array();
            out.hand_wrench[hand] = on_object.to_array();
        }
        self.sense_balance(kinematics, &base, sensors, out);
        out.hand_pose_commanded = state.hand_pose_commanded;
        out.base_pose = base.pose.to_array();
        out.joint_margin_min_rad = state.joint_margin_rad;
        out.hand_error_max_m = state.hand_error_max_m;
        out.flags = state.flags;
    }

    fn estimate_base(
        &self,
        state: &mut BaseEstimatorState,
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
        let feet = PerFoot::from_fn(|side| FootContact { pose: self.stance.soles[side], weight: 1.0 });
        self.robot.base_estimator.update(&self.robot.model, state, kinematics, &readings, &feet)
    }

    /// Centre of mass, zero moment point and capture point, and how far they are from the edge.
    fn sense_balance(
        &self,
        kinematics: &Kinematics,
        base: &BaseEstimate,
        sensors: &Sensors,
        out: &mut RobotState,
    ) {
        let (robot, model) = (&self.robot, &self.robot.model);
        let (joint_velocity, _) = sensors.joint_velocity_rad_s.split_at(model.joint_count().min(MAX_JOINTS));
        let com = kinematics.com();
        let com_velocity = kinematics.com_velocity(model, &base.twist, joint_velocity);
        let ground_z = self.stance.soles.right.translation.z;
        let pendulum = Pendulum { mass_kg: model.total_mass_kg(), com_height_m: com.z - ground_z };
        let capture_point = pendulum.divergent_component(&com.xy(), &com_velocity.xy());

        let mut on_ground = Wrench::<World>::zero();
        for (side, reading) in Side::BOTH.into_iter().zip(&sensors.ankle_wrench) {
            let reading = Wrench::<Sensor>::from_array(reading);
            let sensor = &robot.ankle_sensors[side];
            on_ground += sensor.applied_wrench(model, kinematics, &reading, None, &Vector3::zeros());
        }
        let least_force_n = LEAST_GROUND_FORCE * pendulum.weight_n();
        // Without a grip on the ground the margin is that of the capture point alone.
        let zmp = zero_moment_point(&-on_ground, ground_z, least_force_n).unwrap_or(capture_point);
        let standing = PerFoot::from_fn(|side| Some(self.stance.soles[side]));
        let support = SupportPolygon::of_feet(&robot.sole_rectangles, &standing);

        out.com_position_m = com.into();
        out.zmp_position_m = zmp.into();
        out.zmp_margin_m = support.signed_distance(&zmp);
        out.capture_point_margin_m = support.signed_distance(&capture_point);
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
            let targets = self.targets(command)?;
            let report = self
                .robot
                .ik
                .solve(&self.robot.model, &mut state.ik, &mut scratch.ik, &targets)
                .map_err(|_| ServoError::InverseKinematics)?;
            self.remember(state, &report);
        }
        out.joint_position_ref_rad = state.ik.joint_position;
        out.joint_velocity_ref_rad_s = state.ik.joint_velocity;
        out.team_command_tick = command.map_or(0, |command| command.state_tick);
        Ok(())
    }

    fn targets(&self, command: &TeamCommand) -> Result<IkTargets, ServoError> {
        let mut hands = [None; MAX_HANDS];
        for (target, array) in hands.iter_mut().zip(&command.hand_pose_ref).take(self.robot.palms.len()) {
            *target = Some(Pose::from_array(array).ok_or(ServoError::HandReference)?);
        }
        Ok(IkTargets {
            stance: Side::Right,
            feet: self.stance.soles,
            com: self.stance.com,
            waist_attitude: self.stance.waist,
            hands,
        })
    }

    fn remember(&self, state: &mut ServoState, report: &IkReport) {
        for (array, pose) in state.hand_pose_commanded.iter_mut().zip(&report.hand_poses) {
            *array = pose.to_array();
        }
        state.hand_error_max_m = report.hand_error_m.iter().copied().fold(0.0, f64::max);
        state.joint_margin_rad = report.joint_margin;
        let set = |bit, is_set: bool| if is_set { bit } else { 0 };
        state.flags = set(flag::JOINT_LIMIT, report.at_position_limit != 0)
            | set(flag::VELOCITY_LIMIT, report.at_velocity_limit != 0)
            | set(flag::HANDS_BEHIND, state.hand_error_max_m > HAND_TOLERANCE_M);
    }
}

impl ServoScratch {
    /// Overwrites every number with NaN.
    pub fn poison(&mut self) {
        self.measured.fill_with_nan();
        self.ik.fill_with_nan();
    }
}
