//! A servo that is lost for good in whatever phase of a step: its robot sets its foot down and stands with the
//! team, which holds the object.

use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_coordinator::CoordinatorParticipant;
use mikoshi_ipc_types::{
    FALLBACK_PARTS, Frame, JointCommand, Payload, RobotState, Sensors, ServiceId, ServicePayload,
    TeamCommand, stop_cause,
};
use mikoshi_observation::{Observation, TeamTap};
use mikoshi_physics::BridgeParticipant;
use mikoshi_resolution::{resolve, tick_schedule};
use mikoshi_runtime::{
    Clock, ConnectError, InMemoryHub, InMemoryTransport, OperatorPort, Participant, Subscriber, TickError,
    Topic, Transport, run_in_one_thread,
};
use mikoshi_servo::ServoParticipant;
use mikoshi_sim_bridge::World;
use std::ops::ControlFlow;
use std::path::Path;
use std::rc::Rc;

/// Whether nobody hears what is said of a topic in a tick.
type Silence = Rc<dyn Fn(Topic, u64) -> bool>;

/// The ports of services that do not hear everything.
#[derive(Clone)]
struct Deaf {
    inner: InMemoryTransport,
    silence: Silence,
}

struct DeafSubscriber<P: ServicePayload> {
    inner: <InMemoryTransport as Transport>::Subscriber<P>,
    topic: Topic,
    silence: Silence,
}

impl Transport for Deaf {
    type Publisher<P: Payload> = <InMemoryTransport as Transport>::Publisher<P>;
    type Subscriber<P: ServicePayload> = DeafSubscriber<P>;

    fn publisher<P: Payload>(&self, robot: usize) -> Result<Self::Publisher<P>, ConnectError> {
        self.inner.publisher(robot)
    }

    fn subscriber<P: ServicePayload>(&self, robot: usize) -> Result<Self::Subscriber<P>, ConnectError> {
        let silence = Rc::clone(&self.silence);
        Ok(DeafSubscriber { inner: self.inner.subscriber(robot)?, topic: Topic::of::<P>(robot), silence })
    }

    fn operator(&self) -> OperatorPort {
        self.inner.operator()
    }
}

impl<P: ServicePayload> Subscriber<P> for DeafSubscriber<P> {
    fn receive(&mut self, tick: u64, frame: &mut Frame<P>) -> Result<(), TickError> {
        match (self.silence)(self.topic, tick) {
            true => Err(TickError::InputMissing { topic: self.topic, tick }),
            false => self.inner.receive(tick, frame),
        }
    }
}

fn participant(run: &RunSpec, service: ServiceId, ports: &Deaf) -> Box<dyn Participant> {
    match service {
        ServiceId::Bridge => Box::new(BridgeParticipant::<_, World>::new(run, ports).expect("a bridge")),
        ServiceId::Coordinator => Box::new(CoordinatorParticipant::new(run, ports).expect("a coordinator")),
        ServiceId::Servo(robot) => Box::new(ServoParticipant::new(run, robot, ports).expect("a servo")),
    }
}

/// A team that walks at this speed.
fn walk(team: &str, speed_m_s: f64, acceleration_m_s2: &str, operator: &str) -> RunSpec {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/transport.toml");
    let travel = format!("[{}, 0.05, 0.0]", speed_m_s * 9.0);
    let overrides = [
        ("team", team),
        ("operator.script", operator),
        ("duration_s", "11.0"),
        ("motion.start_s", "1.5"),
        ("motion.random.duration_s", "9.0"),
        ("motion.random.travel_m", &travel),
        ("motion.random.travel_rad", "[0.0, 0.0, 0.05]"),
        ("motion.acceleration_m_s2", acceleration_m_s2),
    ];
    let overrides = overrides.map(|(key, value)| (key.to_owned(), value.to_owned()));
    resolve(&load_scenario(&scenario, &overrides, None).expect("a scenario")).expect("a run")
}

/// What became of a team some of whose frames are not heard.
#[derive(Clone, Debug, Default)]
struct Fate {
    /// Cause and robot of the safe stop.
    stop: Option<(u64, u64, u64)>,
    stopped_in_the_end: bool,
    fell: u64,
    /// Since the loss.
    margin_min_m: f64,
    tilt_max_rad: f64,
    /// By how much the object moved in the last second, and how far it turned aside or sank since the loss.
    moved_end_m: f64,
    sunk_m: f64,
    strain_max_n: f64,
    /// Of a robot's net force on the object beside its share, on average over the last half second.
    strain_end_n: f64,
    /// Height of the lost robot's higher sole in the end.
    foot_height_end_m: f64,
    /// Least share of its weight that a foot of the lost robot bears.
    foot_share_end: f64,
    speed_at_loss_m_s: f64,
}

