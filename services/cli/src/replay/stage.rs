//! One service on recorded inputs, and what it says compared with what it said.

use super::difference::{Difference, first_difference};
use mikoshi_ipc_types::{
    Drive, Frame, JointCommand, ObjectTruth, OperatorInput, Payload, Push, RobotState, RobotTruth, Sensors,
    ServiceId, ServicePayload, TeamCommand, TeamState,
};
use mikoshi_observation::{Observation, Observed};
use mikoshi_runtime::{
    Call, ConnectError, InMemoryHub, InMemoryTransport, Input as ScheduledInput, Observer, Publisher,
    Replaceable, Tap, TickError, TickSchedule, Topic, Transport,
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

/// A frame that the service waits for.
struct Input {
    topic: Topic,
    age_ticks: u64,
    /// Hands the recorded one of a tick to the service.
    tell: Tell,
}

/// Finds what it tells in what was recorded.
type Tell = Box<dyn FnMut(&Observation) -> Result<(), TickError>>;

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
        let inputs = || phases().flat_map(|phase| &phase.inputs);
        let outputs = phases().flat_map(|phase| &phase.outputs);
        Ok(Self {
            service,
            participant,
            calls: phases().map(|phase| phase.call).collect(),
            inputs: inputs().map(|input| input_of(&hub, input)).collect::<Result<_, _>>()?,
            outputs: outputs.map(|output| output_of(&hub, output.topic)).collect::<Result<_, _>>()?,
            recent: VecDeque::new(),
            oldest_use: inputs().map(|input| input.age_ticks).max().unwrap_or(0),
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
        Ok(())
    }

    /// Tells the service what it heard in time.
    fn tell(&mut self, recorded: &Observation, next: Option<&Observation>) -> Result<(), TickError> {
        for Input { topic, age_ticks, tell } in &mut self.inputs {
            let Some(tick) = recorded.tick().checked_sub(*age_ticks) else { continue };
            let mut known = self.recent.iter().chain([recorded]);
            let Some(source) = known.find(|found| found.tick() == tick) else { continue };
            if came_in_time(*topic, tick, recorded, next) {
                tell(source)?;
            }
        }
        Ok(())
    }

    /// Executes a tick on what was recorded of it; the first difference in what the service says, if any. What
    /// came in time in wall-clock time the tick's outputs say, and those of the `next`.
    ///
    /// # Errors
    /// It could not execute the tick.
    pub fn execute(
        &mut self,
        recorded: &Observation,
        next: Option<&Observation>,
    ) -> Result<Option<Difference>, TickError> {
        self.hub.set_operator(heard_of_operator(recorded, next));
        self.tell(recorded, next)?;
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

/// What the operator had said by a tick. The world says in the `next` what it has heard.
fn heard_of_operator(recorded: &Observation, next: Option<&Observation>) -> OperatorInput {
    let team = &recorded.team_state.payload;
    let drive = Drive { number: team.drive_number, twist: team.drive_twist, squeeze_n: team.drive_squeeze_n };
    let push = next.map(|next| &next.object_truth.payload).map_or_else(Push::default, |truth| Push {
        number: truth.heard_push_number,
        target: truth.heard_push_target,
        force_n: truth.heard_push_force_n,
        ticks: truth.heard_push_ticks,
    });
    OperatorInput { word: team.operator_word, drive, push }
}

/// Whether a service heard what was said in `tick` when it needed it: who uses it says what it heard last. Where
/// that was not recorded, it did.
fn came_in_time(topic: Topic, tick: u64, recorded: &Observation, next: Option<&Observation>) -> bool {
    let heard_last = match topic.payload {
        Sensors::NAME => recorded
            .robot_state
            .get(topic.robot)
            .filter(|frame| recorded.is_of_tick(frame))
            .map(|frame| frame.payload.next_sensors_tick),
        TeamCommand::NAME => recorded
            .joint_command
            .get(topic.robot)
            .filter(|frame| recorded.is_of_tick(frame))
            .map(|frame| frame.payload.next_team_command_tick),
        RobotState::NAME => Some(&recorded.team_state)
            .filter(|frame| recorded.is_of_tick(frame))
            .and_then(|frame| frame.payload.next_state_tick.get(topic.robot).copied()),
        JointCommand::NAME => next.and_then(|next| {
            let frame = next.sensors.get(topic.robot).filter(|frame| next.is_of_tick(frame));
            frame.map(|frame| frame.payload.next_joint_command_tick)
        }),
        _ => None,
    };
    heard_last.is_none_or(|next_tick| next_tick == tick + 1)
}

fn input_of(hub: &InMemoryHub, input: &ScheduledInput) -> Result<Input, ConnectError> {
    fn feed<P: Observed + ServicePayload>(
        hub: &InMemoryHub,
        input: &ScheduledInput,
    ) -> Result<Input, ConnectError> {
        let ScheduledInput { topic, from, age_ticks } = *input;
        let mut port = hub.transport(from).publisher::<P>(topic.robot)?;
        let tell = move |source: &Observation| match P::of(source).get(topic.robot) {
            Some(frame) if source.is_of_tick(frame) => port.send(frame.envelope.tick, &frame.payload),
            _ => Err(TickError::InputMissing { topic, tick: source.tick() }),
        };
        Ok(Input { topic, age_ticks, tell: Box::new(tell) })
    }
    // Whatever services may wait for.
    match input.topic.payload {
        Sensors::NAME => feed::<Sensors>(hub, input),
        RobotState::NAME => feed::<RobotState>(hub, input),
        TeamCommand::NAME => feed::<TeamCommand>(hub, input),
        JointCommand::NAME => feed::<JointCommand>(hub, input),
        _ => Err(ConnectError::NotPublished { topic: input.topic }),
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
            let said = P::of(recorded).get(topic.robot).ok_or(missing)?;
            // What was lost in recording can't be compared.
            let difference =
                recorded.is_of_tick(said).then(|| first_difference(&said.payload, &frame.payload, topic));
            Ok(difference.flatten())
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
