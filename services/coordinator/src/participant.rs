//! The coordinator on a transport.

use crate::build::BuildCoordinatorError;
use crate::safety::is_credible;
use crate::tick::{Coordinator, CoordinatorOutputs, CoordinatorScratch, CoordinatorState, STATE_VERSION};
use bytemuck::Zeroable;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{Frame, MAX_ROBOTS, Payload, RobotState, ServiceId, TeamCommand, TeamState, flag};
use mikoshi_runtime::{
    Call, OperatorPort, Participant, Publisher, Replaceable, Subscriber, TickError, Transport, has_arrived,
    read_parts, state_schema, write_parts,
};

/// The coordinator with its ports.
pub struct CoordinatorParticipant<T: Transport> {
    coordinator: Coordinator,
    state: CoordinatorState,
    scratch: CoordinatorScratch,
    /// Of the last ticks, tick k at place k mod their number: as many as some robot may still wait for.
    outputs: Vec<CoordinatorOutputs>,
    arrived: Frame<RobotState>,
    /// The last that could be used.
    robot_states: Vec<RobotState>,
    /// One past the tick of the last state of each robot that has arrived; 0 before the first.
    next_state_tick: [u64; MAX_ROBOTS],
    stale_limit_ticks: u64,
    robot_state_ports: Vec<T::Subscriber<RobotState>>,
    command_ports: Vec<T::Publisher<TeamCommand>>,
    team_state_port: T::Publisher<TeamState>,
    operator: OperatorPort,
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
            outputs: vec![CoordinatorOutputs::default(); run.scenario.coordination_delay_ticks as usize + 1],
            arrived: Frame::zeroed(),
            robot_states: vec![RobotState::zeroed(); run.robots.len()],
            next_state_tick: [0; MAX_ROBOTS],
            stale_limit_ticks: run.scenario.safety.stale_limit_ticks,
            robot_state_ports: robots.clone().map(|r| transport.subscriber(r)).collect::<Result<_, _>>()?,
            command_ports: robots.map(|r| transport.publisher(r)).collect::<Result<_, _>>()?,
            team_state_port: transport.publisher(0)?,
            operator: transport.operator(),
            coordinator,
        })
    }

    fn coordinate(&mut self, tick: u64) -> Result<(), TickError> {
        let hands = self.coordinator.hands_of_robots().iter();
        let heard = self.robot_states.iter_mut().zip(&mut self.next_state_tick);
        let ports = self.robot_state_ports.iter_mut().zip(heard).zip(hands);
        for ((port, (believed, next_tick)), &hands) in ports {
            let last = (*next_tick > 0).then_some(&*believed);
            let received = port.receive(tick, &mut self.arrived);
            if has_arrived(&received) {
                *next_tick = tick + 1;
            }
            match received {
                Ok(()) if is_credible(&self.arrived.payload, last, hands) => *believed = self.arrived.payload,
                // The last good one serves until the team has stopped; what it wished then it may not wish now.
                Ok(()) | Err(TickError::NotFinite { .. }) if tick > 0 => {
                    believed.flags = flag::INPUT_REJECTED | flag::CAN_STOP | flag::READY_TO_STEP;
                }
                Ok(()) => return Err(TickError::Service("a robot says what can't be")),
                // It is taken to be where it was last seen.
                // Nobody waits for the wishes of a robot that is lost.
                Err(TickError::InputMissing { .. })
                    if tick.saturating_sub(*next_tick) >= self.stale_limit_ticks && tick > 0 =>
                {
                    believed.flags = flag::INPUT_MISSING | flag::CAN_STOP | flag::READY_TO_STEP;
                }
                Err(TickError::InputMissing { .. }) if tick > 0 => believed.flags |= flag::INPUT_MISSING,
                Err(error) => return Err(error),
            }
        }
        self.state.hear_operator(&self.operator.hear(&self.state.heard_of_operator()));
        let robots = self.robot_states.iter();
        let outputs = of_tick(&mut self.outputs, tick)?;
        self.coordinator
            .tick(tick, &mut self.state, &mut self.scratch, robots, outputs)
            .map_err(|error| TickError::Service(error.text()))?;
        outputs.team_state.next_state_tick = self.next_state_tick;
        Ok(())
    }
}

fn of_tick(outputs: &mut [CoordinatorOutputs], tick: u64) -> Result<&mut CoordinatorOutputs, TickError> {
    let place = (tick as usize).checked_rem(outputs.len());
    place.and_then(|place| outputs.get_mut(place)).ok_or(TickError::Service("no room for outputs"))
}

impl<T: Transport> Participant for CoordinatorParticipant<T> {
    fn id(&self) -> ServiceId {
        ServiceId::Coordinator
    }

    fn compute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        match call {
            Call::Coordinate => self.coordinate(tick),
            _ => Err(TickError::UnknownCall),
        }
    }

    fn publish(&mut self, _: Call, tick: u64) -> Result<(), TickError> {
        let outputs = of_tick(&mut self.outputs, tick)?;
        for (port, command) in self.command_ports.iter_mut().zip(&outputs.commands) {
            port.send(tick, command)?;
        }
        self.team_state_port.send(tick, &outputs.team_state)
    }
}

impl<T: Transport> CoordinatorParticipant<T> {
    /// State, what robots said last, and outputs as bytes: all that a checkpoint holds.
    fn parts(&mut self) -> impl Iterator<Item = &mut [u8]> {
        let robots = self.command_ports.len();
        let state = bytemuck::bytes_of_mut(&mut self.state);
        let heard = bytemuck::cast_slice_mut(&mut self.robot_states);
        let next_state_tick = bytemuck::cast_slice_mut(&mut self.next_state_tick);
        [state, heard, next_state_tick]
            .into_iter()
            .chain(self.outputs.iter_mut().flat_map(move |outputs| outputs.parts(robots)))
    }
}

impl<T: Transport> Replaceable for CoordinatorParticipant<T> {
    fn state_schema(&self) -> u64 {
        let parts = [
            TeamCommand::SCHEMA_HASH,
            TeamState::SCHEMA_HASH,
            RobotState::SCHEMA_HASH,
            self.command_ports.len() as u64,
            self.outputs.len() as u64,
            size_of::<CoordinatorState>() as u64,
        ];
        state_schema("coordinator", STATE_VERSION, &parts)
    }

    fn state_bytes(&self) -> usize {
        let of_tick = self.command_ports.len() * size_of::<TeamCommand>() + size_of::<TeamState>();
        let heard = size_of_val(&*self.robot_states) + size_of_val(&self.next_state_tick);
        size_of::<CoordinatorState>() + heard + self.outputs.len() * of_tick
    }

    fn save(&mut self, checkpoint: &mut [u8]) -> Result<usize, TickError> {
        write_parts(self.parts(), checkpoint)
    }

    fn load(&mut self, checkpoint: &[u8]) -> Result<(), TickError> {
        if checkpoint.len() != self.state_bytes() {
            return Err(TickError::Checkpoint("the state has another length"));
        }
        read_parts(self.parts(), checkpoint)
    }
}
