//! What every transport does, asked of all of them.
//!
//! Faulty publishers come first: they are made of sound ones by writing into the envelope of what they
//! have loaned.

use super::iceoryx::{IceoryxLoan, IceoryxTap, IceoryxTransport};
use super::memory::{InMemoryHub, InMemoryLoan, InMemoryTap, InMemoryTransport};
use super::{ConnectError, Loan, OBSERVER_DEPTH, Observer, Publisher, Subscriber, Tap, Transport};
use crate::{
    Board, Entry, Member, Placement, Role, RunDirectory, TickError, TickSchedule, Topic, WaitPolicy,
};
use core::cell::RefCell;
use mikoshi_ipc_types::{
    Envelope, Frame, JointCommand, ObjectTruth, Payload, RobotState, Sensors, ServiceId, TeamCommand,
};
use std::os::unix::fs::PermissionsExt;

/// Lets faulty doubles lie about who they are.
trait Forge {
    fn envelope_mut(&mut self) -> &mut Envelope;
}

impl<P: Payload> Forge for InMemoryLoan<'_, P> {
    fn envelope_mut(&mut self) -> &mut Envelope {
        &mut self.publisher.frame.envelope
    }
}

impl<P: Payload> Forge for IceoryxLoan<'_, P> {
    fn envelope_mut(&mut self) -> &mut Envelope {
        &mut self.sample.payload_mut().envelope
    }
}

/// A run whose services all live in this thread.
trait Run {
    type Transport: Transport;
    type Tap: Tap;

    fn of(schedule: TickSchedule) -> Self;
    fn transport(&self, service: ServiceId) -> Self::Transport;
    fn tap(&self) -> Self::Tap;
}

struct InMemory {
    hub: InMemoryHub,
}

impl Run for InMemory {
    type Transport = InMemoryTransport;
    type Tap = InMemoryTap;

    fn of(schedule: TickSchedule) -> Self {
        Self { hub: InMemoryHub::new(schedule) }
    }

    fn transport(&self, service: ServiceId) -> InMemoryTransport {
        self.hub.transport(service)
    }

    fn tap(&self) -> InMemoryTap {
        self.hub.tap()
    }
}

struct Iceoryx {
    schedule: TickSchedule,
    /// Handles are shared: a transport that is dropped here stays on the board.
    transports: RefCell<Vec<(ServiceId, IceoryxTransport)>>,
    run: RunDirectory,
    _base: tempfile::TempDir,
}

impl Iceoryx {
    fn member(&self, role: Role) -> Member {
        Member::join(self.run.path(), role, WaitPolicy::default(), Entry::Vacant)
            .expect("a place on the board")
    }

    /// Ends a service whose ports have been dropped.
    fn end(&self, service: ServiceId) {
        self.transports.borrow_mut().retain(|(other, _)| *other != service);
    }
}

impl Run for Iceoryx {
    type Transport = IceoryxTransport;
    type Tap = IceoryxTap;

    fn of(schedule: TickSchedule) -> Self {
        let base = tempfile::Builder::new()
            .permissions(std::fs::Permissions::from_mode(0o700))
            .tempdir()
            .expect("a directory");
        let run = RunDirectory::create(base.path()).expect("a run");
        Board::create(run.path(), &schedule.services(), false).expect("a board");
        Self { schedule, transports: RefCell::default(), run, _base: base }
    }

    fn transport(&self, service: ServiceId) -> IceoryxTransport {
        let mut transports = self.transports.borrow_mut();
        if let Some((_, transport)) = transports.iter().find(|(other, _)| *other == service) {
            return transport.clone();
        }
        let member = self.member(Role::Service(service));
        let transport = IceoryxTransport::open(self.run.path(), member, &self.schedule).expect("ports");
        transports.push((service, transport.clone()));
        transport
    }

    fn tap(&self) -> IceoryxTap {
        IceoryxTap::open(self.run.path(), self.member(Role::Tap), &self.schedule).expect("ports")
    }
}

const BRIDGE: ServiceId = ServiceId::Bridge;
const SERVO: ServiceId = ServiceId::Servo(1);

fn schedule() -> TickSchedule {
    TickSchedule::of_team(2, 0, &Placement::default()).expect("a valid team")
}

type PublisherOf<R, P> = <<R as Run>::Transport as Transport>::Publisher<P>;
type SubscriberOf<R, P> = <<R as Run>::Transport as Transport>::Subscriber<P>;

