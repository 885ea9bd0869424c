//! Services that say what can't be, while the team walks: it stops within twenty ticks, nobody falls, and the
//! object stays in its hands.

use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_coordinator::CoordinatorParticipant;
use mikoshi_ipc_types::{
    Frame, JointCommand, Payload, RobotState, Sensors, ServiceId, ServicePayload, TeamCommand, stop_cause,
};
use mikoshi_observation::{Observation, TeamTap};
use mikoshi_physics::BridgeParticipant;
use mikoshi_resolution::{resolve, tick_schedule};
use mikoshi_runtime::{
    Clock, ConnectError, InMemoryHub, InMemoryTransport, Loan, OperatorPort, Participant, Publisher,
    Subscriber, TickError, Topic, Transport, run_in_one_thread,
};
use mikoshi_servo::ServoParticipant;
use mikoshi_sim_bridge::World;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::Path;
use std::rc::Rc;

/// What a double says in place of what it should: the frame's topic and tick, and its payload.
type Spoil = Rc<dyn Fn(Topic, u64, &mut [u8])>;

/// Whether nobody hears what is said of a topic in a tick.
type Silence = Rc<dyn Fn(Topic, u64) -> bool>;

/// The ports of a double.
#[derive(Clone)]
struct Spoilt {
    inner: InMemoryTransport,
    spoil: Spoil,
    silence: Silence,
}

struct DeafSubscriber<P: ServicePayload> {
    inner: <InMemoryTransport as Transport>::Subscriber<P>,
    topic: Topic,
    silence: Silence,
}

impl<P: ServicePayload> Subscriber<P> for DeafSubscriber<P> {
    fn receive(&mut self, tick: u64, frame: &mut Frame<P>) -> Result<(), TickError> {
        match (self.silence)(self.topic, tick) {
            true => Err(TickError::InputMissing { topic: self.topic, tick }),
            false => self.inner.receive(tick, frame),
        }
    }
}

struct SpoiltPublisher<P: Payload> {
    inner: <InMemoryTransport as Transport>::Publisher<P>,
    topic: Topic,
    spoil: Spoil,
}

struct SpoiltLoan<'a, P: Payload> {
    inner: <<InMemoryTransport as Transport>::Publisher<P> as Publisher<P>>::Loan<'a>,
    topic: Topic,
    tick: u64,
    spoil: &'a Spoil,
}

impl Transport for Spoilt {
    type Publisher<P: Payload> = SpoiltPublisher<P>;
    type Subscriber<P: ServicePayload> = DeafSubscriber<P>;

    fn publisher<P: Payload>(&self, robot: usize) -> Result<SpoiltPublisher<P>, ConnectError> {
        let (topic, spoil) = (Topic::of::<P>(robot), Rc::clone(&self.spoil));
        Ok(SpoiltPublisher { inner: self.inner.publisher(robot)?, topic, spoil })
    }

    fn subscriber<P: ServicePayload>(&self, robot: usize) -> Result<Self::Subscriber<P>, ConnectError> {
        let (topic, silence) = (Topic::of::<P>(robot), Rc::clone(&self.silence));
        Ok(DeafSubscriber { inner: self.inner.subscriber(robot)?, topic, silence })
    }

    fn operator(&self) -> OperatorPort {
        self.inner.operator()
    }
}

impl<P: Payload> Publisher<P> for SpoiltPublisher<P> {
    type Loan<'a> = SpoiltLoan<'a, P>;

    fn loan(&mut self, tick: u64) -> Result<SpoiltLoan<'_, P>, TickError> {
        let Self { inner, topic, spoil } = self;
        Ok(SpoiltLoan { inner: inner.loan(tick)?, topic: *topic, tick, spoil })
    }
}

impl<P: Payload> Loan<P> for SpoiltLoan<'_, P> {
    fn payload_mut(&mut self) -> &mut P {
        self.inner.payload_mut()
    }

    fn send(mut self) -> Result<(), TickError> {
        (self.spoil)(self.topic, self.tick, bytemuck::bytes_of_mut(self.inner.payload_mut()));
        self.inner.send()
    }
}

