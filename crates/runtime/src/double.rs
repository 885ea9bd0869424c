//! A team without control: every service passes numbers on, so that each payload depends on all that came before
//! it. Tests compare what such teams say; measurements of latency use them to see what the exchange of frames costs
//! by itself.

use crate::{
    Call, ConnectError, Loan, Participant, Publisher, Replaceable, Subscriber, TickError, TickSchedule,
    Topic, Transport,
};
use mikoshi_ipc_types::{
    Frame, JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Sensors, ServiceId, ServicePayload,
    TeamCommand, TeamState,
};

type Outputs<T, P> = Vec<<T as Transport>::Publisher<P>>;

/// An input and the last frame of it.
struct Inlet<T: Transport, P: ServicePayload> {
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

    /// The payload that is used in this tick; in the first ticks there is none, and it is zero. By the clock it may
    /// be what came last.
    fn receive(&mut self, tick: u64) -> Result<&P, TickError> {
        if let Some(tick) = tick.checked_sub(self.age_ticks) {
            match self.port.receive(tick, &mut self.frame) {
                Ok(()) | Err(TickError::InputMissing { .. }) => {}
                Err(error) => return Err(error),
            }
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
pub struct Double<T: Transport> {
    id: ServiceId,
    ports: Ports<T>,
    /// The world's: a number for each robot. A servo's: what it sensed, and where it goes. The
    /// coordinator's: the mean of all it was told in each of its last ticks.
    numbers: Vec<f64>,
}

enum Ports<T: Transport> {
    Bridge {
        sensors: Outputs<T, Sensors>,
        truth: Outputs<T, RobotTruth>,
        object: T::Publisher<ObjectTruth>,
        commands: Vec<Inlet<T, JointCommand>>,
    },
    /// Adds its own index to what it senses and to what it is told.
    Servo {
        robot: usize,
        sensors: Inlet<T, Sensors>,
        state: T::Publisher<RobotState>,
        command: Inlet<T, TeamCommand>,
        joints: T::Publisher<JointCommand>,
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
        let oldest = schedule.phases_of(id).map(|phase| schedule.oldest_use(phase)).max().unwrap_or(0);
        let (ports, numbers) = match id {
            ServiceId::Bridge => {
                let ports = Ports::Bridge {
                    sensors: (0..robots).map(|r| transport.publisher(r)).collect::<Result<_, _>>()?,
                    truth: (0..robots).map(|r| transport.publisher(r)).collect::<Result<_, _>>()?,
                    object: transport.publisher(0)?,
                    commands: (0..robots)
                        .map(|r| Inlet::new(transport, schedule, id, r))
                        .collect::<Result<_, _>>()?,
                };
                (ports, vec![1.0; robots])
            }
            ServiceId::Servo(robot) => {
                let ports = Ports::Servo {
                    robot,
                    sensors: Inlet::new(transport, schedule, id, robot)?,
                    state: transport.publisher(robot)?,
                    command: Inlet::new(transport, schedule, id, robot)?,
                    joints: transport.publisher(robot)?,
                };
                (ports, vec![0.0; 2])
            }
            ServiceId::Coordinator => {
                let ports = Ports::Coordinator {
                    states: (0..robots)
                        .map(|r| Inlet::new(transport, schedule, id, r))
                        .collect::<Result<_, _>>()?,
                    commands: (0..robots).map(|r| transport.publisher(r)).collect::<Result<_, _>>()?,
                    team: transport.publisher(0)?,
                };
                (ports, vec![0.0; oldest as usize + 1])
            }
        };
        Ok(Self { id, ports, numbers })
    }
}

impl<T: Transport> Participant for Double<T> {
    fn id(&self) -> ServiceId {
        self.id
    }

    fn compute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        let numbers = &mut self.numbers;
        match (&mut self.ports, call) {
            (Ports::Bridge { .. }, Call::Publish) => {}
            (Ports::Bridge { commands, .. }, Call::Step) => {
                for (command, value) in commands.iter_mut().zip(numbers) {
                    *value = (*value + command.receive(tick)?.joint_position_ref_rad[0]).sin();
                }
            }
            (Ports::Servo { robot, sensors, .. }, Call::Sense) => {
                numbers[0] = sensors.receive(tick)?.joint_position_rad[0] + *robot as f64;
            }
            (Ports::Servo { command, .. }, Call::Act) => {
                numbers[1] = command.receive(tick)?.hand_pose_ref[0][0] - numbers[0];
            }
            (Ports::Coordinator { states, .. }, Call::Coordinate) => {
                let mut sum = 0.0;
                for state in states.iter_mut() {
                    sum += state.receive(tick)?.com_position_m[0];
                }
                let kept = numbers.len();
                numbers[tick as usize % kept] = sum / states.len() as f64;
            }
            _ => return Err(TickError::UnknownCall),
        }
        Ok(())
    }

    fn publish(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        let numbers = &self.numbers;
        match (&mut self.ports, call) {
            (Ports::Bridge { sensors, truth, object, .. }, Call::Publish) => {
                // First what others wait for.
                for (sensors, value) in sensors.iter_mut().zip(numbers) {
                    publish(sensors, tick, |payload| payload.joint_position_rad[0] = *value)?;
                }
                for (truth, value) in truth.iter_mut().zip(numbers) {
                    publish(truth, tick, |payload| payload.tilt_rad = *value)?;
                }
                publish(object, tick, |payload| payload.pose[0] = numbers.iter().sum())
            }
            (Ports::Servo { state, .. }, Call::Sense) => {
                publish(state, tick, |payload| payload.com_position_m[0] = numbers[0])
            }
            (Ports::Servo { joints, .. }, Call::Act) => {
                publish(joints, tick, |payload| payload.joint_position_ref_rad[0] = numbers[1])
            }
            (Ports::Coordinator { commands, team, .. }, Call::Coordinate) => {
                let mean = numbers[tick as usize % numbers.len()];
                for command in commands {
                    publish(command, tick, |payload| payload.hand_pose_ref[0][0] = mean)?;
                }
                publish(team, tick, |payload| payload.object_pose[0] = mean)
            }
            _ => Ok(()),
        }
    }
}

impl<T: Transport> Replaceable for Double<T> {
    fn state_schema(&self) -> u64 {
        1
    }

    fn state_bytes(&self) -> usize {
        size_of_val(&*self.numbers)
    }

    fn save(&mut self, checkpoint: &mut [u8]) -> Result<usize, TickError> {
        let bytes = bytemuck::cast_slice::<_, u8>(&self.numbers);
        let room = checkpoint.get_mut(..bytes.len()).ok_or(TickError::Checkpoint("too little room"))?;
        room.copy_from_slice(bytes);
        Ok(bytes.len())
    }

    fn load(&mut self, checkpoint: &[u8]) -> Result<(), TickError> {
        let bytes = bytemuck::cast_slice_mut::<_, u8>(&mut self.numbers);
        let kept = checkpoint.get(..bytes.len()).ok_or(TickError::Checkpoint("too short"))?;
        bytes.copy_from_slice(kept);
        Ok(())
    }
}