/// The bridge's sensors of robot 1, from one end to the other.
fn sensors<R: Run>(run: &R) -> (PublisherOf<R, Sensors>, SubscriberOf<R, Sensors>) {
    let subscriber = run.transport(SERVO).subscriber(1).expect("an input");
    (run.transport(BRIDGE).publisher(1).expect("an output"), subscriber)
}

fn send(publisher: &mut impl Publisher<Sensors>, tick: u64) {
    send_value(publisher, tick, tick as f64);
}

fn send_value(publisher: &mut impl Publisher<Sensors>, tick: u64, value: f64) {
    let mut loan = publisher.loan(tick).expect("room");
    loan.payload_mut().joint_position_rad[63] = value;
    loan.send().expect("it is sent");
}

fn receive(subscriber: &mut impl Subscriber<Sensors>, tick: u64) -> Result<Frame<Sensors>, TickError> {
    let mut frame = Frame::zeroed();
    subscriber.receive(tick, &mut frame).map(|()| frame)
}

const SENSORS: Topic = Topic::of::<Sensors>(1);

/// What a publisher does wrong.
type Lie = fn(&mut dyn Forge);

/// A publisher that lies in one envelope; the frame that was received before must survive.
fn assert_rejected<R: Run>(lie: Lie, expected: TickError)
where
    for<'a> <PublisherOf<R, Sensors> as Publisher<Sensors>>::Loan<'a>: Forge,
{
    let run = R::of(schedule());
    let (mut publisher, mut subscriber) = sensors(&run);
    let mut frame = Frame::zeroed();
    send(&mut publisher, 7);
    subscriber.receive(7, &mut frame).expect("a sound frame");

    let mut loan = publisher.loan(8).expect("room");
    lie(&mut loan);
    loan.send().expect("it is sent");
    assert_eq!(subscriber.receive(8, &mut frame), Err(expected));
    assert_eq!((frame.envelope.tick, frame.payload.joint_position_rad[63]), (7, 7.0));
}

fn a_publisher_that_skips_a_tick_is_caught<R: Run>() {
    let run = R::of(schedule());
    let (mut publisher, mut subscriber) = sensors(&run);
    send(&mut publisher, 0);
    send(&mut publisher, 2);
    receive(&mut subscriber, 0).expect("it is there");
    let skipped = TickError::FutureTick { topic: SENSORS, expected: 1, found: 2 };
    assert_eq!(receive(&mut subscriber, 1).expect_err("it was skipped"), skipped);
}

fn a_publisher_that_repeats_old_ticks_is_passed_over<R: Run>() {
    let run = R::of(schedule());
    let (mut publisher, mut subscriber) = sensors(&run);
    for tick in [0, 0, 1, 0, 1, 2] {
        send(&mut publisher, tick);
        if tick == 1 {
            let _ = receive(&mut subscriber, 1).map(|frame| assert_eq!(frame.envelope.tick, 1));
        }
    }
    let frame = receive(&mut subscriber, 2).expect("it is there");
    assert_eq!((frame.envelope.tick, frame.payload.joint_position_rad[63]), (2, 2.0));
}

fn a_frame_that_is_repeated_with_other_content_is_used_once<R: Run>() {
    let run = R::of(schedule());
    let (mut publisher, mut subscriber) = sensors(&run);
    send_value(&mut publisher, 0, 1.0);
    send_value(&mut publisher, 0, 2.0);
    send_value(&mut publisher, 1, 3.0);
    assert_eq!(receive(&mut subscriber, 0).expect("the first").payload.joint_position_rad[63], 1.0);
    assert_eq!(receive(&mut subscriber, 1).expect("the next").payload.joint_position_rad[63], 3.0);
}

fn a_frame_of_another_robot_is_rejected<R: Run>()
where
    for<'a> <PublisherOf<R, Sensors> as Publisher<Sensors>>::Loan<'a>: Forge,
{
    let expected = TickError::WrongRobot { topic: SENSORS, found: 0 };
    assert_rejected::<R>(|loan| loan.envelope_mut().robot = 0, expected);
}

fn a_frame_of_another_schema_is_rejected<R: Run>()
where
    for<'a> <PublisherOf<R, Sensors> as Publisher<Sensors>>::Loan<'a>: Forge,
{
    let expected = TickError::WrongSchema { topic: SENSORS };
    assert_rejected::<R>(|loan| loan.envelope_mut().schema_hash ^= 1, expected);
}

