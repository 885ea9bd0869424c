//! One service on recorded inputs, and what it says compared with what it said.

use super::difference::{Difference, first_difference};
use mikoshi_ipc_types::{
    Frame, JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Sensors, ServiceId, ServicePayload,
    TeamCommand, TeamState,
};
use mikoshi_observation::{Observation, Observed};
use mikoshi_runtime::{
    Call, ConnectError, InMemoryHub, InMemoryTransport, Observer, Publisher, Replaceable, Tap, TickError,
    TickSchedule, Topic, Transport,
};
use std::collections::VecDeque;

/// A service that is executed anew.
pub struct Stage {
    service: ServiceId,
    hub: InMemoryHub,
    participant: Box<dyn Replaceable>,
    calls: Vec<Call>,
    inputs: Vec<Input>,
    outputs: Vec<Output>,
    /// The last ticks, as many as some input may be old.
    recent: VecDeque<Observation>,
    oldest_use: u64,
}

/// Hands a recorded frame to the service.
type Input = Box<dyn FnMut(&Observation) -> Result<(), TickError>>;
/// Takes what the service says, and compares it with what it said.
type Output = Box<dyn FnMut(&Observation) -> Result<Option<Difference>, TickError>>;

impl Stage {
    /// A service of this schedule; `build` makes it on its ports.
    ///
    /// # Errors
    /// It can't be made.
    pub fn new<E: From<ConnectError>>(
        schedule: &TickSchedule,
        service: ServiceId,
        build: impl FnOnce(&InMemoryTransport) -> Result<Box<dyn Replaceable>, E>,
    ) -> Result<Self, E> {
        // Of its own: of what others say it hears what was recorded.
        let hub = InMemoryHub::new(schedule.clone());
        let participant = build(&hub.transport(service))?;
        let phases = || schedule.phases_of(service);
        let inputs = phases().flat_map(|phase| &phase.inputs);
        let outputs = phases().flat_map(|phase| &phase.outputs);
        Ok(Self {
            service,
            participant,
            calls: phases().map(|phase| phase.call).collect(),
            inputs: inputs.map(|input| input_of(&hub, input.topic, input.from)).collect::<Result<_, _>>()?,
            outputs: outputs.map(|output| output_of(&hub, output.topic)).collect::<Result<_, _>>()?,
            recent: VecDeque::new(),
            oldest_use: phases()
                .flat_map(|phase| &phase.inputs)
                .map(|input| input.age_ticks)
                .max()
                .unwrap_or(0),
            hub,
        })
    }

    /// Another process takes the service's place: `build` makes it, and it goes on from the old one's state.
    ///
    /// # Errors
    /// It can't be made, or can't go on from that state.
    pub fn replace<E: From<ConnectError> + From<TickError>>(
        &mut self,
        build: impl FnOnce(&InMemoryTransport) -> Result<Box<dyn Replaceable>, E>,
    ) -> Result<(), E> {
        let mut state = vec![0; self.participant.state_bytes()];
        let length = self.participant.save(&mut state)?;
        let mut successor = build(&self.hub.transport(self.service))?;
        if successor.state_schema() != self.participant.state_schema() {
            return Err(TickError::Checkpoint("the predecessor's state has another layout").into());
        }
        successor.load(&state[..length])?;
        self.participant = successor;
        // What its predecessor had heard already, and not yet used.
        for recorded in core::mem::take(&mut self.recent) {
            self.hear(&recorded)?;
            self.recent.push_back(recorded);
        }
        Ok(())
    }

    fn hear(&mut self, recorded: &Observation) -> Result<(), TickError> {
        self.inputs.iter_mut().try_for_each(|input| input(recorded))
    }

    /// Executes a tick on what was recorded of it; the first difference in what the service says, if any.
    ///
    /// # Errors
    /// It could not execute the tick.
    pub fn execute(&mut self, recorded: &Observation) -> Result<Option<Difference>, TickError> {
        self.hub.set_operator_word(recorded.team_state.payload.operator_word);
        self.hear(recorded)?;
        if self.oldest_use > 0 {
            self.recent.push_back(recorded.clone());
            if self.recent.len() as u64 > self.oldest_use {
                self.recent.pop_front();
            }
        }
        for &call in &self.calls {
            self.participant.execute(call, recorded.tick())?;
        }
        let mut first = None;
        for output in &mut self.outputs {
            let difference = output(recorded)?;
            first = first.or(difference);
        }
        Ok(first)
    }
}

fn input_of(hub: &InMemoryHub, topic: Topic, from: ServiceId) -> Result<Input, ConnectError> {
    fn feed<P: Observed + ServicePayload>(
        hub: &InMemoryHub,
        topic: Topic,
        from: ServiceId,
    ) -> Result<Input, ConnectError> {
        let mut port = hub.transport(from).publisher::<P>(topic.robot)?;
        Ok(Box::new(move |recorded| match P::of(recorded).get(topic.robot) {
            Some(frame) => port.send(frame.envelope.tick, &frame.payload),
            None => Err(TickError::InputMissing { topic, tick: recorded.tick() }),
        }))
    }
    // Whatever services may wait for.
    match topic.payload {
        Sensors::NAME => feed::<Sensors>(hub, topic, from),
        RobotState::NAME => feed::<RobotState>(hub, topic, from),
        TeamCommand::NAME => feed::<TeamCommand>(hub, topic, from),
        JointCommand::NAME => feed::<JointCommand>(hub, topic, from),
        _ => Err(ConnectError::NotPublished { topic }),
    }
}

fn output_of(hub: &InMemoryHub, topic: Topic) -> Result<Output, ConnectError> {
    fn compare<P: Observed>(hub: &InMemoryHub, topic: Topic) -> Result<Output, ConnectError> {
        let mut port = hub.tap().observer::<P>(topic.robot)?;
        let mut frame = Box::new(Frame::<P>::zeroed());
        Ok(Box::new(move |recorded| {
            let missing = TickError::InputMissing { topic, tick: recorded.tick() };
            if !port.try_receive(&mut frame)? {
                return Err(missing);
            }
            let recorded = P::of(recorded).get(topic.robot).ok_or(missing)?;
            Ok(first_difference(&recorded.payload, &frame.payload, topic))
        }))
    }
    match topic.payload {
        Sensors::NAME => compare::<Sensors>(hub, topic),
        ObjectTruth::NAME => compare::<ObjectTruth>(hub, topic),
        RobotTruth::NAME => compare::<RobotTruth>(hub, topic),
        RobotState::NAME => compare::<RobotState>(hub, topic),
        TeamCommand::NAME => compare::<TeamCommand>(hub, topic),
        TeamState::NAME => compare::<TeamState>(hub, topic),
        JointCommand::NAME => compare::<JointCommand>(hub, topic),
        _ => Err(ConnectError::NotPublished { topic }),
    }
}
