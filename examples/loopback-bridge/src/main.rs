//! A bridge without a world: drives are at once where they are told to be, feet stand where they stood, and every hand
//! bears its share of the object, at the object's centre. What a bridge to real robots must do is all here: it says what sensors read at the
//! beginning of a tick, in the units and axes of `ipc-types/src/payloads.rs`, and hands joint references to drives.
//!
//! ```sh
//! mikoshi run config/scenarios/hold.toml --bridge target/release/mikoshi-loopback-bridge
//! ```

#![allow(non_snake_case)]

use bytemuck::{Pod, Zeroable};
use clap::Parser;
use mikoshi_config::{RobotSpec, RunSpec};
use mikoshi_humanoid::Kinematics;
use mikoshi_humanoid::balance::{GRAVITY_M_S2, PerFoot, Side};
use mikoshi_humanoid::estimate::{ForceTorqueSensor, SupportPolygon};
use mikoshi_ipc_types::{
    Frame, JointCommand, MAX_JOINTS, ObjectTruth, RobotTruth, Sensors, ServiceId, all_hands,
};
use mikoshi_process::{ServeError, ServiceArguments, serve};
use mikoshi_robot::Robot;
use mikoshi_runtime::{
    Call, ConnectError, Loan, Participant, Publisher, Replaceable, Subscriber, TickError, Transport,
    has_arrived, read_parts, state_schema, write_parts,
};
use mikoshi_spatial::{Base, Foot, Hand, Object, Pose, Sensor, World, Wrench};
use nalgebra::{Vector2, Vector3};
use std::process::ExitCode;

/// Of what [`Replaceable::save`] writes.
const STATE_VERSION: u64 = 1;

fn main() -> ExitCode {
    let ServiceArguments { place } = ServiceArguments::parse();
    serve(&place, |_| Ok(ServiceId::Bridge), LoopbackBridge::new)
}

/// All robots of a run.
struct LoopbackBridge<T: Transport> {
    robots: Vec<StandingRobot>,
    ports: Vec<RobotPorts<T>>,
    object: T::Publisher<ObjectTruth>,
    frame: Frame<JointCommand>,
}

/// By which a robot is heard and told.
struct RobotPorts<T: Transport> {
    sensors: T::Publisher<Sensors>,
    truth: T::Publisher<RobotTruth>,
    commands: T::Subscriber<JointCommand>,
}

/// One robot.
struct StandingRobot {
    body: Robot,
    kinematics: Kinematics,
    grasping_hands: Vec<usize>,
    /// The object in each of them.
    X_HO: Vec<Pose<Hand, Object>>,
    /// Where the right sole stands.
    X_WFoot: Pose<World, Foot>,
    /// What each hand bears of the object's weight.
    share_n: f64,
    /// What the drives were told last: they are there.
    command: JointCommand,
    /// One past the tick of the last command that has arrived.
    next_command_tick: u64,
    imu: Imu,
    period_s: f64,
}

/// What an inertial sensor feels: how it moves, by where it was.
#[repr(C)]
#[derive(Clone, Copy, Zeroable, Pod)]
struct Imu {
    /// `[x, y, z, qw, qx, qy, qz]` in the world.
    pose: [f64; 7],
    velocity_m_s: [f64; 3],
    angular_velocity_rad_s: [f64; 3],
    specific_force_m_s2: [f64; 3],
}

impl Imu {
    fn at_rest(X_WI: &Pose<World, Sensor>) -> Self {
        let imu = Self { pose: X_WI.to_array(), ..Self::zeroed() };
        imu.moved_to(X_WI, 1.0)
    }

    fn moved_to(&self, X_WI: &Pose<World, Sensor>, period_s: f64) -> Self {
        let last = Pose::from_array(&self.pose).unwrap_or(*X_WI);
        let way = last.displacement_to(X_WI);
        let velocity = way.linear / period_s;
        let acceleration = (velocity - Vector3::from(self.velocity_m_s)) / period_s;
        let turned = X_WI.rotation.inverse();
        Self {
            pose: X_WI.to_array(),
            velocity_m_s: velocity.into(),
            angular_velocity_rad_s: (turned * way.angular / period_s).into(),
            specific_force_m_s2: (turned * (acceleration + Vector3::z() * GRAVITY_M_S2)).into(),
        }
    }
}