fn fate(run: &RunSpec, lost: usize, from: u64, silence: impl Fn(Topic, u64) -> bool + 'static) -> Fate {
    let silence: Silence = Rc::new(silence);
    let schedule = tick_schedule(run).expect("a schedule");
    let hub = InMemoryHub::new(schedule.clone());
    let services = schedule.services().into_iter();
    let ports = |id| Deaf { inner: hub.transport(id), silence: Rc::clone(&silence) };
    let mut participants: Vec<_> = services.map(|id| participant(run, id, &ports(id))).collect();
    let mut tap = TeamTap::new(&hub.tap(), run.robots.len(), Clock::Lockstep).expect("a tap");
    let mut seen = Observation::for_team(run.robots.len());
    let mut fate = Fate { margin_min_m: f64::INFINITY, ..Fate::default() };
    let (mut height_m, mut strain, mut samples) = (None, vec![[0.0; 3]; run.robots.len()], 0.0);
    let mut position_before = [0.0; 3];
    let ended = run_in_one_thread(&schedule, &mut participants, run.ticks, |tick| {
        assert_eq!(tap.try_take_tick(&mut seen), Ok(true));
        let team = &seen.team_state.payload;
        if team.stop_cause != 0 {
            fate.stop.get_or_insert((tick, team.stop_cause, team.stop_robot));
        }
        fate.stopped_in_the_end = team.stop_cause != 0;
        if tick < from {
            return ControlFlow::Continue(());
        }
        let object = &seen.object_truth.payload;
        if tick == from {
            fate.speed_at_loss_m_s = object.twist[..3].iter().map(|v| v * v).sum::<f64>().sqrt();
        }
        let first_m = *height_m.get_or_insert(object.pose[2]);
        fate.sunk_m = fate.sunk_m.max((first_m - object.pose[2]).abs());
        if tick + 200 == run.ticks {
            position_before.copy_from_slice(&object.pose[..3]);
        }
        let moved = |axis: usize| object.pose[axis] - position_before[axis];
        fate.moved_end_m = (0..3).map(|axis| moved(axis).powi(2)).sum::<f64>().sqrt();
        let net: Vec<[f64; 3]> = seen
            .robot_truth
            .iter()
            .map(|robot| {
                core::array::from_fn(|axis| robot.payload.hand_wrench.iter().map(|wrench| wrench[axis]).sum())
            })
            .collect();
        let mean: [f64; 3] =
            core::array::from_fn(|axis| net.iter().map(|f| f[axis]).sum::<f64>() / net.len() as f64);
        let norm = |f: &[f64; 3]| f.iter().map(|v| v * v).sum::<f64>().sqrt();
        for (sum, net) in strain.iter_mut().zip(&net) {
            let own: [f64; 3] = core::array::from_fn(|axis| net[axis] - mean[axis]);
            fate.strain_max_n = fate.strain_max_n.max(norm(&own));
            if tick + 100 >= run.ticks {
                (0..3).for_each(|axis| sum[axis] += own[axis]);
            }
        }
        samples += f64::from(u8::from(tick + 100 >= run.ticks));
        for robot in &seen.robot_truth {
            fate.fell |= robot.payload.fallen;
            fate.margin_min_m = fate.margin_min_m.min(robot.payload.zmp_margin_m);
            fate.tilt_max_rad = fate.tilt_max_rad.max(robot.payload.tilt_rad);
        }
        let robot = &seen.robot_truth[lost].payload;
        let [right, left] = &robot.sole_pose;
        fate.foot_height_end_m = right[2].max(left[2]);
        let [right_n, left_n] = [robot.ground_wrench[0][2], robot.ground_wrench[1][2]];
        fate.foot_share_end = right_n.min(left_n) / (right_n + left_n).max(1.0);
        ControlFlow::Continue(())
    });
    assert_eq!(ended, Ok(run.ticks), "{fate:?}");
    let mean_of = |f: &[f64; 3]| f.iter().map(|v| (v / samples).powi(2)).sum::<f64>().sqrt();
    fate.strain_end_n = strain.iter().map(mean_of).fold(0.0, f64::max);
    fate
}

/// In it the team walks.
const WALKING: u64 = 860;
/// Ticks of a step.
const STEP: u64 = 160;

