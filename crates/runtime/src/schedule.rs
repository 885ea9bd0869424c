//! The schedule of a tick, as data: who waits for what, in which order, on which core.
//!
//! Every runner executes it, every transport connects by it, `mikoshi plan` prints it.

use crate::Topic;
use core::fmt;
use mikoshi_ipc_types::{
    Audience, JointCommand, MAX_COORDINATION_DELAY_TICKS, MAX_ROBOTS, ObjectTruth, Payload, RobotState,
    RobotTruth, Sensors, ServiceId, TeamCommand, TeamState,
};

/// What a service does in a phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Call {
    /// Bridge: read the world, publish sensors and ground truth.
    Publish,
    /// Servo: estimate, publish the robot's state.
    Sense,
    /// Coordinator: run the law, publish commands.
    Coordinate,
    /// Servo: run gait and inverse kinematics, publish joint commands.
    Act,
    /// Bridge: advance the world to the next tick.
    Step,
}

impl fmt::Display for Call {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Publish => "publish",
            Self::Sense => "sense",
            Self::Coordinate => "coordinate",
            Self::Act => "act",
            Self::Step => "step",
        })
    }
}

/// A frame that a phase waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// The frame.
    pub topic: Topic,
    /// Its publisher.
    pub from: ServiceId,
    /// In tick k the phase uses the frame of tick k − age.
    pub age_ticks: u64,
}

impl Input {
    /// The tick of the frame that is used in `tick`; none in the first `age_ticks` ticks, in which the
    /// consumer holds its initial command.
    pub fn tick_at(&self, tick: u64) -> Option<u64> {
        tick.checked_sub(self.age_ticks)
    }
}

/// A frame that a phase publishes, one a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Output {
    /// The frame.
    pub topic: Topic,
    /// Who may read it.
    pub audience: Audience,
    /// Its payload's size.
    pub size_bytes: usize,
}

impl Output {
    fn of<P: Payload>(robot: usize) -> Self {
        Self { topic: Topic::of::<P>(robot), audience: P::AUDIENCE, size_bytes: size_of::<P>() }
    }
}

/// One call of one service.
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    /// Who.
    pub service: ServiceId,
    /// What.
    pub call: Call,
    /// What it waits for.
    pub inputs: Vec<Input>,
    /// What it publishes.
    pub outputs: Vec<Output>,
    /// The core it runs on; the operating system's choice when absent.
    pub core: Option<usize>,
    /// Share of the control period that it may take.
    pub budget: f64,
}

/// What makes a tick begin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clock {
    /// Every service waits for its inputs, however long they take.
    #[default]
    Lockstep,
    /// Ticks begin at absolute times, a period apart; what is missing when a phase is due is done without.
    Wall {
        /// Of a tick.
        period_ns: u64,
    },
}

/// Cores by service. Empty leaves the choice to the operating system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Placement {
    /// Core of the bridge.
    pub bridge_core: Option<usize>,
    /// Core of the coordinator.
    pub coordinator_core: Option<usize>,
    /// Cores of the servos, in turn.
    pub servo_cores: Vec<usize>,
}

impl Placement {
    /// The core of this service.
    pub fn core_of(&self, service: ServiceId) -> Option<usize> {
        match service {
            ServiceId::Bridge => self.bridge_core,
            ServiceId::Coordinator => self.coordinator_core,
            ServiceId::Servo(robot) => {
                robot.checked_rem(self.servo_cores.len()).map(|index| self.servo_cores[index])
            }
        }
    }
}

/// Where a service is: the phase that it executes, or waits to execute.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// The tick.
    pub tick: u64,
    /// How many of the service's phases of this tick are behind it.
    pub phase: usize,
}

impl Position {
    /// Behind the last tick of any run.
    pub const END: Self = Self { tick: u64::MAX, phase: 0 };

    /// More phases in a tick than any service has.
    const PHASE_BITS: u32 = 4;

    pub(crate) fn to_word(self) -> u64 {
        self.tick << Self::PHASE_BITS | self.phase as u64
    }

    pub(crate) fn from_word(word: u64) -> Self {
        Self { tick: word >> Self::PHASE_BITS, phase: (word & ((1 << Self::PHASE_BITS) - 1)) as usize }
    }