impl<T: Transport> LoopbackBridge<T> {
    fn new(run: &RunSpec, transport: &T) -> Result<Self, ServeError> {
        let hands: usize = run.robots.iter().map(|robot| robot.grasping_hands.len()).sum();
        let share_n = run.scenario.object.mass_kg * GRAVITY_M_S2 / hands.max(1) as f64;
        let ports = |robot| {
            Ok(RobotPorts {
                sensors: transport.publisher(robot)?,
                truth: transport.publisher(robot)?,
                commands: transport.subscriber(robot)?,
            })
        };
        let ports = (0..run.robots.len()).map(ports).collect::<Result<_, ConnectError>>();
        let period_s = run.scenario.control_period_s;
        let robots = run.robots.iter().map(|spec| StandingRobot::new(spec, share_n, period_s));
        Ok(Self {
            robots: robots.collect::<Result<_, _>>()?,
            ports: ports.map_err(ServeError::fault)?,
            object: transport.publisher(0).map_err(ServeError::fault)?,
            frame: Frame::zeroed(),
        })
    }

    /// What others wait for comes first; what only observers see comes last.
    fn publish_all(&mut self, tick: u64) -> Result<(), TickError> {
        for (robot, ports) in self.robots.iter().zip(&mut self.ports) {
            let mut loan = ports.sensors.loan(tick)?;
            robot.sense(loan.payload_mut());
            loan.send()?;
        }
        for (robot, ports) in self.robots.iter().zip(&mut self.ports) {
            let mut loan = ports.truth.loan(tick)?;
            robot.confess(loan.payload_mut());
            loan.send()?;
        }
        let mut loan = self.object.loan(tick)?;
        let object = loan.payload_mut();
        if let Some(robot) = self.robots.first() {
            object.pose = robot.object_pose(0).to_array();
        }
        object.robot_count = self.robots.len() as u64;
        loan.send()
    }

    /// Hears what all drives are to do until the next tick. Who says nothing, or what can't be, is not followed:
    /// its drives hold.
    fn drive(&mut self, tick: u64) -> Result<(), TickError> {
        for (robot, ports) in self.robots.iter_mut().zip(&mut self.ports) {
            let received = ports.commands.receive(tick, &mut self.frame);
            if has_arrived(&received) {
                robot.next_command_tick = tick + 1;
            }
            match received {
                Ok(()) => robot.command = self.frame.payload,
                Err(TickError::NotFinite { .. } | TickError::InputMissing { .. }) => {
                    robot.command.joint_velocity_ref_rad_s = [0.0; MAX_JOINTS];
                }
                Err(error) => return Err(error),
            }
            robot.look();
            let X_WI = robot.kinematics.frame_pose(&robot.body.model, robot.body.imu);
            robot.imu = robot.imu.moved_to(&X_WI, robot.period_s);
        }
        Ok(())
    }
}

impl StandingRobot {
    fn new(spec: &RobotSpec, share_n: f64, period_s: f64) -> Result<Self, ServeError> {
        let body = Robot::new(&spec.config, &spec.urdf).map_err(ServeError::configuration)?;
        let X_WB = Pose::<World, Base>::from_array(&spec.initial_base_pose)
            .ok_or_else(|| ServeError::configuration("a base that is nowhere"))?;
        let mut kinematics = Kinematics::new(&body.model);
        kinematics.update(&body.model, &X_WB, &spec.initial_posture_rad);
        let mut command: JointCommand = Frame::zeroed().payload;
        let posture = command.joint_position_ref_rad.iter_mut().zip(&spec.initial_posture_rad);
        posture.for_each(|(to, from)| *to = *from);
        command.closed_hands = all_hands(spec.grasping_hands.len());
        let imu = Imu::at_rest(&kinematics.frame_pose(&body.model, body.imu));
        let X_OH = spec.hand_in_object.iter().map(Pose::<Object, Hand>::from_array);
        let X_HO = X_OH.map(|pose| pose.map(|pose| pose.inverse())).collect::<Option<_>>();
        Ok(Self {
            X_HO: X_HO.ok_or_else(|| ServeError::configuration("a hand that is nowhere"))?,
            X_WFoot: kinematics.frame_pose(&body.model, body.soles.right),
            kinematics,
            grasping_hands: spec.grasping_hands.clone(),
            body,
            share_n,
            command,
            next_command_tick: 0,
            imu,
            period_s,
        })
    }

