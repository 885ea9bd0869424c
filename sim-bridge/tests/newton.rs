//! What is called true is held against Newton's law, and what sensors say against what is true; in the
//! closed loop of two robots and one object, with both grasps.

mod common;

use common::{Seen, constant_commands, look, pose, standing_team, swinging_commands, wrench};
use mikoshi_humanoid::Model;
use mikoshi_physics::{GRAVITY_M_S2, Physics as _};
use mikoshi_sim_bridge::World;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

const GRASPS: [&str; 2] = ["hold", "hold_spring"];

fn gravity() -> Vector3<f64> {
    Vector3::new(0.0, 0.0, -GRAVITY_M_S2)
}

/// Sum of the hands' wrenches on the object, about a point.
fn hands_on_object(seen: &Seen, about: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let hands = seen.robots.iter().flat_map(|robot| robot.hand_wrench[..2].iter().zip(&robot.hand_pose));
    hands.fold((Vector3::zeros(), Vector3::zeros()), |(f, n), (wire, hand)| {
        let (force, moment) = wrench(wire);
        let arm = pose(hand).translation.vector - about;
        (f + force, n + moment + arm.cross(&force))
    })
}

#[test]
fn hand_wrenches_move_the_object_by_newtons_and_eulers_laws() {
    for grasp in GRASPS {
        // One physics step a tick, so that accelerations are exact quotients of velocities.
        let run = standing_team(grasp, &[("team", "two"), ("control_period_s", "0.001")]);
        let mut world = World::new(&run).expect("a world");
        let mass_kg = run.scenario.object.mass_kg;
        let [x, y, z] = run.scenario.object.size_m.map(|edge| edge * edge);
        let inertia = Matrix3::from_diagonal(&(Vector3::new(y + z, x + z, x + y) * mass_kg / 12.0));
        let dt = run.scenario.control_period_s;
        let mut fastest = 0.0_f64;
        let mut before = look(&world);
        for tick in 1..400 {
            world.step(&swinging_commands(&run, tick as f64 * dt, 0.03)).expect("physics");
            let after = look(&world);
            // The step's forces act at the configuration before it.
            let at = pose(&before.object.pose);
            let mut there = look(&world);
            for (robot, old) in there.robots.iter_mut().zip(&before.robots) {
                robot.hand_pose = old.hand_pose;
            }
            let (force, moment) = hands_on_object(&there, &at.translation.vector);
            let (v0, w0) = wrench(&before.object.twist);
            let (v1, w1) = wrench(&after.object.twist);
            let newton = (v1 - v0) / dt * mass_kg - gravity() * mass_kg;
            // Euler's equation in the object's axes.
            let to_body = |v: &Vector3<f64>, wire| pose(wire).rotation.inverse() * v;
            let (w0, w1) = (to_body(&w0, &before.object.pose), to_body(&w1, &after.object.pose));
            // The integrator is implicit in the gyroscopic term, which it linearises about the old rates.
            let spin = |w: &Vector3<f64>| w.cross(&(inertia * w));
            let gyroscopic = spin(&w1) - spin(&(w1 - w0));
            let euler = inertia * (w1 - w0) / dt + gyroscopic;
            assert!((force - newton).norm() < 1e-6 * (1.0 + newton.norm()), "{grasp}: {force} {newton}");
            let moment = at.rotation.inverse() * moment;
            assert!((moment - euler).norm() < 1e-6 * (1.0 + euler.norm()), "{grasp}: {moment} {euler}");
            fastest = fastest.max((v1 - v0).norm() / dt);
            before = after;
        }
        assert!(fastest > 0.5, "{grasp}: the object must have been shaken, it saw {fastest} m/s²");
    }
}

/// A team at rest.
fn settled(grasp: &str) -> (mikoshi_config::RunSpec, Seen) {
    let run = standing_team(grasp, &[("team", "two")]);
    let mut world = World::new(&run).expect("a world");
    let commands = constant_commands(&run);
    for _ in 0..600 {
        world.step(&commands).expect("physics");
    }
    let seen = look(&world);
    (run, seen)
}

