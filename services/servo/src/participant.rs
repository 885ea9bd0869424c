//! A servo on a transport.

use crate::coast::Course;
use crate::robot::BuildRobotError;
use crate::tick::{STATE_VERSION, Servo, ServoScratch, ServoState};
use bytemuck::{Pod, Zeroable};
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{Frame, JointCommand, Payload, RobotState, Sensors, ServiceId, TeamCommand, flag};
use mikoshi_runtime::{
    Call, ConnectError, Participant, Publisher, Replaceable, Subscriber, TickError, Transport, has_arrived,
    read_parts, read_state, state_schema, write_parts, write_state,
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
    arrived: Frame<TeamCommand>,
    /// The last that could be used, led on where newer ones could not.
    command: TeamCommand,
    heard: Heard,
    robot_state: RobotState,
    joint_command: JointCommand,
    sensor_port: T::Subscriber<Sensors>,
    command_port: T::Subscriber<TeamCommand>,
    state_port: T::Publisher<RobotState>,
    joint_port: T::Publisher<JointCommand>,
}

/// What the servo knows of the team's commands.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Heard {
    /// One past the tick of the last that has arrived; 0 before the first.
    next_tick: u64,
    /// One past the tick of the last that could be used.
    next_usable_tick: u64,
    /// What the robot says of it in its next state: bits of [`flag`].
    flags: u64,
    /// 1 if the sensors of this tick can be believed.
    has_sensors: u64,
    /// 1 since drives were found to have gone on without their servo, until it has begun anew.
    is_adrift: u64,
    /// How hands go on where nothing is heard.
    course: Course,
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
            arrived: Frame::zeroed(),
            command: TeamCommand::zeroed(),
            heard: Heard::zeroed(),
            robot_state: RobotState::zeroed(),
            joint_command: JointCommand::zeroed(),
            sensor_port: transport.subscriber(index)?,
            command_port: transport.subscriber(index)?,
            state_port: transport.publisher(index)?,
            joint_port: transport.publisher(index)?,
        })
    }

    fn sense(&mut self, tick: u64) -> Result<(), TickError> {
        let mut flags = core::mem::take(&mut self.heard.flags);
        let received = self.sensor_port.receive(tick, &mut self.sensors);
        let sensors = &self.sensors.payload;
        let has_arrived = has_arrived(&received);
        // Who has heard sensors all along knows its robot, though nobody may hear it.
        let was_blind = self.heard.has_sensors == 0;
        self.heard.has_sensors = u64::from(received.is_ok() && self.servo.believes(sensors));
        if was_blind && self.heard.has_sensors != 0 && Servo::is_adrift(tick, sensors) {
            self.heard.is_adrift = 1;
        }
        if self.heard.is_adrift != 0 {
            // What it could say of its robot is not so: as if it had no sensors.
            self.servo.sense_nothing(&mut self.state, &mut self.robot_state);
            self.robot_state.flags |= flags | flag::INPUT_MISSING;
            return Ok(());
        }
        let next_sensors_tick = if has_arrived { tick + 1 } else { self.robot_state.next_sensors_tick };
        match received {
            Ok(()) if self.servo.believes(sensors) => {
                flags |= if sensors.command_rejected != 0 { flag::INPUT_REJECTED } else { 0 };
                self.robot_state = RobotState::zeroed();
                self.servo.sense(&mut self.state, &mut self.scratch, sensors, &mut self.robot_state);
            }
            Ok(()) | Err(TickError::NotFinite { .. }) if tick > 0 => {
                flags |= flag::INPUT_REJECTED;
                self.servo.sense_nothing(&mut self.state, &mut self.robot_state);
            }
            Ok(()) => return Err(TickError::Service("the sensors say what can't be")),
            Err(TickError::InputMissing { .. }) if tick > 0 => {
                flags |= flag::INPUT_MISSING;
                self.servo.sense_nothing(&mut self.state, &mut self.robot_state);
            }
            Err(error) => return Err(error),
        }
        self.robot_state.next_sensors_tick = next_sensors_tick;
        self.robot_state.flags |= flags;
        Ok(())
    }

    fn act(&mut self, tick: u64) -> Result<(), TickError> {
        // In the first ticks of a delayed coordination there is no command yet: the servo holds.
        if let Some(command_tick) = tick.checked_sub(self.coordination_delay_ticks) {
            self.hear(command_tick)?;
        }
        if self.heard.is_adrift != 0 {
            self.find_robot(tick);
        }
        let command = (self.heard.next_usable_tick > 0).then_some(&self.command);
        self.joint_command = JointCommand::zeroed();
        self.servo
            .act(&mut self.state, &mut self.scratch, command, &mut self.joint_command)
            .map_err(|error| TickError::Service(error.text()))?;
        self.joint_command.next_team_command_tick = self.heard.next_tick;
        Ok(())
    }

    /// Begins anew where the robot is, once it stands and the team says where it wants its hands.
    fn find_robot(&mut self, tick: u64) {
        let is_told = self.heard.next_usable_tick + self.coordination_delay_ticks == tick + 1;
        let sensors = &self.sensors.payload;
        let can_be_found = is_told && self.heard.has_sensors != 0 && self.servo.stands_still(tick, sensors);
        if can_be_found
            && self.servo.begin_anew(&mut self.state, &mut self.scratch, sensors, &self.command).is_ok()
        {
            self.heard.is_adrift = 0;
        }
    }

    /// Hears the command of this tick. Where it can't be used or does not come, the last one is led on; the
    /// robot says so in its next state.
    fn hear(&mut self, command_tick: u64) -> Result<(), TickError> {
        let received = self.command_port.receive(command_tick, &mut self.arrived);
        let has_arrived = has_arrived(&received);
        if has_arrived {
            self.heard.next_tick = command_tick + 1;
        }
        let arrived = &self.arrived.payload;
        let last = (self.heard.next_usable_tick > 0).then_some(&self.command);
        let problem = match received {
            Ok(()) if self.servo.accepts(arrived, last, &self.robot_state) => {
                self.servo.note_course(&mut self.heard.course, last, arrived);
                self.command = *arrived;
                self.heard.next_usable_tick = command_tick + 1;
                return Ok(());
            }
            Ok(()) | Err(TickError::NotFinite { .. }) if last.is_some() => flag::INPUT_REJECTED,
            Ok(()) => return Err(TickError::Service("the coordinator asks for what can't be")),
            Err(TickError::InputMissing { .. }) => flag::INPUT_MISSING,
            Err(error) => return Err(error),
        };
        self.heard.flags |= problem;
        if last.is_some() {
            self.servo.lead_on(&mut self.heard.course, &mut self.command);
        }
        Ok(())
    }

    /// What a checkpoint holds as it is: outputs, and the command that may serve again.
    fn parts(&mut self) -> [&mut [u8]; 4] {
        [
            bytemuck::bytes_of_mut(&mut self.robot_state),
            bytemuck::bytes_of_mut(&mut self.joint_command),
            bytemuck::bytes_of_mut(&mut self.command),
            bytemuck::bytes_of_mut(&mut self.heard),
        ]
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
            // Drives go on with their plan, which knows better where they are.
            Call::Act if self.heard.is_adrift != 0 => Ok(()),
            Call::Act => self.joint_port.send(tick, &self.joint_command),
            _ => Err(TickError::UnknownCall),
        }
    }
}