    /// Where all its links are, now that its drives are where they were told to be.
    fn look(&mut self) {
        let X_WB = self.base_pose();
        let q = &self.command.joint_position_ref_rad[..self.body.model.joint_count()];
        self.kinematics.update(&self.body.model, &X_WB, q);
    }

    fn base_pose(&self) -> Pose<World, Base> {
        let X_BF: Pose<Base, Foot> = self.body.model.pose_in_base(self.body.soles.right, self.joints());
        self.X_WFoot * X_BF.inverse()
    }

    fn palm_pose(&self, grasp: usize) -> Pose<World, Hand> {
        let hand = self.grasping_hands.get(grasp).copied().unwrap_or_default();
        self.kinematics.frame_pose(&self.body.model, self.body.palms[hand])
    }

    /// Where the object is, as a grasping hand holds it.
    fn object_pose(&self, grasp: usize) -> Pose<World, Object> {
        let X_HO = self.X_HO.get(grasp).copied().unwrap_or_else(Pose::identity);
        self.palm_pose(grasp) * X_HO
    }

    fn sole_pose(&self, side: Side) -> Pose<World, Foot> {
        self.kinematics.frame_pose(&self.body.model, self.body.soles[side])
    }

    /// What a grasping hand applies to the object, at the object's centre: so no hand strains against another.
    fn hand_wrench(&self, grasp: usize) -> Wrench<World> {
        let holds = self.command.closed_hands & (1 << grasp) != 0;
        Wrench::new(Vector3::z() * if holds { self.share_n } else { 0.0 }, Vector3::zeros())
    }

    /// Where the ground pushes, and how hard: below all that the robot and its hands carry.
    fn ground(&self) -> (Vector2<f64>, f64) {
        let weight_n = self.body.model.total_mass_kg() * GRAVITY_M_S2;
        let hands = (0..self.grasping_hands.len())
            .map(|grasp| (self.object_pose(grasp).translation.xy(), self.hand_wrench(grasp).force.z));
        let body = (self.kinematics.com().xy(), weight_n);
        let (moment, force_n) = hands
            .chain([body])
            .fold((Vector2::zeros(), 0.0), |sum, (at, force_n)| (sum.0 + at * force_n, sum.1 + force_n));
        (moment / force_n, force_n)
    }

    /// What each foot applies to the ground, and where: the nearer foot bears more.
    fn feet(&self) -> PerFoot<(Vector3<f64>, Vector3<f64>)> {
        let (zmp, force_n) = self.ground();
        let soles = PerFoot::from_fn(|side| self.sole_pose(side).translation);
        let across = (soles.left - soles.right).xy();
        let share = ((zmp - soles.right.xy()).dot(&across) / across.norm_squared()).clamp(0.0, 1.0);
        let ahead = zmp - (soles.right.xy() + across * share);
        PerFoot::from_fn(|side| {
            let share = if side == Side::Left { share } else { 1.0 - share };
            let at = soles[side] + Vector3::new(ahead.x, ahead.y, 0.0);
            (at, Vector3::z() * (-share * force_n))
        })
    }

    /// What a sensor reads of a part that applies `wrench` to what it touches at `at`, and hangs on the sensor otherwise.
    fn reading(&self, sensor: &ForceTorqueSensor, wrench: &Wrench<World>, at: &Vector3<f64>) -> [f64; 6] {
        let X_WS: Pose<World, Sensor> = self.kinematics.frame_pose(&self.body.model, sensor.frame);
        let weight = Vector3::new(0.0, 0.0, -GRAVITY_M_S2) * sensor.carried.mass_kg;
        let own = Wrench::new(weight, (X_WS.rotation * sensor.carried.com).cross(&weight));
        let at_sensor = wrench.shifted(&(at - X_WS.translation)) - own;
        let turned = X_WS.rotation.inverse();
        let (force, moment) = (turned * at_sensor.force, turned * at_sensor.moment);
        [force.x, force.y, force.z, moment.x, moment.y, moment.z]
    }

