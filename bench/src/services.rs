//! Services on what they were told, as in their own processes: from frame to frame, but without a process.

use crate::recording::Recording;
use mikoshi_coordinator::CoordinatorParticipant;
use mikoshi_ipc_types::{Frame, JointCommand, RobotState, Sensors, ServiceId, TeamCommand};
use mikoshi_observation::Observation;
use mikoshi_resolution::tick_schedule;
use mikoshi_runtime::{
    Call, InMemoryHub, InMemoryTransport, Observer, Participant, Publisher, Replaceable, Tap, Transport,
};
use mikoshi_servo::ServoParticipant;

type Sender<P> = <InMemoryTransport as Transport>::Publisher<P>;
type Listener<P> = <mikoshi_runtime::InMemoryTap as Tap>::Observer<P>;

/// The servo of a robot.
pub struct ServoOnRecord {
    robot: usize,
    servo: ServoParticipant<InMemoryTransport>,
    sensors: Sender<Sensors>,
    commands: Sender<TeamCommand>,
    said: Listener<JointCommand>,
}

impl ServoOnRecord {
    /// At tick 0.
    pub fn new(recording: &Recording, robot: usize) -> Self {
        let hub = hub(recording);
        let servo = ServoParticipant::new(&recording.run, robot, &hub.transport(ServiceId::Servo(robot)));
        Self {
            robot,
            servo: servo.expect("a servo"),
            sensors: hub.transport(ServiceId::Bridge).publisher(robot).expect("a port"),
            commands: hub.transport(ServiceId::Coordinator).publisher(robot).expect("a port"),
            said: hub.tap().observer(robot).expect("a port"),
        }
    }

    /// Tells it what it heard in this tick: its sensors.
    pub fn tell_sensors(&mut self, tick: &Observation) {
        self.sensors.send(tick.tick(), &tick.sensors[self.robot].payload).expect("it arrives");
    }

    /// It senses.
    pub fn sense(&mut self, tick: &Observation) {
        self.servo.execute(Call::Sense, tick.tick()).expect("it senses");
    }

    /// Tells it what it heard in this tick: the team's command.
    pub fn tell_command(&mut self, tick: &Observation) {
        self.commands.send(tick.tick(), &tick.team_command[self.robot].payload).expect("it arrives");
    }

    /// It acts.
    pub fn act(&mut self, tick: &Observation) {
        self.servo.execute(Call::Act, tick.tick()).expect("it acts");
    }

    /// Its state, as it is kept for a successor after each half of a tick.
    pub fn keep(&mut self, checkpoint: &mut Vec<u8>) {
        checkpoint.resize(self.servo.state_bytes(), 0);
        self.servo.save(checkpoint).expect("there is room");
    }

    /// Ends the benchmark unless it has said what it said then.
    pub fn check(&mut self, tick: &Observation) {
        let mut frame = Frame::zeroed();
        assert!(self.said.try_receive(&mut frame).expect("it is readable"), "it said nothing");
        assert!(frame.payload == tick.joint_command[self.robot].payload, "it said something else");
    }
}

/// The coordinator.
pub struct CoordinatorOnRecord {
    coordinator: CoordinatorParticipant<InMemoryTransport>,
    states: Vec<Sender<RobotState>>,
    said: Listener<TeamCommand>,
}

impl CoordinatorOnRecord {
    /// At tick 0.
    pub fn new(recording: &Recording) -> Self {
        let hub = hub(recording);
        let coordinator = CoordinatorParticipant::new(&recording.run, &hub.transport(ServiceId::Coordinator));
        let state = |robot| hub.transport(ServiceId::Servo(robot)).publisher(robot).expect("a port");
        Self {
            coordinator: coordinator.expect("a coordinator"),
            states: (0..recording.run.robots.len()).map(state).collect(),
            said: hub.tap().observer(0).expect("a port"),
        }
    }

    /// Tells it what it heard in this tick.
    pub fn tell(&mut self, tick: &Observation) {
        for (port, state) in self.states.iter_mut().zip(&tick.robot_state) {
            port.send(tick.tick(), &state.payload).expect("it arrives");
        }
    }

    /// It coordinates.
    pub fn coordinate(&mut self, tick: &Observation) {
        self.coordinator.execute(Call::Coordinate, tick.tick()).expect("it coordinates");
    }

    /// Ends the benchmark unless it has said to the first robot what it said then.
    pub fn check(&mut self, tick: &Observation) {
        let mut frame = Frame::zeroed();
        assert!(self.said.try_receive(&mut frame).expect("it is readable"), "it said nothing");
        assert!(frame.payload == tick.team_command[0].payload, "it said something else");
    }
}

fn hub(recording: &Recording) -> InMemoryHub {
    InMemoryHub::new(tick_schedule(&recording.run).expect("it was run"))
}