#[test]
fn wrist_sensors_and_the_weight_of_the_hand_give_the_wrench_on_the_object() {
    for grasp in GRASPS {
        let (run, seen) = settled(grasp);
        for ((spec, truth), sensors) in run.robots.iter().zip(&seen.robots).zip(&seen.sensors) {
            let model = Model::from_urdf(&spec.urdf, &|_| None).expect("a robot");
            for (index, hand) in spec.config.hands.iter().enumerate() {
                let (sensor, palm) = (
                    model.find_frame(&hand.sensor_link).unwrap(),
                    model.find_frame(&hand.palm_link).unwrap(),
                );
                let carried = model.carried_inertial(sensor);
                let palm_in_sensor = model.frame(sensor).pose.inverse() * model.frame(palm).pose;
                let in_world = pose(&truth.hand_pose[index]) * palm_in_sensor.inverse();
                let (force, moment) = wrench(&sensors.wrist_wrench[index]);
                // The arm bears the hand and pushes the object: all in the sensor's axes.
                let weight = in_world.rotation.inverse() * gravity() * carried.mass_kg;
                let force = force + weight;
                let moment =
                    moment + carried.com.cross(&weight) - palm_in_sensor.translation.vector.cross(&force);
                let (true_force, true_moment) = wrench(&truth.hand_wrench[index]);
                assert!(true_force.norm() > 1.0, "{grasp}: the hand carries");
                assert!((in_world.rotation * force - true_force).norm() < 2e-3, "{grasp}: {force}");
                assert!((in_world.rotation * moment - true_moment).norm() < 2e-3, "{grasp}: {moment}");
            }
        }
    }
}

#[test]
fn ankle_sensors_feel_the_ground() {
    let (_, seen) = settled("hold");
    for (truth, sensors) in seen.robots.iter().zip(&seen.sensors) {
        for foot in 0..2 {
            // The sensor lies in the sole's frame and carries nothing that weighs.
            let sole = pose(&truth.sole_pose[foot]);
            let (force, moment) = wrench(&sensors.ankle_wrench[foot]);
            let (force, moment) = (sole.rotation * force, sole.rotation * moment);
            let (ground, about_origin) = wrench(&truth.ground_wrench[foot]);
            let ground_moment = about_origin - sole.translation.vector.cross(&ground);
            // What the leg applies to the sole is the opposite of what the ground applies.
            assert!((force + ground).norm() < 0.05, "{force} {ground}");
            assert!((moment + ground_moment).norm() < 0.05, "{moment} {ground_moment}");
        }
    }
}

#[test]
fn ground_and_hands_carry_a_robot_at_rest() {
    for grasp in GRASPS {
        let (run, seen) = settled(grasp);
        for (spec, truth) in run.robots.iter().zip(&seen.robots) {
            let model = Model::from_urdf(&spec.urdf, &|_| None).expect("a robot");
            let com = Vector3::from(truth.com_position_m);
            let mut force = gravity() * model.total_mass_kg();
            let mut moment = com.cross(&force);
            for (foot, hand) in truth.ground_wrench.iter().zip(truth.hand_wrench.iter().zip(&truth.hand_pose))
            {
                let (ground_force, ground_moment) = wrench(foot);
                let (hand_force, hand_moment) = wrench(hand.0);
                force += ground_force - hand_force;
                moment += ground_moment - hand_moment - pose(hand.1).translation.vector.cross(&hand_force);
            }
            assert!(force.norm() < 0.2 && moment.norm() < 0.2, "{grasp}: {force} {moment}");
        }
    }
}

#[test]
fn an_imu_at_rest_feels_gravity_and_no_rotation() {
    let (_, seen) = settled("hold");
    for sensors in &seen.sensors {
        let specific_force = Vector3::from(sensors.imu_specific_force_m_s2);
        assert!((specific_force.norm() - GRAVITY_M_S2).abs() < 1e-2, "{specific_force}");
        // The chest leans 10.1° forwards, so that up lies behind the IMU's z axis.
        let lean = UnitQuaternion::from_euler_angles(0.0, 10.1_f64.to_radians(), 0.0);
        assert!((lean * specific_force - Vector3::new(0.0, 0.0, GRAVITY_M_S2)).norm() < 0.1);
        assert!(Vector3::from(sensors.imu_angular_velocity_rad_s).norm() < 1e-3);
    }
}

#[test]
fn drives_hold_what_gravity_and_contact_ask_of_them() {
    let (run, seen) = settled("hold");
    for (spec, (truth, sensors)) in run.robots.iter().zip(seen.robots.iter().zip(&seen.sensors)) {
        let model = Model::from_urdf(&spec.urdf, &|_| None).expect("a robot");
        for (index, joint) in model.joints().iter().enumerate() {
            let torque_nm = sensors.joint_torque_nm[index];
            assert!((torque_nm.abs() - truth.joint_torque_peak_nm[index]).abs() < 0.05, "{}", joint.name);
            assert_eq!(sensors.joint_position_rad[index], truth.joint_position_rad[index]);
        }
        assert_eq!(truth.saturated_joints, 0);
    }
}