    /// What all its sensors read.
    fn sense(&self, sensors: &mut Sensors) {
        sensors.joint_position_rad = self.command.joint_position_ref_rad;
        sensors.joint_velocity_rad_s = self.command.joint_velocity_ref_rad_s;
        for grasp in 0..self.grasping_hands.len() {
            let sensor = &self.body.wrist_sensors[self.grasping_hands[grasp]];
            let at = self.object_pose(grasp).translation;
            sensors.wrist_wrench[grasp] = self.reading(sensor, &self.hand_wrench(grasp), &at);
        }
        let feet = self.feet();
        for (index, side) in Side::BOTH.into_iter().enumerate() {
            let (at, force) = feet[side];
            let wrench = Wrench::new(force, Vector3::zeros());
            sensors.ankle_wrench[index] = self.reading(&self.body.ankle_sensors[side], &wrench, &at);
        }
        sensors.imu_angular_velocity_rad_s = self.imu.angular_velocity_rad_s;
        sensors.imu_specific_force_m_s2 = self.imu.specific_force_m_s2;
        sensors.holding_hands = self.command.closed_hands;
        sensors.next_joint_command_tick = self.next_command_tick;
    }

    /// What a run is judged by. A bridge to real robots has no truth: it says what it knows best, or nothing.
    fn confess(&self, truth: &mut RobotTruth) {
        let (zmp, _) = self.ground();
        let X_WB = self.base_pose();
        truth.base_pose = X_WB.to_array();
        truth.tilt_rad = (X_WB.rotation * Vector3::z()).z.clamp(-1.0, 1.0).acos();
        truth.joint_position_rad = self.command.joint_position_ref_rad;
        truth.com_position_m = self.kinematics.com().into();
        truth.zmp_position_m = zmp.into();
        let standing = PerFoot::from_fn(|side| Some(self.sole_pose(side)));
        truth.zmp_margin_m =
            SupportPolygon::of_feet(&self.body.sole_rectangles, &standing).signed_distance(&zmp);
        let feet = self.feet();
        for (index, side) in Side::BOTH.into_iter().enumerate() {
            let (at, force) = feet[side];
            truth.sole_pose[index] = self.sole_pose(side).to_array();
            // The ground's on the foot, about the world's origin.
            let (force, moment) = (-force, at.cross(&-force));
            truth.ground_wrench[index] = [force.x, force.y, force.z, moment.x, moment.y, moment.z];
        }
        for grasp in 0..self.grasping_hands.len() {
            let palm = self.palm_pose(grasp);
            let lever = self.object_pose(grasp).translation - palm.translation;
            let Wrench { force, moment, .. } = self.hand_wrench(grasp).shifted(&lever);
            truth.hand_pose[grasp] = palm.to_array();
            truth.hand_wrench[grasp] = [force.x, force.y, force.z, moment.x, moment.y, moment.z];
        }
    }

    fn joints(&self) -> &[f64] {
        &self.command.joint_position_ref_rad[..self.body.model.joint_count()]
    }
}

impl<T: Transport> Participant for LoopbackBridge<T> {
    fn id(&self) -> ServiceId {
        ServiceId::Bridge
    }

    fn compute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        match call {
            Call::Publish => Ok(()),
            Call::Step => self.drive(tick),
            _ => Err(TickError::UnknownCall),
        }
    }

    fn publish(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        match call {
            Call::Publish => self.publish_all(tick),
            Call::Step => Ok(()),
            _ => Err(TickError::UnknownCall),
        }
    }
}

/// Another process of this program goes on where one was killed: all that matters is what drives were told, and
/// how the robot moved.
impl<T: Transport> Replaceable for LoopbackBridge<T> {
    fn state_schema(&self) -> u64 {
        state_schema("loopback-bridge", STATE_VERSION, &[self.robots.len() as u64])
    }

    fn state_bytes(&self) -> usize {
        self.robots.len() * (size_of::<JointCommand>() + size_of::<u64>() + size_of::<Imu>())
    }

    fn save(&mut self, checkpoint: &mut [u8]) -> Result<usize, TickError> {
        write_parts(self.parts(), checkpoint)
    }

    fn load(&mut self, checkpoint: &[u8]) -> Result<(), TickError> {
        read_parts(self.parts(), checkpoint)?;
        self.robots.iter_mut().for_each(StandingRobot::look);
        Ok(())
    }
}

impl<T: Transport> LoopbackBridge<T> {
    fn parts(&mut self) -> impl Iterator<Item = &mut [u8]> {
        self.robots.iter_mut().flat_map(|robot| {
            [
                bytemuck::bytes_of_mut(&mut robot.command),
                bytemuck::bytes_of_mut(&mut robot.next_command_tick),
                bytemuck::bytes_of_mut(&mut robot.imu),
            ]
        })
    }
}
