//! What this engine calls true is held against Newton's law, and what sensors say against what is true.

#![allow(missing_docs, non_snake_case)]

use bytemuck::Zeroable;
use mikoshi_bridge_rapier::World;
use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_ipc_types::{JointCommand, ObjectTruth, Push, RobotTruth, Sensors};
use mikoshi_physics::{BuildWorldError, GRAVITY_M_S2, Physics, StepWorldError};
use mikoshi_spatial::{Hand, Object, Pose, Wrench};
use mikoshi_tests::scenarios::of_project;
use nalgebra::Vector3;

type InWorld = mikoshi_spatial::World;

fn run(overrides: &[(&str, &str)]) -> RunSpec {
    let overrides: Vec<_> =
        overrides.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let loaded = load_scenario(&of_project("hold"), &overrides, None).expect("a scenario");
    mikoshi_resolution::resolve(&loaded).expect("a run")
}

struct Seen {
    sensors: Vec<Sensors>,
    robots: Vec<RobotTruth>,
    object: ObjectTruth,
}

fn look(world: &World) -> Seen {
    let (mut sensors, mut robots, mut object) = (vec![], vec![], ObjectTruth::zeroed());
    for robot in 0..world.robot_count() {
        sensors.push(Sensors::zeroed());
        world.sense(robot, &mut sensors[robot]);
        robots.push(RobotTruth::zeroed());
        world.robot_truth(robot, &mut robots[robot]);
    }
    world.object_truth(&mut object);
    Seen { sensors, robots, object }
}

fn bytes_of(seen: &Seen) -> Vec<u8> {
    [
        bytemuck::cast_slice(&seen.sensors),
        bytemuck::cast_slice(&seen.robots),
        bytemuck::bytes_of(&seen.object),
    ]
    .concat()
}

/// Commands about those of tick 0: all joints swing.
fn swinging(first: &[JointCommand], time_s: f64) -> Vec<JointCommand> {
    let mut commands = first.to_vec();
    for (command, phase) in commands.iter_mut().zip(0..) {
        let (amplitude, rate) = (0.01, 9.0);
        let angle = rate * time_s + f64::from(phase);
        for (joint, position) in command.joint_position_ref_rad.iter_mut().enumerate().take(20).skip(14) {
            *position += amplitude * (angle.sin() - f64::from(phase).sin()) * (1.0 + joint as f64 / 20.0);
        }
    }
    commands
}

fn linear(wire: &[f64; 6]) -> Vector3<f64> {
    Vector3::new(wire[0], wire[1], wire[2])
}

#[test]
fn hands_move_the_object_by_newtons_law() {
    // One physics step a tick, so that accelerations are exact quotients of velocities.
    let mut world = World::new(&run(&[("team", "two"), ("control_period_s", "0.001")])).expect("a world");
    let (first, mass_kg, dt) = (world.commands().to_vec(), 3.0, 0.001);
    let (mut before, mut fastest) = (look(&world), 0.0_f64);
    for tick in 1..400 {
        world.step(&swinging(&first, f64::from(tick) * dt)).expect("physics");
        let after = look(&world);
        let hands = after.robots.iter().flat_map(|robot| &robot.hand_wrench[..2]);
        let force = hands.map(linear).sum::<Vector3<f64>>();
        let acceleration = (linear(&after.object.twist) - linear(&before.object.twist)) / dt;
        let newton = (acceleration + Vector3::z() * GRAVITY_M_S2) * mass_kg;
        assert!((force - newton).norm() < 1e-6 * (1.0 + newton.norm()), "tick {tick}: {force} {newton}");
        fastest = fastest.max(acceleration.norm());
        before = after;
    }
    assert!(fastest > 0.1, "it has moved: {fastest}");
}

#[test]
fn wrist_sensors_say_what_hands_apply() {
    let run = run(&[("team", "two")]);
    let mut world = World::new(&run).expect("a world");
    let robot = mikoshi_robot::Robot::new(&run.robots[0].config, &run.robots[0].urdf).expect("a robot");
    let commands = world.commands().to_vec();
    (0..200).for_each(|_| world.step(&commands).expect("physics"));
    let seen = look(&world);
    for (index, sensor) in robot.wrist_sensors.iter().enumerate() {
        let X_PalmSensor = {
            let [palm, sensor] =
                [robot.palms[index], sensor.frame].map(|frame| robot.model.frame(frame).pose);
            palm.inv_mul(&sensor)
        };
        let palm: Pose<InWorld, Hand> = Pose::from_array(&seen.robots[0].hand_pose[index]).expect("a pose");
        let R = palm.rotation * X_PalmSensor.rotation;
        let reading = seen.sensors[0].wrist_wrench[index];
        let weight = R.inverse() * Vector3::z() * (GRAVITY_M_S2 * sensor.carried.mass_kg);
        let moment = sensor.carried.com.cross(&weight);
        // At rest the arm bears the hand, and what the hand applies to the object.
        let force = R * (linear(&reading) - weight);
        let moment = R * (Vector3::new(reading[3], reading[4], reading[5]) - moment);
        let from_palm = palm.rotation * X_PalmSensor.translation.vector;
        let on_object = Wrench::<InWorld>::new(force, moment).shifted(&from_palm);
        let truth = Wrench::<InWorld>::from_array(&seen.robots[0].hand_wrench[index]);
        let off = on_object - truth;
        assert!(off.force.norm() < 0.05 && off.moment.norm() < 0.02, "{off:?}, hand {index}");
        assert!(truth.force.norm() > 1.0, "it holds something");
    }
}