fn a_frame_of_an_epoch_that_was_not_announced_is_rejected<R: Run>()
where
    for<'a> <PublisherOf<R, Sensors> as Publisher<Sensors>>::Loan<'a>: Forge,
{
    let expected = TickError::WrongEpoch { topic: SENSORS, announced: 1, found: 2 };
    assert_rejected::<R>(|loan| loan.envelope_mut().epoch = 2, expected);
}

fn frames_of_a_fenced_epoch_are_passed_over<R: Run>()
where
    for<'a> <PublisherOf<R, Sensors> as Publisher<Sensors>>::Loan<'a>: Forge,
{
    let run = R::of(schedule());
    let (mut publisher, mut subscriber) = sensors(&run);
    let mut loan = publisher.loan(0).expect("room");
    loan.envelope_mut().epoch = 0;
    loan.send().expect("it is sent");
    send(&mut publisher, 0);
    assert_eq!(receive(&mut subscriber, 0).expect("the other").envelope.epoch, 1);
}

fn values_that_are_not_finite_are_rejected<R: Run>() {
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let run = R::of(schedule());
        let (mut publisher, mut subscriber) = sensors(&run);
        send_value(&mut publisher, 3, value);
        let expected = TickError::NotFinite { topic: SENSORS, tick: 3, field: "joint_position_rad" };
        assert_eq!(receive(&mut subscriber, 3).expect_err("it is not finite"), expected);
    }
}

fn a_publisher_that_holds_its_frame_back_gets_no_second_one<R: Run>() {
    let run = R::of(schedule());
    let (mut publisher, mut subscriber) = sensors(&run);
    // A loan that is dropped is not sent, and leaves nothing behind in the next.
    let mut loan = publisher.loan(0).expect("room");
    loan.payload_mut().joint_position_rad[0] = 1.0;
    drop(loan);
    send(&mut publisher, 0);
    assert_eq!(receive(&mut subscriber, 0).expect("the second").payload.joint_position_rad[0], 0.0);
}

fn frames_arrive_with_all_their_bytes_tick_by_tick<R: Run>() {
    let run = R::of(schedule());
    let (mut publisher, mut subscriber) = sensors(&run);
    for tick in 0..1000 {
        let mut loan = publisher.loan(tick).expect("room");
        assert_eq!(*loan.payload_mut(), bytemuck::Zeroable::zeroed(), "a loan is zeroed");
        let bytes = bytemuck::bytes_of_mut(loan.payload_mut());
        for (index, byte) in bytes.iter_mut().enumerate() {
            // Any finite pattern: the exponent's upper byte stays small.
            *byte = if index % 8 == 7 { 0x3f } else { (index as u64 * 31 + tick) as u8 };
        }
        let sent = *loan.payload_mut();
        loan.send().expect("it is sent");
        let frame = receive(&mut subscriber, tick).expect("it is there");
        assert_eq!(frame.payload, sent);
        let Envelope { schema_hash, epoch, tick: of_tick, robot, .. } = frame.envelope;
        assert_eq!((schema_hash, epoch, of_tick, robot), (Sensors::SCHEMA_HASH, 1, tick, 1));
    }
}

fn a_queue_holds_commands_of_the_oldest_age_in_use<R: Run>() {
    let delay = mikoshi_ipc_types::MAX_COORDINATION_DELAY_TICKS;
    let run = R::of(TickSchedule::of_team(1, delay, &Placement::default()).expect("a valid team"));
    let servo = run.transport(ServiceId::Servo(0));
    let mut commands = servo.subscriber::<TeamCommand>(0).expect("an input");
    let mut publisher = run.transport(ServiceId::Coordinator).publisher::<TeamCommand>(0).expect("an output");
    let mut frame = Frame::zeroed();
    for tick in 0..100 {
        publisher.loan(tick).and_then(Loan::send).expect("it is sent");
        if let Some(used) = tick.checked_sub(delay) {
            commands.receive(used, &mut frame).expect("it is kept");
        }
    }
}

