//! The coordinator on a transport.

use crate::build::BuildCoordinatorError;
use crate::tick::{Coordinator, CoordinatorOutputs, CoordinatorScratch, CoordinatorState};
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{Frame, RobotState, ServiceId, TeamCommand, TeamState};
use mikoshi_runtime::{Call, Loan, Participant, Publisher, Subscriber, TickError, Transport};

/// The coordinator with its ports.
pub struct CoordinatorParticipant<T: Transport> {
    coordinator: Coordinator,
    state: CoordinatorState,
    scratch: CoordinatorScratch,
    outputs: CoordinatorOutputs,
    robot_states: Vec<Frame<RobotState>>,
    robot_state_ports: Vec<T::Subscriber<RobotState>>,
    command_ports: Vec<T::Publisher<TeamCommand>>,
    team_state_port: T::Publisher<TeamState>,
}

impl<T: Transport> CoordinatorParticipant<T> {
    /// Builds the coordinator and connects it.
    ///
    /// # Errors
    /// The run can't be coordinated as described, or a port can't be made.
    pub fn new(run: &RunSpec, transport: &T) -> Result<Self, BuildCoordinatorError> {
        let coordinator = Coordinator::new(run)?;
        let robots = 0..run.robots.len();
        Ok(Self {
            state: coordinator.initial_state()?,
            scratch: coordinator.scratch(),
            outputs: CoordinatorOutputs::default(),
            robot_states: vec![Frame::zeroed(); run.robots.len()],
            robot_state_ports: robots.clone().map(|r| transport.subscriber(r)).collect::<Result<_, _>>()?,
            command_ports: robots.map(|r| transport.publisher(r)).collect::<Result<_, _>>()?,
            team_state_port: transport.publisher(0)?,
            coordinator,
        })
    }

    fn coordinate(&mut self, tick: u64) -> Result<(), TickError> {
        for (port, frame) in self.robot_state_ports.iter_mut().zip(&mut self.robot_states) {
            port.receive(tick, frame)?;
        }
        let robots = self.robot_states.iter().map(|frame| &frame.payload);
        self.coordinator
            .tick(tick, &mut self.state, &mut self.scratch, robots, &mut self.outputs)
            .map_err(|error| TickError::Service(error.text()))?;
        for (port, command) in self.command_ports.iter_mut().zip(&self.outputs.commands) {
            send(port, tick, command)?;
        }
        send(&mut self.team_state_port, tick, &self.outputs.team_state)
    }
}

impl<T: Transport> Participant for CoordinatorParticipant<T> {
    fn id(&self) -> ServiceId {
        ServiceId::Coordinator
    }

    fn execute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        match call {
            Call::Coordinate => self.coordinate(tick),
            _ => Err(TickError::UnknownCall),
        }
    }
}

fn send<P: mikoshi_ipc_types::Payload>(
    port: &mut impl Publisher<P>,
    tick: u64,
    payload: &P,
) -> Result<(), TickError> {
    let mut loan = port.loan(tick)?;
    *loan.payload_mut() = *payload;
    loan.send()
}