    /// The next one of a service with so many phases in a tick.
    pub fn after(self, phases: usize) -> Self {
        if self.phase + 1 < phases {
            Self { phase: self.phase + 1, ..self }
        } else {
            Self { tick: self.tick.saturating_add(1), phase: 0 }
        }
    }
}

/// No phase waits longer for its inputs than this share of a period, unless what it says is used later than in the
/// next tick: then half of that time is for what comes to it, and half for what goes from it.
const LATEST_START: f64 = 0.9;

/// Why a list of phases is not a schedule.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)]
pub enum ScheduleError {
    #[error("a team has 1 to {MAX_ROBOTS} robots, not {0}")]
    TeamSize(usize),
    #[error("a coordination delay is at most {MAX_COORDINATION_DELAY_TICKS} ticks, not {0}")]
    Age(u64),
    #[error("{0} is published twice in a tick")]
    PublishedTwice(Topic),
    #[error("{service} waits for {topic}, which {from} does not publish")]
    NotPublished { service: ServiceId, topic: Topic, from: ServiceId },
    #[error("{service} waits for {topic} of the same tick, which {from} publishes only later")]
    PublishedTooLate { service: ServiceId, topic: Topic, from: ServiceId },
    #[error("{service} has {call} twice in a tick")]
    CalledTwice { service: ServiceId, call: Call },
}

/// The phases of a tick in canonical order.
#[derive(Clone, Debug, PartialEq)]
pub struct TickSchedule {
    phases: Vec<Phase>,
    clock: Clock,
}

impl TickSchedule {
    /// Publish → sense of each robot → coordinate → act of each robot → step.
    ///
    /// `coordination_delay_ticks` is the age of the team command that a servo uses: 0 in lockstep.
    ///
    /// # Errors
    /// A team without robots or with more than [`MAX_ROBOTS`]; a delay above [`MAX_COORDINATION_DELAY_TICKS`].
    pub fn of_team(
        robots: usize,
        coordination_delay_ticks: u64,
        placement: &Placement,
    ) -> Result<Self, ScheduleError> {
        if !(1..=MAX_ROBOTS).contains(&robots) {
            return Err(ScheduleError::TeamSize(robots));
        }
        let (bridge, coordinator) = (ServiceId::Bridge, ServiceId::Coordinator);
        let phase = |service, call, budget, inputs, outputs| Phase {
            service,
            call,
            inputs,
            outputs,
            core: placement.core_of(service),
            budget,
        };
        let input = |topic, from| Input { topic, from, age_ticks: 0 };

        let mut phases = Vec::with_capacity(2 * robots + 3);
        let mut published: Vec<_> = (0..robots).map(Output::of::<Sensors>).collect();
        published.extend((0..robots).map(Output::of::<RobotTruth>));
        published.push(Output::of::<ObjectTruth>(0));
        // The budgets share out one period along the critical path, on which all servos run at once;
        // physics takes most of it.
        phases.push(phase(bridge, Call::Publish, 0.05, vec![], published));
        phases.extend((0..robots).map(|r| {
            phase(
                ServiceId::Servo(r),
                Call::Sense,
                0.1,
                vec![input(Topic::of::<Sensors>(r), bridge)],
                vec![Output::of::<RobotState>(r)],
            )
        }));
        let mut commands: Vec<_> = (0..robots).map(Output::of::<TeamCommand>).collect();
        commands.push(Output::of::<TeamState>(0));
        phases.push(phase(
            coordinator,
            Call::Coordinate,
            0.1,
            (0..robots).map(|r| input(Topic::of::<RobotState>(r), ServiceId::Servo(r))).collect(),
            commands,
        ));
        phases.extend((0..robots).map(|r| {
            let command = Input {
                topic: Topic::of::<TeamCommand>(r),
                from: coordinator,
                age_ticks: coordination_delay_ticks,
            };
            phase(ServiceId::Servo(r), Call::Act, 0.25, vec![command], vec![Output::of::<JointCommand>(r)])
        }));
        phases.push(phase(
            bridge,
            Call::Step,
            0.5,
            (0..robots).map(|r| input(Topic::of::<JointCommand>(r), ServiceId::Servo(r))).collect(),
            vec![],
        ));
        Self::new(phases)
    }