fn is_of_servo(topic: Topic, robot: usize) -> bool {
    topic == Topic::of::<RobotState>(robot) || topic == Topic::of::<JointCommand>(robot)
}

#[test]
fn for_as_long_as_a_plan_is_for_it_is_what_the_robot_does() {
    const PARTS: u64 = FALLBACK_PARTS as u64;
    let run = walk("four", 0.04, "0.05", "[]");
    let schedule = tick_schedule(&run).expect("a schedule");
    let (hub, silence): (_, Silence) = (InMemoryHub::new(schedule.clone()), Rc::new(|_, _| false));
    let ports = |id| Deaf { inner: hub.transport(id), silence: Rc::clone(&silence) };
    let mut participants: Vec<_> =
        schedule.services().into_iter().map(|id| participant(&run, id, &ports(id))).collect();
    let mut tap = TeamTap::new(&hub.tap(), run.robots.len(), Clock::Lockstep).expect("a tap");
    let mut seen = Observation::for_team(run.robots.len());
    let mut commands: Vec<JointCommand> = vec![];
    let ended = run_in_one_thread(&schedule, &mut participants, 1500, |_| {
        assert_eq!(tap.try_take_tick(&mut seen), Ok(true));
        commands.push(seen.joint_command[1].payload);
        ControlFlow::Continue(())
    });
    assert_eq!(ended, Ok(1500));
    let mut gaps_rad = vec![];
    for (tick, command) in (0..).zip(&commands).skip(WALKING as usize) {
        let at = tick + command.fallback_ahead_ticks;
        let is_for_it = at + 1 < tick + 2 * PARTS + 2 - command.fallback_part;
        let Some(done) = commands.get(at as usize).filter(|_| is_for_it) else { continue };
        let joints = command.fallback_position_rad.iter().zip(&done.joint_position_ref_rad);
        gaps_rad.push(joints.map(|(planned, done)| (planned - done).abs()).fold(0.0, f64::max));
    }
    // Where the object is asked to move otherwise meanwhile, or a foot lands early, it is not foreseen.
    gaps_rad.sort_by(f64::total_cmp);
    assert!(gaps_rad.len() > 40, "{gaps_rad:?}");
    assert!(gaps_rad[gaps_rad.len() * 9 / 10] < 0.02, "{gaps_rad:?}");
}

#[track_caller]
fn expect_a_stand(fate: &Fate, from: u64, lost: usize) {
    let (tick, cause, of) = fate.stop.expect("the team has stopped");
    assert!((from..from + 20).contains(&tick), "{fate:?}");
    assert_eq!((cause, of), (stop_cause::STALE, lost as u64 + 1), "{fate:?}");
    assert!(fate.fell == 0 && fate.tilt_max_rad < 0.02, "{fate:?}");
    assert!(fate.foot_height_end_m < 0.002 && fate.foot_share_end > 0.2, "{fate:?}");
    assert!(fate.sunk_m < 0.01 && fate.moved_end_m < 2e-4, "{fate:?}");
}

#[test]
fn a_robot_whose_servo_is_lost_in_whatever_phase_of_a_step_stands_on_both_feet_with_its_team() {
    let run = walk("four", 0.04, "0.05", "[]");
    for eighth in 0..8 {
        let (from, lost) = (WALKING + eighth * STEP / 8, eighth as usize % 4);
        let fate = fate(&run, lost, from, move |topic, tick| tick >= from && is_of_servo(topic, lost));
        expect_a_stand(&fate, from, lost);
        // At 4.5 s the object is asked to move otherwise, which a plan made before does not know: then it is less.
        assert!(fate.margin_min_m > 0.005 && fate.strain_end_n < 100.0, "{fate:?}");
    }
}

#[test]
fn one_of_two_that_is_lost_at_a_tenth_of_a_metre_per_second_stands_too() {
    let run = walk("two", 0.1, "0.5", "[]");
    for eighth in [1, 5] {
        let (from, lost) = (WALKING + eighth * STEP / 8, eighth as usize / 4);
        let fate = fate(&run, lost, from, move |topic, tick| tick >= from && is_of_servo(topic, lost));
        expect_a_stand(&fate, from, lost);
        assert!(fate.margin_min_m > 0.0 && fate.strain_end_n < 100.0, "{fate:?}");
    }
}