fn services_get_what_the_schedule_gives_them_and_no_more<R: Run>() {
    let run = R::of(schedule());
    let (bridge, servo) = (run.transport(BRIDGE), run.transport(SERVO));
    let not_an_output = |result| matches!(result, Err(ConnectError::NotAnOutput { .. }));
    assert!(not_an_output(bridge.publisher::<JointCommand>(1).map(|_| ())));
    assert!(not_an_output(servo.publisher::<RobotState>(0).map(|_| ())));
    assert!(not_an_output(bridge.publisher::<Sensors>(2).map(|_| ())));
    let not_an_input = |result| matches!(result, Err(ConnectError::NotAnInput { .. }));
    assert!(not_an_input(servo.subscriber::<Sensors>(0).map(|_| ())));
    assert!(not_an_input(servo.subscriber::<RobotState>(1).map(|_| ())));
    assert!(matches!(run.tap().observer::<Sensors>(2), Err(ConnectError::NotPublished { .. })));
}

fn an_observer_sees_every_frame_in_order_ground_truth_included<R: Run>() {
    let run = R::of(schedule());
    let tap = run.tap();
    let mut observer = tap.observer::<ObjectTruth>(0).expect("it is published");
    let mut publisher = run.transport(BRIDGE).publisher::<ObjectTruth>(0).expect("an output");
    let mut frame = Frame::zeroed();
    let depth = OBSERVER_DEPTH as u64;
    for tick in 0..depth {
        publisher.loan(tick).and_then(Loan::send).expect("it is sent");
    }
    for tick in 0..depth {
        assert_eq!(observer.try_receive(&mut frame), Ok(true));
        assert_eq!(frame.envelope.tick, tick);
    }
    assert_eq!(observer.try_receive(&mut frame), Ok(false));
}

fn an_observer_that_stalls_loses_the_oldest_and_stops_nobody<R: Run>() {
    let run = R::of(schedule());
    let tap = run.tap();
    let mut observer = tap.observer::<Sensors>(1).expect("it is published");
    let (mut publisher, mut subscriber) = sensors(&run);
    for tick in 0..1000 {
        send(&mut publisher, tick);
        receive(&mut subscriber, tick).expect("it is there");
    }
    let mut frame = Frame::zeroed();
    assert_eq!(observer.try_receive(&mut frame), Ok(true));
    assert_eq!(frame.envelope.tick, 1000 - OBSERVER_DEPTH as u64);
}

fn an_observer_sees_faulty_values_as_they_are<R: Run>() {
    let run = R::of(schedule());
    let mut observer = run.tap().observer::<Sensors>(1).expect("it is published");
    let (mut publisher, _subscriber) = sensors(&run);
    send_value(&mut publisher, 0, f64::NAN);
    let mut frame = Frame::zeroed();
    assert_eq!(observer.try_receive(&mut frame), Ok(true));
    assert!(frame.payload.joint_position_rad[63].is_nan());
}

