//! The bridge as others see it: what it publishes, what it waits for, and which inputs end a run.

mod common;

use common::{bytes_of, constant_commands, look, standing_team};
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{Frame, JointCommand, ObjectTruth, Payload, RobotTruth, Sensors, ServiceId};
use mikoshi_physics::{BridgeParticipant, Physics as _};
use mikoshi_runtime::{
    Call, InMemoryHub, InMemoryTransport, Loan, Observer, Participant, Placement, Publisher, Tap, TickError,
    TickSchedule, Transport,
};
use mikoshi_sim_bridge::World;

type Port<P> = <InMemoryTransport as Transport>::Publisher<P>;

/// A bridge, and what the servos of its team publish with.
struct Scene {
    run: RunSpec,
    hub: InMemoryHub,
    bridge: BridgeParticipant<InMemoryTransport, World>,
    servos: Vec<Port<JointCommand>>,
}

impl Scene {
    fn new() -> Self {
        let run = standing_team("hold", &[("team", "two")]);
        let schedule = TickSchedule::of_team(2, 0, &Placement::default()).expect("a schedule");
        let hub = InMemoryHub::new(schedule);
        let bridge =
            BridgeParticipant::<_, World>::new(&run, &hub.transport(ServiceId::Bridge)).expect("a bridge");
        let servos = (0..2).map(|r| hub.transport(ServiceId::Servo(r)).publisher(r).expect("a port"));
        Self { servos: servos.collect(), run, hub, bridge }
    }

    fn command(&mut self, robot: usize, tick: u64, command: JointCommand) {
        let mut loan = self.servos[robot].loan(tick).expect("room");
        *loan.payload_mut() = command;
        loan.send().expect("a working transport");
    }
}

/// The payload that `observer` sees next.
fn next<P: Payload>(observer: &mut impl Observer<P>) -> P {
    let mut frame = Frame::zeroed();
    assert!(observer.try_receive(&mut frame).expect("a readable frame"));
    frame.payload
}

#[test]
fn a_bridge_publishes_its_world_and_steps_it_by_all_commands() {
    let mut scene = Scene::new();
    let mut world = World::new(&scene.run).expect("a world");
    let tap = scene.hub.tap();
    let mut sensors = [0, 1].map(|r| tap.observer::<Sensors>(r).expect("an observer"));
    let mut robots = [0, 1].map(|r| tap.observer::<RobotTruth>(r).expect("an observer"));
    let mut object = tap.observer::<ObjectTruth>(0).expect("an observer");
    let commands = constant_commands(&scene.run);
    for tick in 0..5 {
        scene.bridge.execute(Call::Publish, tick).expect("a tick");
        let heard = |mut sensors: Sensors| {
            // What the bridge adds to its world's.
            assert_eq!(core::mem::take(&mut sensors.next_joint_command_tick), tick);
            sensors
        };
        let seen = common::Seen {
            sensors: sensors.iter_mut().map(next).map(heard).collect(),
            robots: robots.iter_mut().map(next).collect(),
            object: next(&mut object),
        };
        assert!(bytes_of(&seen) == bytes_of(&look(&world)));
        for (robot, command) in commands.iter().enumerate() {
            scene.command(robot, tick, *command);
        }
        scene.bridge.execute(Call::Step, tick).expect("a tick");
        world.step(&commands).expect("physics");
    }
    assert_eq!(scene.bridge.world().tick(), 5);
}

#[test]
fn a_robot_that_sends_another_ticks_frame_ends_the_run_before_physics() {
    let mut scene = Scene::new();
    let command = constant_commands(&scene.run)[0];
    scene.bridge.execute(Call::Publish, 0).expect("a tick");
    scene.command(0, 0, command);
    scene.command(1, 7, command);
    let error = scene.bridge.execute(Call::Step, 0).expect_err("it is of another tick");
    assert!(matches!(error, TickError::FutureTick { expected: 0, found: 7, .. }), "{error}");
    assert_eq!(scene.bridge.world().tick(), 0);
}

#[test]
fn drives_of_a_robot_that_says_nothing_go_on_and_come_to_rest_and_the_next_readings_say_so() {
    let mut scene = Scene::new();
    let commands = constant_commands(&scene.run);
    let tap = scene.hub.tap();
    let mut sensors = [0, 1].map(|robot| tap.observer::<Sensors>(robot).expect("an observer"));
    let mut heard = vec![];
    for tick in 0..60 {
        scene.bridge.execute(Call::Publish, tick).expect("a tick");
        heard.push(sensors.each_mut().map(|port| next(port).next_joint_command_tick));
        scene.command(0, tick, commands[0]);
        if tick < 2 || tick == 59 {
            let mut command = commands[1];
            command.joint_position_ref_rad[3] += 1e-3 * tick as f64;
            command.joint_velocity_ref_rad_s[3] = 0.2;
            scene.command(1, tick, command);
        }
        scene.bridge.execute(Call::Step, tick).expect("a tick");
        if tick == 58 {
            let coasted = scene.bridge.world().commands()[1];
            let gone = coasted.joint_position_ref_rad[3] - commands[1].joint_position_ref_rad[3];
            assert!((0.005..0.012).contains(&gone), "it came {gone} rad far");
            assert!(coasted.joint_velocity_ref_rad_s[3].abs() < 1e-3);
        }
    }
    assert_eq!(heard[..4], [[0, 0], [1, 1], [2, 2], [3, 2]]);
    assert_eq!(heard[59], [59, 2]);
}

#[test]
fn drives_hold_what_they_were_told_last_where_a_command_can_not_be_and_the_next_readings_say_so() {
    for wild in [f64::NAN, f64::INFINITY, 100.0] {
        let mut scene = Scene::new();
        let commands = constant_commands(&scene.run);
        let tap = scene.hub.tap();
        let mut sensors = [0, 1].map(|robot| tap.observer::<Sensors>(robot).expect("an observer"));
        for tick in 0..3 {
            scene.bridge.execute(Call::Publish, tick).expect("a tick");
            let rejected = sensors.each_mut().map(|port| next(port).command_rejected);
            assert_eq!(rejected, if tick == 2 { [0, 1] } else { [0, 0] }, "{wild}, tick {tick}");
            scene.command(0, tick, commands[0]);
            let mut command = commands[1];
            if tick == 1 {
                command.joint_position_ref_rad[3] = wild;
            }
            scene.command(1, tick, command);
            scene.bridge.execute(Call::Step, tick).expect("a tick");
            assert_eq!(
                scene.bridge.world().commands()[1].joint_position_ref_rad,
                commands[1].joint_position_ref_rad
            );
        }
    }
}

#[test]
fn a_bridge_has_no_other_calls_and_does_not_skip_ticks() {
    let mut scene = Scene::new();
    assert_eq!(scene.bridge.execute(Call::Act, 0), Err(TickError::UnknownCall));
    assert!(matches!(scene.bridge.execute(Call::Publish, 1), Err(TickError::Service(_))));
    assert_eq!(scene.bridge.id(), ServiceId::Bridge);
}
