//! A team without control: every service passes numbers on, so that each payload depends on all that
//! came before it.

use mikoshi_ipc_types::{
    Frame, JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Sensors, ServiceId, ServicePayload,
    TeamCommand, TeamState,
};
use mikoshi_runtime::{
    Call, ConnectError, Loan, Participant, Publisher, Subscriber, TickError, TickSchedule, Topic, Transport,
};

type Outputs<T, P> = Vec<<T as Transport>::Publisher<P>>;

/// An input and the last frame of it.
pub struct Inlet<T: Transport, P: ServicePayload> {
    port: T::Subscriber<P>,
    age_ticks: u64,
    frame: Box<Frame<P>>,
}

impl<T: Transport, P: ServicePayload> Inlet<T, P> {
    fn new(
        transport: &T,
        schedule: &TickSchedule,
        id: ServiceId,
        robot: usize,
    ) -> Result<Self, ConnectError> {
        let input = schedule.input_of(id, Topic::of::<P>(robot));
        let age_ticks = input.map_or(0, |input| input.age_ticks);
        Ok(Self { port: transport.subscriber(robot)?, age_ticks, frame: Box::new(Frame::zeroed()) })
    }

    /// The payload that is used in this tick; in the first ticks there is none, and it is zero.
    fn receive(&mut self, tick: u64) -> Result<&P, TickError> {
        if let Some(tick) = tick.checked_sub(self.age_ticks) {
            self.port.receive(tick, &mut self.frame)?;
        }
        Ok(&self.frame.payload)
    }
}

fn publish<P: Payload>(
    publisher: &mut impl Publisher<P>,
    tick: u64,
    fill: impl FnOnce(&mut P),
) -> Result<(), TickError> {
    let mut loan = publisher.loan(tick)?;
    fill(loan.payload_mut());
    loan.send()
}

/// Any service of the team.
pub enum Double<T: Transport> {
    /// The world: a number for each robot.
    Bridge {
        sensors: Outputs<T, Sensors>,
        truth: Outputs<T, RobotTruth>,
        object: T::Publisher<ObjectTruth>,
        commands: Vec<Inlet<T, JointCommand>>,
        world: Vec<f64>,
    },
    /// Adds its own index to what it senses and to what it is told.
    Servo {
        robot: usize,
        sensors: Inlet<T, Sensors>,
        state: T::Publisher<RobotState>,
        command: Inlet<T, TeamCommand>,
        joints: T::Publisher<JointCommand>,
        sensed: f64,
    },
    /// Tells each robot the mean of all.
    Coordinator {
        states: Vec<Inlet<T, RobotState>>,
        commands: Outputs<T, TeamCommand>,
        team: T::Publisher<TeamState>,
    },
}

impl<T: Transport> Double<T> {
    /// The double of this service.
    pub fn new(schedule: &TickSchedule, transport: &T, id: ServiceId) -> Result<Self, ConnectError> {
        let robots = schedule.services().iter().filter(|service| service.robot().is_some()).count();
        Ok(match id {
            ServiceId::Bridge => Self::Bridge {
                sensors: (0..robots).map(|r| transport.publisher(r)).collect::<Result<_, _>>()?,
                truth: (0..robots).map(|r| transport.publisher(r)).collect::<Result<_, _>>()?,
                object: transport.publisher(0)?,
                commands: (0..robots)
                    .map(|r| Inlet::new(transport, schedule, id, r))
                    .collect::<Result<_, _>>()?,
                world: vec![1.0; robots],
            },
            ServiceId::Servo(robot) => Self::Servo {
                robot,
                sensors: Inlet::new(transport, schedule, id, robot)?,
                state: transport.publisher(robot)?,
                command: Inlet::new(transport, schedule, id, robot)?,
                joints: transport.publisher(robot)?,
                sensed: 0.0,
            },
            ServiceId::Coordinator => Self::Coordinator {
                states: (0..robots)
                    .map(|r| Inlet::new(transport, schedule, id, r))
                    .collect::<Result<_, _>>()?,
                commands: (0..robots).map(|r| transport.publisher(r)).collect::<Result<_, _>>()?,
                team: transport.publisher(0)?,
            },
        })
    }
}

impl<T: Transport> Participant for Double<T> {
    fn id(&self) -> ServiceId {
        match self {
            Self::Bridge { .. } => ServiceId::Bridge,
            Self::Servo { robot, .. } => ServiceId::Servo(*robot),
            Self::Coordinator { .. } => ServiceId::Coordinator,
        }
    }

    fn execute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        match (self, call) {
            (Self::Bridge { sensors, truth, object, world, .. }, Call::Publish) => {
                for ((sensors, truth), value) in sensors.iter_mut().zip(truth).zip(&*world) {
                    publish(sensors, tick, |payload| payload.joint_position_rad[0] = *value)?;
                    publish(truth, tick, |payload| payload.tilt_rad = *value)?;
                }
                publish(object, tick, |payload| payload.pose[0] = world.iter().sum())
            }
            (Self::Bridge { commands, world, .. }, Call::Step) => {
                for (command, value) in commands.iter_mut().zip(world) {
                    *value = (*value + command.receive(tick)?.joint_position_ref_rad[0]).sin();
                }
                Ok(())
            }
            (Self::Servo { robot, sensors, state, sensed, .. }, Call::Sense) => {
                *sensed = sensors.receive(tick)?.joint_position_rad[0] + *robot as f64;
                publish(state, tick, |payload| payload.com_position_m[0] = *sensed)
            }
            (Self::Servo { command, joints, sensed, .. }, Call::Act) => {
                let target = command.receive(tick)?.hand_pose_ref[0][0];
                publish(joints, tick, |payload| payload.joint_position_ref_rad[0] = target - *sensed)
            }
            (Self::Coordinator { states, commands, team }, Call::Coordinate) => {
                let mut sum = 0.0;
                for state in states.iter_mut() {
                    sum += state.receive(tick)?.com_position_m[0];
                }
                let mean = sum / states.len() as f64;
                for command in commands {
                    publish(command, tick, |payload| payload.hand_pose_ref[0][0] = mean)?;
                }
                publish(team, tick, |payload| payload.object_pose[0] = mean)
            }
            _ => Err(TickError::UnknownCall),
        }
    }
}