    /// A schedule of these phases, in this order.
    ///
    /// # Errors
    /// An input that has no producer, or whose producer comes later in the same tick; a topic that is
    /// published twice; a call that a service has twice; an age above [`MAX_COORDINATION_DELAY_TICKS`].
    pub fn new(phases: Vec<Phase>) -> Result<Self, ScheduleError> {
        for (index, phase) in phases.iter().enumerate() {
            let (service, call) = (phase.service, phase.call);
            if phases[..index].iter().any(|other| (other.service, other.call) == (service, call)) {
                return Err(ScheduleError::CalledTwice { service, call });
            }
            for &Input { topic, from, age_ticks } in &phase.inputs {
                if age_ticks > MAX_COORDINATION_DELAY_TICKS {
                    return Err(ScheduleError::Age(age_ticks));
                }
                let produces =
                    |p: &Phase| p.service == from && p.outputs.iter().any(|output| output.topic == topic);
                match phases.iter().position(produces) {
                    None => return Err(ScheduleError::NotPublished { service, topic, from }),
                    Some(producer) if age_ticks == 0 && producer >= index => {
                        return Err(ScheduleError::PublishedTooLate { service, topic, from });
                    }
                    Some(_) => {}
                }
            }
        }
        let schedule = Self { phases, clock: Clock::Lockstep };
        let mut topics: Vec<_> = schedule.outputs().map(|(_, output)| output.topic).collect();
        topics.sort_unstable();
        match topics.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(ScheduleError::PublishedTwice(pair[0])),
            None => Ok(schedule),
        }
    }

    /// The same phases by another clock.
    pub fn with_clock(self, clock: Clock) -> Self {
        Self { clock, ..self }
    }

    /// What makes a tick begin.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// The service whose phase opens the tick.
    pub fn opener(&self) -> Option<ServiceId> {
        self.phases.first().map(|phase| phase.service)
    }

    /// When a phase must start at the latest, in periods from the tick's beginning, so that it and all that
    /// wait for it keep to their budgets; at most [`LATEST_START`] and half the ticks after the next one in which what
    /// it says is used.
    pub fn latest_start(&self, phase: &Phase) -> f64 {
        let Some(index) = self.phases.iter().position(|other| other == phase) else { return 0.0 };
        let mut latest = vec![1.0_f64; self.phases.len()];
        for index in (0..self.phases.len()).rev() {
            let phase = &self.phases[index];
            let patience = self.oldest_use(phase).saturating_sub(1) as f64 / 2.0;
            let waits_for_it =
                |input: &&Input| phase.outputs.iter().any(|output| output.topic == input.topic);
            let mut end = 1.0 + patience;
            for (later, other) in self.phases.iter().enumerate() {
                for input in other.inputs.iter().filter(waits_for_it) {
                    // Who comes earlier in the tick uses what is older.
                    let start = if later > index { latest[later] } else { 0.0 };
                    end = end.min(start + input.age_ticks as f64);
                }
                if later > index && other.service == phase.service {
                    end = end.min(latest[later]);
                }
            }
            latest[index] = (end - phase.budget).clamp(0.0, LATEST_START + patience);
        }
        latest[index]
    }

    /// The phases in canonical order.
    pub fn phases(&self) -> &[Phase] {
        &self.phases
    }

    /// The phases of one service, in order.
    pub fn phases_of(&self, service: ServiceId) -> impl Iterator<Item = &Phase> {
        self.phases.iter().filter(move |phase| phase.service == service)
    }

    /// The services in the order in which they first appear in a tick.
    pub fn services(&self) -> Vec<ServiceId> {
        let mut services = Vec::new();
        for phase in &self.phases {
            if !services.contains(&phase.service) {
                services.push(phase.service);
            }
        }
        services
    }

    /// All frames of a tick with their publishers, in canonical order: the order of a run's identity.
    pub fn outputs(&self) -> impl Iterator<Item = (ServiceId, &Output)> {
        self.phases.iter().flat_map(|phase| phase.outputs.iter().map(move |output| (phase.service, output)))
    }

    /// Who publishes this topic.
    pub fn producer_of(&self, topic: Topic) -> Option<ServiceId> {
        self.outputs().find(|(_, output)| output.topic == topic).map(|(service, _)| service)
    }

    /// Who waits for this topic, and how old a frame each uses.
    pub fn consumers_of(&self, topic: Topic) -> impl Iterator<Item = (ServiceId, &Input)> {
        self.phases.iter().flat_map(move |phase| {
            phase
                .inputs
                .iter()
                .filter(move |input| input.topic == topic)
                .map(move |input| (phase.service, input))
        })
    }

    /// The services that wait for nobody: what their phase needs has been published. When nothing moves
    /// any more, it is they who keep all others waiting.
    pub fn unhindered(&self, position_of: impl Fn(ServiceId) -> Position) -> Vec<ServiceId> {
        let is_published = |input: &Input, tick: u64| {
            let phase = self.phase_of(input.topic).unwrap_or_default();
            position_of(input.from) > Position { tick, phase }
        };
        let waits_for_nobody = |service: &ServiceId| {
            let Position { tick, phase } = position_of(*service);
            let phase = self.phases_of(*service).nth(phase);
            let inputs = phase.map(|phase| phase.inputs.as_slice()).unwrap_or_default();
            inputs.iter().all(|input| input.tick_at(tick).is_none_or(|tick| is_published(input, tick)))
        };
        let has_not_ended = |service: &ServiceId| position_of(*service) != Position::END;
        self.services().into_iter().filter(has_not_ended).filter(waits_for_nobody).collect()
    }

    /// The age of the oldest frame of this phase that somebody uses.
    pub fn oldest_use(&self, phase: &Phase) -> u64 {
        let ages = phase.outputs.iter().flat_map(|output| self.consumers_of(output.topic));
        ages.map(|(_, input)| input.age_ticks).max().unwrap_or(0)
    }

    /// Where among all outputs of its publisher this topic is.
    pub(crate) fn place_among_outputs(&self, topic: Topic) -> Option<usize> {
        let phases = self.phases_of(self.producer_of(topic)?);
        phases.flat_map(|phase| &phase.outputs).position(|output| output.topic == topic)
    }

    /// Which of its publisher's phases publishes this topic.
    pub fn phase_of(&self, topic: Topic) -> Option<usize> {
        let publishes = |phase: &Phase| phase.outputs.iter().any(|output| output.topic == topic);
        self.phases_of(self.producer_of(topic)?).position(publishes)
    }

    /// The input of a service by this topic.
    pub fn input_of(&self, service: ServiceId, topic: Topic) -> Option<&Input> {
        self.consumers_of(topic).find(|(consumer, _)| *consumer == service).map(|(_, input)| input)
    }
}