/// A walk in which the operator says what `operator` says.
fn walk(operator: &str) -> RunSpec {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/transport.toml");
    let overrides = [
        ("operator.script", operator),
        ("duration_s", "9.0"),
        ("motion.start_s", "1.5"),
        ("motion.random.duration_s", "6.0"),
        ("motion.random.travel_m", "[0.3, 0.05, 0.0]"),
        ("motion.random.travel_rad", "[0.0, 0.0, 0.05]"),
    ];
    let overrides = overrides.map(|(key, value)| (key.to_owned(), value.to_owned()));
    resolve(&load_scenario(&scenario, &overrides, None).expect("a scenario")).expect("a run")
}

fn participant(run: &RunSpec, service: ServiceId, ports: &Spoilt) -> Box<dyn Participant> {
    match service {
        ServiceId::Bridge => Box::new(BridgeParticipant::<_, World>::new(run, ports).expect("a bridge")),
        ServiceId::Coordinator => Box::new(CoordinatorParticipant::new(run, ports).expect("a coordinator")),
        ServiceId::Servo(robot) => Box::new(ServoParticipant::new(run, robot, ports).expect("a servo")),
    }
}

/// What became of a team one of whose services says something else from a tick on.
#[derive(Debug, Default)]
struct Fate {
    /// First tick of the safe stop, its cause, and whose fault it is.
    stop: Option<(u64, u64, u64)>,
    ticks_stopped: u64,
    fell: u64,
    /// How far the object has come down.
    sunk_m: f64,
    /// Its speed in the end.
    speed_end_m_s: f64,
    margin_min_m: f64,
    tilt_max_rad: f64,
    hand_force_max_n: f64,
}

fn fate(spoil: impl Fn(Topic, u64, &mut [u8]) + 'static) -> Fate {
    fate_of(&walk("[]"), spoil)
}

fn fate_of(run: &RunSpec, spoil: impl Fn(Topic, u64, &mut [u8]) + 'static) -> Fate {
    fate_with(run, spoil, |_, _| false)
}

/// Of a team in which some things are not heard.
fn fate_in_silence(run: &RunSpec, silence: impl Fn(Topic, u64) -> bool + 'static) -> Fate {
    fate_with(run, |_, _, _| (), silence)
}

fn fate_with(
    run: &RunSpec,
    spoil: impl Fn(Topic, u64, &mut [u8]) + 'static,
    silence: impl Fn(Topic, u64) -> bool + 'static,
) -> Fate {
    let silence: Silence = Rc::new(silence);
    let schedule = tick_schedule(run).expect("a schedule");
    let (hub, spoil): (_, Spoil) = (InMemoryHub::new(schedule.clone()), Rc::new(spoil));
    let services = schedule.services().into_iter();
    let mut participants: Vec<_> = services
        .map(|id| {
            participant(
                run,
                id,
                &Spoilt { inner: hub.transport(id), spoil: Rc::clone(&spoil), silence: Rc::clone(&silence) },
            )
        })
        .collect();
    let mut tap = TeamTap::new(&hub.tap(), run.robots.len(), Clock::Lockstep).expect("a tap");
    let mut seen = Observation::for_team(run.robots.len());
    let mut fate = Fate { margin_min_m: f64::INFINITY, ..Fate::default() };
    let mut height_m = None;
    let ended = run_in_one_thread(&schedule, &mut participants, run.ticks, |tick| {
        assert_eq!(tap.try_take_tick(&mut seen), Ok(true));
        let team = &seen.team_state.payload;
        if team.stop_cause != 0 {
            fate.stop.get_or_insert((tick, team.stop_cause, team.stop_robot));
            fate.ticks_stopped += 1;
        }
        let object = &seen.object_truth.payload;
        let first_m = *height_m.get_or_insert(object.pose[2]);
        fate.sunk_m = fate.sunk_m.max(first_m - object.pose[2]);
        fate.speed_end_m_s = object.twist[..3].iter().map(|v| v * v).sum::<f64>().sqrt();
        for robot in &seen.robot_truth {
            fate.fell |= robot.payload.fallen;
            fate.margin_min_m = fate.margin_min_m.min(robot.payload.zmp_margin_m);
            fate.tilt_max_rad = fate.tilt_max_rad.max(robot.payload.tilt_rad);
            for [fx, fy, fz, ..] in robot.payload.hand_wrench {
                let force_n = (fx * fx + fy * fy + fz * fz).sqrt();
                fate.hand_force_max_n = fate.hand_force_max_n.max(force_n);
            }
        }
        ControlFlow::Continue(())
    });
    assert_eq!(ended, Ok(run.ticks), "{fate:?}");
    fate
}

