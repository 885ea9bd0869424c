//! The bridge on a transport.

use crate::coast::{Coast, Rates};
use crate::fallback::{Fallback, FallbackState};
use crate::{BuildWorldError, Physics};
use bytemuck::Zeroable;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{
    Frame, JointCommand, MAX_JOINTS, MAX_ROBOTS, ObjectTruth, OperatorInput, Payload, Push, RobotTruth,
    Sensors, ServiceId,
};
use mikoshi_runtime::{
    Call, ConnectError, Loan, OperatorPort, Participant, Publisher, Replaceable, Subscriber, TickError,
    Transport, has_arrived, read_parts, state_schema, write_parts,
};
use thiserror::Error;

/// Of the layout of a world's checkpoint: another one gets another number.
const STATE_VERSION: u64 = 5;

/// Why a bridge could not be made.
#[derive(Debug, Error)]
#[allow(missing_docs)]
pub enum BuildBridgeError {
    #[error("{0}")]
    World(#[from] BuildWorldError),
    #[error("{0}")]
    Connect(#[from] ConnectError),
}

impl BuildBridgeError {
    /// Whether the system is to blame, and not the run that was asked for.
    pub fn is_fault(&self) -> bool {
        matches!(self, Self::Connect(_) | Self::World(BuildWorldError::Simulator { .. }))
    }
}

/// A world with its ports.
pub struct BridgeParticipant<T: Transport, W: Physics> {
    world: W,
    frame: Frame<JointCommand>,
    commands: Vec<JointCommand>,
    /// One past the tick of the last command of each robot that has arrived; 0 before the first.
    next_command_tick: [u64; MAX_ROBOTS],
    /// Of each robot, in the tick before the last.
    rates_before: [Rates; MAX_ROBOTS],
    coast: Coast,
    fallbacks: Vec<Fallback>,
    fallback_states: Vec<FallbackState>,
    robots: Vec<RobotPorts<T>>,
    object_truth: T::Publisher<ObjectTruth>,
    operator: OperatorPort,
    /// The last push that was heard of.
    heard_push: Push,
}

struct RobotPorts<T: Transport> {
    sensors: T::Publisher<Sensors>,
    truth: T::Publisher<RobotTruth>,
    command: T::Subscriber<JointCommand>,
}

impl<T: Transport, W: Physics> BridgeParticipant<T, W> {
    /// Builds the run's world and connects it.
    ///
    /// # Errors
    /// No world can be built from the run, or a port can't be made.
    pub fn new(run: &RunSpec, transport: &T) -> Result<Self, BuildBridgeError> {
        let ports = |robot| {
            Ok(RobotPorts {
                sensors: transport.publisher(robot)?,
                truth: transport.publisher(robot)?,
                command: transport.subscriber(robot)?,
            })
        };
        let robots = (0..run.robots.len()).map(ports).collect::<Result<Vec<_>, ConnectError>>()?;
        let frame = Frame::zeroed();
        let (world, period_s) = (W::new(run)?, run.scenario.control_period_s);
        let fallbacks = world.joint_limits().map(|limits| Fallback::new(period_s, limits)).collect();
        Ok(Self {
            world,
            commands: vec![frame.payload; robots.len()],
            next_command_tick: [0; MAX_ROBOTS],
            rates_before: [[0.0; MAX_JOINTS]; MAX_ROBOTS],
            coast: Coast::of_period(period_s),
            fallback_states: vec![FallbackState::zeroed(); robots.len()],
            fallbacks,
            frame,
            robots,
            object_truth: transport.publisher(0)?,
            operator: transport.operator(),
            heard_push: Push::default(),
        })
    }

    /// The world.
    pub fn world(&self) -> &W {
        &self.world
    }

    fn publish_world(&mut self, tick: u64) -> Result<(), TickError> {
        for (robot, ports) in self.robots.iter_mut().enumerate() {
            let mut loan = ports.sensors.loan(tick)?;
            let sensors = loan.payload_mut();
            self.world.sense(robot, sensors);
            sensors.next_joint_command_tick = self.next_command_tick.get(robot).copied().unwrap_or_default();
            loan.send()?;
        }
        for (robot, ports) in self.robots.iter_mut().enumerate() {
            let mut loan = ports.truth.loan(tick)?;
            self.world.robot_truth(robot, loan.payload_mut());
            loan.send()?;
        }
        let mut loan = self.object_truth.loan(tick)?;
        let truth = loan.payload_mut();
        self.world.object_truth(truth);
        let Push { number, target, force_n, ticks } = self.heard_push;
        (truth.heard_push_number, truth.heard_push_target) = (number, target);
        (truth.heard_push_force_n, truth.heard_push_ticks) = (force_n, ticks);
        loan.send()
    }

    /// Pushes whom somebody wants pushed. What was heard is kept with this step, and said with the next tick.
    fn hear_pushes(&mut self) {
        let last = OperatorInput { push: self.heard_push, ..OperatorInput::default() };
        let push = self.operator.hear(&last).push;
        if push.number != 0 && push.number != self.heard_push.number {
            self.heard_push = push;
            self.world.push(&push);
        }
    }

    fn step(&mut self, tick: u64) -> Result<(), TickError> {
        let mut rejected = 0;
        let heard = self.commands.iter_mut().zip(&mut self.next_command_tick).zip(&mut self.rates_before);
        let fallbacks = self.fallbacks.iter().zip(&mut self.fallback_states);
        let robots = self.robots.iter_mut().zip(heard).zip(fallbacks).zip(self.world.commands());
        for (robot, (((ports, heard), (fallback, state)), last)) in robots.enumerate() {
            let ((command, next_tick), rates_before) = heard;
            let received = ports.command.receive(tick, &mut self.frame);
            if has_arrived(&received) {
                *next_tick = tick + 1;
            }
            *command = match received {
                Ok(()) if is_credible(&self.frame.payload, last) => {
                    fallback.hear(state, tick, &self.frame.payload, last)
                }
                // Drives hold what they were told last.
                Ok(()) | Err(TickError::NotFinite { .. }) => {
                    rejected |= 1 << robot;
                    let hold = JointCommand { joint_velocity_ref_rad_s: [0.0; MAX_JOINTS], ..*last };
                    fallback.miss(state, tick, hold, last)
                }
                Err(TickError::InputMissing { .. }) => {
                    let missed = (tick + 1).saturating_sub(*next_tick);
                    fallback.miss(state, tick, self.coast.after(last, rates_before, missed), last)
                }
                Err(error) => return Err(error),
            };
            *rates_before = last.joint_velocity_ref_rad_s;
        }
        self.world.note_rejected(rejected);
        self.hear_pushes();
        self.world.step(&self.commands).map_err(|error| TickError::Service(error.text()))
    }
}

/// How far a joint's reference may come in a tick: forty turns a second are a mistake.
const ABSURD_STEP_RAD: f64 = 1.0;
/// How fast it may say that it moves.
const ABSURD_RATE_RAD_S: f64 = 100.0;

/// Whether drives may follow this command after the last one.
fn is_credible(command: &JointCommand, last: &JointCommand) -> bool {
    let steps = command.joint_position_ref_rad.iter().zip(&last.joint_position_ref_rad);
    steps.into_iter().all(|(to, from)| (to - from).abs() <= ABSURD_STEP_RAD)
        && command.joint_velocity_ref_rad_s.iter().all(|rate| rate.abs() <= ABSURD_RATE_RAD_S)
}

impl<T: Transport, W: Physics> Participant for BridgeParticipant<T, W> {
    fn id(&self) -> ServiceId {
        ServiceId::Bridge
    }

    fn compute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        if self.world.tick() != tick {
            return Err(TickError::Service("the world is at another tick"));
        }
        match call {
            Call::Publish => Ok(()),
            Call::Step => self.step(tick),
            _ => Err(TickError::UnknownCall),
        }
    }

    fn publish(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        match call {
            Call::Publish => self.publish_world(tick),
            Call::Step => Ok(()),
            _ => Err(TickError::UnknownCall),
        }
    }
}

impl<T: Transport, W: Physics> Replaceable for BridgeParticipant<T, W> {
    fn state_schema(&self) -> u64 {
        let parts = [
            Sensors::SCHEMA_HASH,
            RobotTruth::SCHEMA_HASH,
            ObjectTruth::SCHEMA_HASH,
            JointCommand::SCHEMA_HASH,
            self.world.fingerprint(),
            self.world.checkpoint_size() as u64,
        ];
        state_schema("bridge", STATE_VERSION, &parts)
    }