#[test]
fn a_servo_that_comes_back_while_its_plan_is_played_takes_over_and_the_team_goes_on() {
    let run = walk("four", 0.04, "0.05", "[{ at_s = 9.0, says = \"resume\" }]");
    for eighth in [2, 7] {
        let from = WALKING + eighth * STEP / 8;
        let silent = from..from + 40;
        let fate = fate(&run, 1, from, move |topic, tick| silent.contains(&tick) && is_of_servo(topic, 1));
        assert!(fate.stop.is_some() && !fate.stopped_in_the_end, "{fate:?}");
        assert!(fate.fell == 0 && fate.margin_min_m > 0.02 && fate.sunk_m < 0.02, "{fate:?}");
    }
}

/// Whether a frame is one that robot `robot`'s servo says or hears.
fn concerns_servo(topic: Topic, robot: usize) -> bool {
    is_of_servo(topic, robot)
        || topic == Topic::of::<Sensors>(robot)
        || topic == Topic::of::<TeamCommand>(robot)
}

/// What becomes of two robots of which one is cut off while they walk, for this many ticks, and who go on later.
fn cut_off(lost: usize, eighth: u64, ticks: u64) -> Fate {
    // Once it is found it sets its feet where they belong; the team goes on when it stands. Where hands run ahead of
    // feet that are not there yet, a drive comes to its limit, and the team stops once more.
    let words = [12, 14, 16, 18, 20].map(|at_s| format!("{{ at_s = {at_s}.0, says = \"resume\" }}"));
    let mut run = walk("two", 0.1, "0.5", &format!("[{}]", words.join(", ")));
    run.ticks = 4200;
    let from = WALKING + eighth * STEP / 8;
    let silent = from..from + ticks;
    fate(&run, lost, from, move |topic, tick| silent.contains(&tick) && concerns_servo(topic, lost))
}

#[test]
fn a_servo_that_was_cut_off_until_its_plan_was_over_begins_anew_where_its_robot_stands() {
    for eighth in 0..8 {
        let lost = eighth as usize % 2;
        let fate = cut_off(lost, eighth, 650);
        assert!(fate.stop.is_some() && fate.fell == 0, "{eighth}: {fate:?}");
        assert!(
            fate.tilt_max_rad < 0.1 && fate.sunk_m < 0.03 && fate.margin_min_m > 0.0,
            "{eighth}: {fate:?}"
        );
        assert!(!fate.stopped_in_the_end, "{eighth}: {fate:?}");
    }
}

/// Prints what becomes of teams that lose a servo in each of eight phases.
#[test]
#[ignore = "a table, not a test"]
fn table() {
    let of = |name: &str, default: &str| std::env::var(name).unwrap_or_else(|_| default.to_owned());
    let kind = of("KIND", "lost");
    let (team, speed) = (of("TEAM", "four"), of("SPEED", "0.04").parse().expect("a number"));
    let run = walk(&team, speed, &of("ACCELERATION", "0.05"), "[]");
    let robots = of("ROBOTS", "0123").bytes().map(|b| usize::from(b - b'0')).collect::<Vec<_>>();
    let eighths = of("EIGHTHS", "01234567").bytes().map(|b| u64::from(b - b'0')).collect::<Vec<_>>();
    for &robot in robots.iter().filter(|&&robot| robot < run.robots.len()) {
        for &eighth in &eighths {
            let from = WALKING + eighth * STEP / 8;
            let kind = kind.clone();
            let fate = fate(&run, robot, from, move |topic, tick| {
                let state = topic == Topic::of::<RobotState>(robot);
                tick >= from
                    && match kind.as_str() {
                        // The servo lives, and only the team doesn't hear it: a bound from above.
                        "heard" => state,
                        // It lives, and goes on without sensors and commands.
                        "blind" => {
                            state
                                || topic == Topic::of::<Sensors>(robot)
                                || topic == Topic::of::<TeamCommand>(robot)
                        }
                        _ => is_of_servo(topic, robot),
                    }
            });
            println!(
                "{kind_} {team} {speed} {robot} {eighth}: v {:.3} fell {} margin {:5.1} mm tilt {:4.1} mrad object sunk {:4.1} moved {:4.2} mm strain max {:5.1} end {:5.1} N foot {:5.1} mm share {:.2}",
                fate.speed_at_loss_m_s,
                fate.fell,
                fate.margin_min_m * 1e3,
                fate.tilt_max_rad * 1e3,
                fate.sunk_m * 1e3,
                fate.moved_end_m * 1e3,
                fate.strain_max_n,
                fate.strain_end_n,
                fate.foot_height_end_m * 1e3,
                fate.foot_share_end,
                kind_ = of("KIND", "lost"),
            );
        }
    }
}