/// Puts a value in one number of a robot's payloads from a tick on.
fn put<P: Payload>(robot: usize, from: u64, field: &'static str, index: usize, value: f64) -> Fate {
    let field = P::FIELDS.iter().find(|found| found.name == field).expect("it has it");
    let at = field.offset_bytes + index * size_of::<f64>();
    fate(move |topic, tick, payload| {
        if topic == Topic::of::<P>(robot) && tick >= from {
            payload[at..at + size_of::<f64>()].copy_from_slice(&value.to_ne_bytes());
        }
    })
}

/// In it the team walks: one foot of every robot is in the air.
const WALKING: u64 = 700;
/// Before it, and after the law has started, all stand.
const STANDING: u64 = 250;

#[track_caller]
fn expect_safe_stop(fate: &Fate, from: u64, cause: u64, robot: usize) {
    let (tick, found, of) = fate.stop.expect("the team has stopped");
    assert!((from..from + 20).contains(&tick), "{fate:?}");
    assert_eq!((found, of), (cause, robot as u64 + 1), "{fate:?}");
    assert_eq!(fate.fell, 0, "{fate:?}");
    assert!(fate.sunk_m < 0.02, "{fate:?}");
    assert!(fate.speed_end_m_s < 0.005, "{fate:?}");
}

#[test]
fn a_team_in_which_all_is_well_does_not_stop() {
    let fate = fate(|_, _, _| ());
    assert_eq!((fate.stop, fate.fell), (None, 0), "{fate:?}");
    assert!(fate.margin_min_m > 0.025, "{fate:?}");
}

#[test]
fn sensors_that_are_not_finite_stop_the_team() {
    for (from, robot) in [(STANDING, 0), (WALKING, 2)] {
        let fate = put::<Sensors>(robot, from, "joint_position_rad", 3, f64::NAN);
        expect_safe_stop(&fate, from, stop_cause::INPUT, robot);
    }
}

#[test]
fn sensors_that_say_what_can_not_be_stop_the_team() {
    let fate = put::<Sensors>(1, WALKING, "imu_angular_velocity_rad_s", 0, 1e6);
    expect_safe_stop(&fate, WALKING, stop_cause::INPUT, 1);
}

#[test]
fn a_servo_that_sends_what_is_not_finite_or_a_huge_force_stops_the_team() {
    for value in [f64::NAN, f64::INFINITY, 1e9] {
        let fate = put::<RobotState>(3, WALKING, "hand_wrench", 1, value);
        expect_safe_stop(&fate, WALKING, stop_cause::INPUT, 3);
    }
}

#[test]
fn a_coordinator_that_sends_what_is_not_finite_or_out_of_reach_stops_the_team() {
    // The last is within reach, but nobody gets there in a tick.
    for value in [f64::NAN, 50.0, -0.5] {
        let fate = put::<TeamCommand>(0, STANDING, "hand_pose_ref", 0, value);
        expect_safe_stop(&fate, STANDING, stop_cause::INPUT, 0);
    }
}

#[test]
fn joint_commands_that_no_drive_can_follow_stop_the_team() {
    for value in [f64::NAN, 100.0] {
        let fate = put::<JointCommand>(2, STANDING, "joint_position_ref_rad", 3, value);
        expect_safe_stop(&fate, STANDING, stop_cause::INPUT, 2);
    }
}