    fn state_bytes(&self) -> usize {
        size_of_val(&self.next_command_tick)
            + size_of_val(&self.rates_before)
            + size_of_val(self.fallback_states.as_slice())
            + size_of_val(&self.heard_push)
            + self.world.checkpoint_size()
    }

    fn save(&mut self, checkpoint: &mut [u8]) -> Result<usize, TickError> {
        let length = write_parts(self.parts(), checkpoint)?;
        let size = self.world.checkpoint_size();
        let room = checkpoint.get_mut(length..length + size).ok_or(TickError::Checkpoint("no room"))?;
        self.world.save(room).map_err(|_| TickError::Checkpoint("the world can't be saved"))?;
        Ok(length + size)
    }

    fn load(&mut self, checkpoint: &[u8]) -> Result<(), TickError> {
        let length = checkpoint.len().saturating_sub(self.world.checkpoint_size());
        let (heard, world) = checkpoint.split_at(length);
        self.world.load(world).map_err(|_| TickError::Checkpoint("it is of another world"))?;
        read_parts(self.parts(), heard)
    }
}

impl<T: Transport, W: Physics> BridgeParticipant<T, W> {
    /// What a checkpoint holds beside the world.
    fn parts(&mut self) -> [&mut [u8]; 4] {
        [
            bytemuck::cast_slice_mut(&mut self.next_command_tick),
            bytemuck::cast_slice_mut(&mut self.rates_before),
            bytemuck::cast_slice_mut(&mut self.fallback_states),
            bytemuck::bytes_of_mut(&mut self.heard_push),
        ]
    }
}