impl fmt::Display for TickSchedule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fn list(items: impl Iterator<Item = String>) -> String {
            let items: Vec<_> = items.collect();
            if items.is_empty() { "-".into() } else { items.join(" ") }
        }
        let rows: Vec<[String; 6]> = self
            .phases
            .iter()
            .map(|phase| {
                let input = |input: &Input| match input.age_ticks {
                    0 => input.topic.to_string(),
                    age => format!("{}@k-{age}", input.topic),
                };
                [
                    phase.service.to_string(),
                    phase.call.to_string(),
                    phase.core.map_or("any".into(), |core| core.to_string()),
                    format!("{:.0} %", 100.0 * phase.budget),
                    list(phase.inputs.iter().map(input)),
                    list(phase.outputs.iter().map(|output| output.topic.to_string())),
                ]
            })
            .collect();
        let titles = ["service", "call", "core", "budget", "waits for", "publishes"].map(String::from);
        let width = |column: usize| {
            rows.iter().chain([&titles]).map(|row| row[column].len()).max().unwrap_or_default()
        };
        let widths: [usize; 6] = core::array::from_fn(width);
        for row in core::iter::once(&titles).chain(&rows) {
            let line = row.iter().zip(widths).map(|(cell, width)| format!("{cell:<width$}"));
            writeln!(f, "{}", line.collect::<Vec<_>>().join("  ").trim_end())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn team_of(robots: usize, delay_ticks: u64) -> TickSchedule {
        TickSchedule::of_team(robots, delay_ticks, &Placement::default()).expect("a valid team")
    }

    #[test]
    fn a_tick_runs_from_sensors_to_physics() {
        let schedule = team_of(2, 0);
        let order: Vec<_> =
            schedule.phases().iter().map(|phase| format!("{} {}", phase.service, phase.call)).collect();
        assert_eq!(
            order,
            [
                "bridge publish",
                "servo-0 sense",
                "servo-1 sense",
                "coordinator coordinate",
                "servo-0 act",
                "servo-1 act",
                "bridge step"
            ]
        );
        assert_eq!(schedule.phases_of(ServiceId::Servo(1)).count(), 2);
        assert_eq!(schedule.services().len(), 4);
    }

    #[test]
    fn every_topic_of_every_team_has_one_producer() {
        for robots in 1..=MAX_ROBOTS {
            let schedule = team_of(robots, 0);
            for (service, output) in schedule.outputs() {
                assert_eq!(schedule.producer_of(output.topic), Some(service));
            }
            assert_eq!(schedule.outputs().count(), 5 * robots + 2);
        }
    }

    #[test]
    fn ground_truth_and_the_team_state_have_no_consumer() {
        let schedule = team_of(3, 0);
        for (_, output) in schedule.outputs() {
            let consumed = schedule.consumers_of(output.topic).count() > 0;
            assert_eq!(consumed, output.audience == Audience::Everyone, "{}", output.topic);
        }
    }

    #[test]
    fn servos_use_a_command_of_the_scheduled_age() {
        let schedule = team_of(2, 3);
        let input = schedule.input_of(ServiceId::Servo(1), Topic::of::<TeamCommand>(1)).expect("an input");
        assert_eq!(input.tick_at(2), None);
        assert_eq!(input.tick_at(3), Some(0));
        assert!(schedule.to_string().contains("team-command[1]@k-3"));
    }

    #[test]
    fn an_input_without_a_producer_is_rejected() {
        let mut phases = team_of(2, 0).phases().to_vec();
        phases[1].outputs.clear();
        assert!(matches!(TickSchedule::new(phases), Err(ScheduleError::NotPublished { .. })));
    }

    #[test]
    fn an_input_of_the_same_tick_must_be_published_earlier_in_it() {
        let mut phases = team_of(2, 0).phases().to_vec();
        phases.swap(1, 3);
        assert!(matches!(TickSchedule::new(phases), Err(ScheduleError::PublishedTooLate { .. })));
        // A command of the tick before may come later in the tick.
        let mut phases = team_of(2, 1).phases().to_vec();
        phases.swap(3, 4);
        assert!(TickSchedule::new(phases).is_ok());
    }

    #[test]
    fn a_topic_has_one_publisher_and_a_service_one_phase_by_call() {
        let mut phases = team_of(2, 0).phases().to_vec();
        let twice = phases[1].outputs[0];
        phases[2].outputs.push(twice);
        assert_eq!(TickSchedule::new(phases), Err(ScheduleError::PublishedTwice(twice.topic)));

        let mut phases = team_of(2, 0).phases().to_vec();
        phases.push(phases[0].clone());
        assert!(matches!(TickSchedule::new(phases), Err(ScheduleError::CalledTwice { .. })));
    }

    #[test]
    fn a_phase_is_due_when_all_that_follows_it_can_still_keep_to_its_budget() {
        let due = |delay_ticks, call| {
            let schedule = team_of(2, delay_ticks);
            let phase = schedule.phases().iter().find(|phase| phase.call == call).expect("it is there");
            (1e6 * schedule.latest_start(phase)).round() / 1e6
        };
        // All in one tick.
        assert_eq!(due(0, Call::Step), 0.5);
        assert_eq!(due(0, Call::Act), 0.25);
        assert_eq!(due(0, Call::Coordinate), 0.15);
        assert_eq!(due(0, Call::Sense), 0.05);
        // The coordinator has until the next tick.
        assert_eq!(due(1, Call::Coordinate), 0.9);
        assert_eq!(due(1, Call::Sense), 0.15);
        // Further away half the way is for what comes, half for what goes.
        assert_eq!(due(2, Call::Coordinate), 1.4);
        assert_eq!(due(6, Call::Coordinate), 3.4);
        assert_eq!(due(6, Call::Act), 0.25);
        assert_eq!(due(6, Call::Sense), 0.15);
    }

    #[test]
    fn team_size_and_delay_are_bounded() {
        let of_team = |robots, delay| TickSchedule::of_team(robots, delay, &Placement::default());
        assert_eq!(of_team(0, 0), Err(ScheduleError::TeamSize(0)));
        assert_eq!(of_team(MAX_ROBOTS + 1, 0), Err(ScheduleError::TeamSize(MAX_ROBOTS + 1)));
        assert_eq!(
            of_team(4, MAX_COORDINATION_DELAY_TICKS + 1),
            Err(ScheduleError::Age(MAX_COORDINATION_DELAY_TICKS + 1))
        );
    }

    /// Where a team of two stops that stops one service at this position.
    fn standstill(schedule: &TickSchedule, stopped: ServiceId, at: Position) -> Vec<ServiceId> {
        let mut positions: Vec<_> =
            schedule.services().into_iter().map(|service| (service, Position::default())).collect();
        loop {
            let before = positions.clone();
            let position_of =
                |id: ServiceId| before.iter().find(|(service, _)| *service == id).expect("it is there").1;
            let free = schedule.unhindered(position_of);
            for (service, position) in &mut positions {
                if free.contains(service) && (*service != stopped || *position < at) {
                    position.phase += 1;
                    if position.phase == schedule.phases_of(*service).count() {
                        *position = Position { tick: position.tick + 1, phase: 0 };
                    }
                }
            }
            if positions == before {
                assert_eq!(position_of(stopped), at);
                return free;
            }
        }
    }

    #[test]
    fn whoever_stops_is_the_only_one_who_waits_for_nobody() {
        for delay_ticks in [0, 1, 3] {
            let schedule = team_of(2, delay_ticks);
            for service in schedule.services() {
                for phase in 0..schedule.phases_of(service).count() {
                    for tick in [0, 5] {
                        let found = standstill(&schedule, service, Position { tick, phase });
                        assert_eq!(found, [service], "{service} at phase {phase} of tick {tick}");
                    }
                }
            }
        }
    }

    #[test]
    fn at_first_all_wait_for_the_world_and_then_for_one_another() {
        let schedule = team_of(2, 0);
        assert_eq!(schedule.unhindered(|_| Position::default()), [ServiceId::Bridge]);
        let after_sensors = |id| Position { tick: 0, phase: usize::from(id == ServiceId::Bridge) };
        assert_eq!(schedule.unhindered(after_sensors), [ServiceId::Servo(0), ServiceId::Servo(1)]);
    }

    #[test]
    fn who_has_ended_keeps_nobody_waiting() {
        let schedule = team_of(2, 0);
        assert_eq!(schedule.unhindered(|_| Position::END), []);
        let in_last_step = Position { tick: 9, phase: 1 };
        let position_of = |id| if id == ServiceId::Bridge { in_last_step } else { Position::END };
        assert_eq!(schedule.unhindered(position_of), [ServiceId::Bridge]);
    }

    #[test]
    fn servos_take_their_cores_in_turn() {
        let placement = Placement { bridge_core: Some(0), coordinator_core: None, servo_cores: vec![2, 3] };
        let schedule = TickSchedule::of_team(3, 0, &placement).expect("a valid team");
        let core = |service| schedule.phases_of(service).next().and_then(|phase| phase.core);
        assert_eq!(core(ServiceId::Bridge), Some(0));
        assert_eq!(core(ServiceId::Coordinator), None);
        assert_eq!([0, 1, 2].map(|r| core(ServiceId::Servo(r))), [Some(2), Some(3), Some(2)]);
    }

    #[test]
    fn budgets_along_the_critical_path_share_out_one_period() {
        let schedule = team_of(1, 0);
        let total: f64 = schedule.phases().iter().map(|phase| phase.budget).sum();
        assert!((total - 1.0).abs() < 1e-12);
    }
}