macro_rules! conformance {
    ($($question:ident),* $(,)?) => {
        mod in_memory { $( #[test] fn $question() { super::$question::<super::InMemory>(); } )* }
        mod iceoryx { $( #[test] fn $question() { super::$question::<super::Iceoryx>(); } )* }
    };
}

conformance!(
    a_publisher_that_skips_a_tick_is_caught,
    a_publisher_that_repeats_old_ticks_is_passed_over,
    a_frame_that_is_repeated_with_other_content_is_used_once,
    a_frame_of_another_robot_is_rejected,
    a_frame_of_another_schema_is_rejected,
    a_frame_of_an_epoch_that_was_not_announced_is_rejected,
    frames_of_a_fenced_epoch_are_passed_over,
    values_that_are_not_finite_are_rejected,
    a_publisher_that_holds_its_frame_back_gets_no_second_one,
    frames_arrive_with_all_their_bytes_tick_by_tick,
    a_queue_holds_commands_of_the_oldest_age_in_use,
    services_get_what_the_schedule_gives_them_and_no_more,
    an_observer_sees_every_frame_in_order_ground_truth_included,
    an_observer_that_stalls_loses_the_oldest_and_stops_nobody,
    an_observer_sees_faulty_values_as_they_are,
);

// How a wait ends when nothing comes is the one thing in which transports differ.

#[test]
fn in_one_thread_an_input_that_nobody_published_is_missing_at_once() {
    let run = InMemory::of(schedule());
    let (publisher, mut subscriber) = sensors(&run);
    drop(publisher);
    let missing = TickError::InputMissing { topic: SENSORS, tick: 0 };
    assert_eq!(receive(&mut subscriber, 0).expect_err("nobody published it"), missing);
}

#[test]
fn between_processes_a_publisher_that_dies_ends_the_wait_for_it() {
    let run = Iceoryx::of(schedule());
    let (publisher, mut subscriber) = sensors(&run);
    drop(publisher);
    run.end(BRIDGE);
    assert_eq!(receive(&mut subscriber, 0).expect_err("it is gone"), TickError::PeerLost(BRIDGE));
}

#[test]
fn what_a_publisher_sent_before_it_ended_still_arrives() {
    let run = Iceoryx::of(schedule());
    let tap = run.tap();
    let mut observer = tap.observer::<Sensors>(1).expect("it is published");
    let (mut publisher, mut subscriber) = sensors(&run);
    run.transport(SERVO).process.connect();
    for tick in 0..3 {
        // A tap that looks only now and then.
        if tick == 1 {
            assert_eq!(observer.try_receive(&mut Frame::zeroed()), Ok(true));
        }
        send(&mut publisher, tick);
    }
    drop(publisher);
    run.end(BRIDGE);
    for tick in 0..3 {
        assert_eq!(receive(&mut subscriber, tick).expect("it was sent").envelope.tick, tick);
    }
    assert_eq!(receive(&mut subscriber, 3).expect_err("it is gone"), TickError::PeerLost(BRIDGE));
    let mut frame = Frame::zeroed();
    for tick in 1..3 {
        assert_eq!(observer.receive(&mut frame), Ok(true));
        assert_eq!(frame.envelope.tick, tick);
    }
}

#[test]
fn a_request_to_stop_ends_every_wait() {
    let run = Iceoryx::of(schedule());
    let (_publisher, mut subscriber) = sensors(&run);
    run.transport(BRIDGE).member().board().request_stop();
    assert_eq!(receive(&mut subscriber, 0).expect_err("it is stopped"), TickError::Stopped);
}

#[test]
fn another_layout_under_the_same_name_is_not_connected() {
    use iceoryx2::prelude::{NodeBuilder, ipc};
    let run = Iceoryx::of(schedule());
    let config = crate::Domain::of(run.run.path()).config().expect("a configuration");
    let node = NodeBuilder::new().config(&config).create::<ipc::Service>().expect("a node");
    let name = "sensors/1".try_into().expect("a name");
    // As large as `Frame<Sensors>`, but something else.
    let other = node.service_builder(&name).publish_subscribe::<[u64; size_of::<Frame<Sensors>>() / 8]>();
    let _other = other.create().expect("another build's service");
    let refused = run.transport(SERVO).subscriber::<Sensors>(1).map(|_| ()).expect_err("it is another");
    assert!(matches!(refused, ConnectError::Failed { topic: SENSORS, .. }), "{refused}");
}

#[test]
fn runs_side_by_side_do_not_meet() {
    let (one, other) = (Iceoryx::of(schedule()), Iceoryx::of(schedule()));
    let (mut publisher, mut subscriber) = sensors(&one);
    let (mut other_publisher, mut other_subscriber) = sensors(&other);
    send_value(&mut publisher, 0, 1.0);
    send_value(&mut other_publisher, 0, 2.0);
    assert_eq!(receive(&mut subscriber, 0).expect("ours").payload.joint_position_rad[63], 1.0);
    assert_eq!(receive(&mut other_subscriber, 0).expect("theirs").payload.joint_position_rad[63], 2.0);
}

#[test]
fn a_run_needs_no_more_shared_memory_than_it_asks_for_and_leaves_none() {
    let schedule = schedule();
    let run = Iceoryx::of(schedule.clone());
    let tap = run.tap();
    let bridge = run.transport(BRIDGE);
    let (mut publisher, mut subscriber) = sensors(&run);
    let mut observer = tap.observer::<Sensors>(1).expect("it is published");
    for tick in 0..1000 {
        send(&mut publisher, tick);
        receive(&mut subscriber, tick).expect("it is there");
        observer.try_receive(&mut Frame::zeroed()).expect("it is readable");
    }
    let domain = crate::Domain::of(run.run.path());
    let files = domain.shared_memory_files().expect("shared memory");
    // What has been promised, not what has been touched so far.
    let used: u64 = files.iter().map(|file| std::fs::metadata(file).expect("it is there").len()).sum();
    // One of the run's topics: it must fit into what is asked for all of them, and by far.
    let required = super::iceoryx::required_bytes(&schedule);
    assert!(0 < used && used < required / 4, "{used} of {required}");

    drop((publisher, subscriber, observer, tap, bridge));
    drop(run);
    assert!(domain.shared_memory_files().expect("shared memory").is_empty());
}