/// What a checkpoint begins with.
const PLAIN_BYTES: usize =
    size_of::<RobotState>() + size_of::<JointCommand>() + size_of::<TeamCommand>() + size_of::<Heard>();

impl<T: Transport> Replaceable for ServoParticipant<T> {
    fn state_schema(&self) -> u64 {
        let parts = [
            RobotState::SCHEMA_HASH,
            JointCommand::SCHEMA_HASH,
            TeamCommand::SCHEMA_HASH,
            self.servo.joint_count() as u64,
        ];
        state_schema("servo", STATE_VERSION, &parts)
    }

    fn state_bytes(&self) -> usize {
        // An encoded vector has its length before it: at most as much again.
        PLAIN_BYTES + 2 * size_of::<ServoState>()
    }

    fn save(&mut self, checkpoint: &mut [u8]) -> Result<usize, TickError> {
        let (plain, state) =
            checkpoint.split_at_mut_checked(PLAIN_BYTES).ok_or(TickError::Checkpoint("no room"))?;
        write_parts(self.parts(), plain)?;
        Ok(PLAIN_BYTES + write_state(&self.state, state)?)
    }

    fn load(&mut self, checkpoint: &[u8]) -> Result<(), TickError> {
        let (plain, state) = checkpoint
            .split_at_checked(PLAIN_BYTES)
            .ok_or(TickError::Checkpoint("the state is too short"))?;
        self.state = read_state(state)?;
        read_parts(self.parts(), plain)
    }
}