#[test]
fn four_robots_stand_and_the_ground_bears_them() {
    let mut world = World::new(&run(&[])).expect("a world");
    let (start, commands) = (look(&world), world.commands().to_vec());
    for _ in 0..400 {
        world.step(&commands).expect("physics");
        let seen = look(&world);
        assert_eq!(seen.object.unintended_contacts, 0);
        assert!(seen.robots.iter().all(|truth| truth.fallen == 0 && truth.saturated_joints == 0));
        assert!(seen.robots.iter().all(|truth| truth.zmp_margin_m > 0.03));
    }
    let seen = look(&world);
    let borne_n: f64 = seen.robots.iter().flat_map(|robot| robot.ground_wrench.map(|foot| foot[2])).sum();
    let run = run(&[]);
    let robots_kg = run.robots.iter().map(|spec| {
        let robot = mikoshi_robot::Robot::new(&spec.config, &spec.urdf).expect("a robot");
        robot.model.total_mass_kg()
    });
    let weight_n = (robots_kg.sum::<f64>() + run.scenario.object.mass_kg) * GRAVITY_M_S2;
    assert!((borne_n - weight_n).abs() < 1e-3 * weight_n, "{borne_n} N of {weight_n} N");
    // Feet say the same as the ground does: what stands on an ankle is all but the foot.
    for (sensors, truth) in seen.sensors.iter().zip(&seen.robots) {
        for (ankle, ground) in sensors.ankle_wrench.iter().zip(&truth.ground_wrench) {
            assert!((-ankle[2] - ground[2]).abs() < 0.05 * ground[2], "{ankle:?} {ground:?}");
        }
    }
    let moved = |truth: &RobotTruth, first: &RobotTruth| {
        let feet = truth.sole_pose.iter().zip(&first.sole_pose);
        feet.map(|(now, then)| (now[0] - then[0]).hypot(now[1] - then[1])).fold(0.0, f64::max)
    };
    let slip_m =
        seen.robots.iter().zip(&start.robots).map(|(now, then)| moved(now, then)).fold(0.0, f64::max);
    assert!(slip_m < 0.5e-3, "slip {slip_m}");
}

#[test]
fn a_world_is_a_function_of_its_run_and_of_the_commands() {
    let noisy = [("team", "two"), ("sensors.force_noise_n", "0.5"), ("sensors.delay_ticks", "2")];
    let play = |seed: &str| {
        let mut world = World::new(&run(&[&noisy[..], &[("seed", seed)]].concat())).expect("a world");
        let first = world.commands().to_vec();
        let said = (0..60).flat_map(|tick| {
            world.step(&swinging(&first, f64::from(tick) * 0.005)).expect("physics");
            bytes_of(&look(&world))
        });
        said.collect::<Vec<u8>>()
    };
    assert!(play("1") == play("1"));
    assert!(play("1") != play("2"));
}

#[test]
fn who_is_pushed_moves() {
    let mut world = World::new(&run(&[("team", "two")])).expect("a world");
    let commands = world.commands().to_vec();
    let before: Pose<InWorld, Object> = Pose::from_array(&look(&world).object.pose).expect("a pose");
    world.push(&Push { number: 1, target: 0, force_n: [0.0, 0.0, 60.0], ticks: 20 });
    for _ in 0..20 {
        world.step(&commands).expect("physics");
        assert_eq!(look(&world).object.push_force_n, [0.0, 0.0, 60.0]);
    }
    let after: Pose<InWorld, Object> = Pose::from_array(&look(&world).object.pose).expect("a pose");
    assert!(after.translation.z - before.translation.z > 0.3e-3, "{before:?} {after:?}");
    world.step(&commands).expect("physics");
    assert_eq!(look(&world).object.push_force_n, [0.0; 3]);
}

#[test]
fn what_this_engine_does_not_do_is_refused() {
    let run = run(&[("team", "two")]);
    let mut world = World::new(&run).expect("a world");
    let mut commands = world.commands().to_vec();
    assert_eq!(world.step(&commands[..1]), Err(StepWorldError::CommandCount));
    commands[1].joint_position_ref_rad[3] = f64::NAN;
    assert_eq!(world.step(&commands), Err(StepWorldError::NotFinite));
    assert!(world.load(&[]).is_err());

    let mut uneven = run.clone();
    uneven.scenario.physics.step_s = 0.003;
    let refused = |run: &RunSpec| match World::new(run) {
        Err(error @ BuildWorldError::Inconsistent { .. }) => error.to_string(),
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("a world"),
    };
    assert!(refused(&uneven).contains("does not divide"));
    let mut with_mesh = run;
    let urdf = &mut with_mesh.robots[0].urdf;
    let find = |text: &str, what: &str, from: usize| from + text[from..].find(what).expect("it is there");
    let a_box = find(urdf, "<box", find(urdf, "<collision", 0));
    let end = find(urdf, "/>", a_box) + 2;
    let mesh = concat!("<mesh filename=\"", env!("CARGO_MANIFEST_DIR"), "/Cargo.toml\"/>");
    urdf.replace_range(a_box..end, mesh);
    let error = World::new(&with_mesh).err().expect("refused").to_string();
    assert!(error.contains("mesh"), "{error}");
}