#[test]
fn a_team_whose_sensors_recover_goes_on_when_the_operator_says_so_and_not_before() {
    let run = walk(
        "[{ at_s = 3.6, says = \"resume\" }, { at_s = 5.0, says = \"resume\" }, { at_s = 7.5, says = \"resume\" }]",
    );
    let at = Sensors::FIELDS.iter().find(|field| field.name == "imu_specific_force_m_s2").expect("it has it");
    let at = at.offset_bytes;
    let fate = fate_of(&run, move |topic, tick, payload| {
        if topic == Topic::of::<Sensors>(1) && (WALKING..WALKING + 100).contains(&tick) {
            payload[at..at + size_of::<f64>()].copy_from_slice(&f64::NAN.to_ne_bytes());
        }
    });
    assert_eq!(fate.stop.map(|(_, cause, robot)| (cause, robot)), Some((stop_cause::INPUT, 2)), "{fate:?}");
    // From the fifth bad reading on, to 7.5 s: at 3.6 s its sensors are still wrong, and at five it still steps.
    assert_eq!(fate.ticks_stopped, 1500 - (WALKING + 4), "{fate:?}");
    assert!(fate.fell == 0 && fate.sunk_m < 0.02, "{fate:?}");
}

#[test]
fn whatever_services_say_nobody_panics_and_the_world_stays_a_world() {
    for seed in 0..4 {
        let random = RefCell::new(Pcg64::seed_from_u64(seed));
        let wild = [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300, -1e300, 1e-310, 0.0, -0.0, 1e9, 7.0];
        fate(move |_, tick, payload| {
            let mut random = random.borrow_mut();
            // One frame in twenty, in up to three of its words: by a wild number, or by a flipped bit.
            if tick < 20 || !random.random_bool(0.05) {
                return;
            }
            for _ in 0..random.random_range(1..4) {
                let word = random.random_range(0..payload.len() / 8);
                let bytes = &mut payload[8 * word..8 * word + 8];
                match random.random_bool(0.5) {
                    true => bytes.copy_from_slice(&wild[random.random_range(0..wild.len())].to_ne_bytes()),
                    false => bytes[random.random_range(0..8)] ^= 1 << random.random_range(0..8),
                }
            }
        });
    }
}

/// What a servo says.
fn is_of_servo(topic: Topic, robot: usize) -> bool {
    topic == Topic::of::<RobotState>(robot) || topic == Topic::of::<JointCommand>(robot)
}

/// Ticks of a step.
const STEP: u64 = 160;

#[test]
fn for_a_moment_a_servo_or_the_coordinator_may_be_silent() {
    // As long as it takes until a standby has noticed.
    const GAP: u64 = 4;
    let silent = |tick: u64| tick >= STANDING && (tick / 80).is_multiple_of(2) && tick % 80 < GAP;
    let run = walk("[]");
    let of_servos = fate_in_silence(&run, move |topic, tick| {
        silent(tick) && is_of_servo(topic, (tick / 160) as usize % 4)
    });
    let of_coordinator =
        fate_in_silence(&run, move |topic, tick| silent(tick) && topic.payload == TeamCommand::NAME);
    for fate in [of_servos, of_coordinator] {
        assert_eq!((fate.stop, fate.fell), (None, 0), "{fate:?}");
        assert!(fate.margin_min_m > 0.025, "{fate:?}");
    }
}

#[test]
fn without_their_coordinator_robots_finish_their_step_and_stand() {
    for from in [WALKING, WALKING + STEP / 2] {
        let fate = fate_in_silence(&walk("[]"), move |topic, tick| {
            tick >= from && topic.payload == TeamCommand::NAME
        });
        assert_eq!(fate.fell, 0, "{fate:?}");
        assert!(fate.speed_end_m_s < 0.005 && fate.sunk_m < 0.02, "{fate:?}");
    }
}
