//! A servo on a transport.

use crate::robot::BuildRobotError;
use crate::tick::{STATE_VERSION, Servo, ServoScratch, ServoState};
use bytemuck::Zeroable;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{Frame, JointCommand, Payload, RobotState, Sensors, ServiceId, TeamCommand};
use mikoshi_runtime::{
    Call, ConnectError, Participant, Publisher, Replaceable, Subscriber, TickError, Transport, read_state,
    state_schema, write_state,
};

/// Why a servo could not be made.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum BuildServoError {
    #[error("robot {robot}: {source}")]
    Robot { robot: String, source: Box<BuildRobotError> },
    #[error("{0}")]
    Connect(#[from] ConnectError),
}

/// A servo with its ports.
pub struct ServoParticipant<T: Transport> {
    index: usize,
    servo: Servo,
    state: ServoState,
    scratch: ServoScratch,
    coordination_delay_ticks: u64,
    sensors: Frame<Sensors>,
    command: Frame<TeamCommand>,
    robot_state: RobotState,
    joint_command: JointCommand,
    sensor_port: T::Subscriber<Sensors>,
    command_port: T::Subscriber<TeamCommand>,
    state_port: T::Publisher<RobotState>,
    joint_port: T::Publisher<JointCommand>,
}

impl<T: Transport> ServoParticipant<T> {
    /// Builds the servo of robot `index` and connects it.
    ///
    /// # Errors
    /// The robot's description can't be used, or a port can't be made.
    pub fn new(run: &RunSpec, index: usize, transport: &T) -> Result<Self, BuildServoError> {
        let servo = Servo::new(run, index).map_err(|source| BuildServoError::Robot {
            robot: run.robots[index].member.name.clone(),
            source: Box::new(source),
        })?;
        Ok(Self {
            index,
            state: servo.initial_state(),
            scratch: servo.scratch(),
            servo,
            coordination_delay_ticks: run.scenario.coordination_delay_ticks,
            sensors: Frame::zeroed(),
            command: Frame::zeroed(),
            robot_state: RobotState::zeroed(),
            joint_command: JointCommand::zeroed(),
            sensor_port: transport.subscriber(index)?,
            command_port: transport.subscriber(index)?,
            state_port: transport.publisher(index)?,
            joint_port: transport.publisher(index)?,
        })
    }

    fn sense(&mut self, tick: u64) -> Result<(), TickError> {
        self.sensor_port.receive(tick, &mut self.sensors)?;
        self.robot_state = RobotState::zeroed();
        let sensors = &self.sensors.payload;
        self.servo.sense(&mut self.state, &mut self.scratch, sensors, &mut self.robot_state);
        Ok(())
    }

    fn act(&mut self, tick: u64) -> Result<(), TickError> {
        // In the first ticks of a delayed coordination there is no command yet: the servo holds.
        let command = match tick.checked_sub(self.coordination_delay_ticks) {
            Some(command_tick) => {
                self.command_port.receive(command_tick, &mut self.command)?;
                Some(&self.command.payload)
            }
            None => None,
        };
        self.joint_command = JointCommand::zeroed();
        self.servo
            .act(&mut self.state, &mut self.scratch, command, &mut self.joint_command)
            .map_err(|error| TickError::Service(error.text()))
    }
}

impl<T: Transport> Participant for ServoParticipant<T> {
    fn id(&self) -> ServiceId {
        ServiceId::Servo(self.index)
    }

    fn compute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        match call {
            Call::Sense => self.sense(tick),
            Call::Act => self.act(tick),
            _ => Err(TickError::UnknownCall),
        }
    }

    fn publish(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        match call {
            Call::Sense => self.state_port.send(tick, &self.robot_state),
            Call::Act => self.joint_port.send(tick, &self.joint_command),
            _ => Err(TickError::UnknownCall),
        }
    }
}

/// Bytes of the outputs, which a checkpoint begins with.
const OUTPUT_BYTES: usize = size_of::<RobotState>() + size_of::<JointCommand>();

impl<T: Transport> Replaceable for ServoParticipant<T> {
    fn state_schema(&self) -> u64 {
        let joints = self.servo.joint_count() as u64;
        state_schema("servo", STATE_VERSION, &[RobotState::SCHEMA_HASH, JointCommand::SCHEMA_HASH, joints])
    }

    fn state_bytes(&self) -> usize {
        // An encoded vector has its length before it: at most as much again.
        OUTPUT_BYTES + 2 * size_of::<ServoState>()
    }

    fn save(&mut self, checkpoint: &mut [u8]) -> Result<usize, TickError> {
        let (outputs, state) =
            checkpoint.split_at_mut_checked(OUTPUT_BYTES).ok_or(TickError::Checkpoint("no room"))?;
        let (robot_state, joint_command) = outputs.split_at_mut(size_of::<RobotState>());
        robot_state.copy_from_slice(bytemuck::bytes_of(&self.robot_state));
        joint_command.copy_from_slice(bytemuck::bytes_of(&self.joint_command));
        Ok(OUTPUT_BYTES + write_state(&self.state, state)?)
    }

    fn load(&mut self, checkpoint: &[u8]) -> Result<(), TickError> {
        let (outputs, state) = checkpoint
            .split_at_checked(OUTPUT_BYTES)
            .ok_or(TickError::Checkpoint("the state is too short"))?;
        self.state = read_state(state)?;
        let (robot_state, joint_command) = outputs.split_at(size_of::<RobotState>());
        self.robot_state = bytemuck::pod_read_unaligned(robot_state);
        self.joint_command = bytemuck::pod_read_unaligned(joint_command);
        Ok(())
    }
}
