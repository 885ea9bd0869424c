//! A servo on a transport.

use crate::robot::BuildRobotError;
use crate::tick::{Servo, ServoScratch, ServoState};
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{Frame, JointCommand, RobotState, Sensors, ServiceId, TeamCommand};
use mikoshi_runtime::{Call, ConnectError, Loan, Participant, Publisher, Subscriber, TickError, Transport};

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
            sensor_port: transport.subscriber(index)?,
            command_port: transport.subscriber(index)?,
            state_port: transport.publisher(index)?,
            joint_port: transport.publisher(index)?,
        })
    }

    fn sense(&mut self, tick: u64) -> Result<(), TickError> {
        self.sensor_port.receive(tick, &mut self.sensors)?;
        let mut loan = self.state_port.loan(tick)?;
        self.servo.sense(&mut self.state, &mut self.scratch, &self.sensors.payload, loan.payload_mut());
        loan.send()
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
        let mut loan = self.joint_port.loan(tick)?;
        self.servo
            .act(&mut self.state, &mut self.scratch, command, loan.payload_mut())
            .map_err(|error| TickError::Service(error.text()))?;
        loan.send()
    }
}

impl<T: Transport> Participant for ServoParticipant<T> {
    fn id(&self) -> ServiceId {
        ServiceId::Servo(self.index)
    }

    fn execute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        match call {
            Call::Sense => self.sense(tick),
            Call::Act => self.act(tick),
            _ => Err(TickError::UnknownCall),
        }
    }
}
