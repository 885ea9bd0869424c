//! What observers are told when something goes wrong: contacts, falls, torques at their limits.

mod common;

use common::{bytes_of, constant_commands, look, pose, standing_team};
use mikoshi_config::RunSpec;
use mikoshi_physics::{Physics, StepWorldError};
use mikoshi_sim_bridge::World;

fn two(overrides: &[(&str, &str)]) -> (RunSpec, World) {
    let mut all = vec![("team", "two")];
    all.extend(overrides);
    let run = standing_team("hold", &all);
    let world = World::new(&run).expect("a world");
    (run, world)
}

/// The index of a joint in HRP-2's description.
fn joint(run: &RunSpec, name: &str) -> usize {
    let model = mikoshi_humanoid::Model::from_urdf(&run.robots[0].urdf, &|_| None).expect("a robot");
    model.find_joint(name).expect("a joint")
}

#[test]
fn an_object_that_touches_a_robot_is_reported_with_the_first_pair() {
    // So wide that it reaches into the chests and bellies.
    let (_, world) = two(&[("object.size_m", "[1.3, 0.3, 0.3]")]);
    let truth = look(&world).object;
    assert!(truth.unintended_contacts > 0);
    let names = truth.unintended_pair.map(|geom| world.geom_name(geom as usize - 1).expect("a geom"));
    assert!(names.contains(&"object"), "{names:?}");
    assert!(names.iter().any(|name| name.starts_with("A/") || name.starts_with("B/")), "{names:?}");
}

#[test]
fn robots_that_touch_each_other_and_themselves_are_reported() {
    let small = ("object.size_m", "[0.1, 0.7, 0.1]");
    let too_close = standing_team(
        "hold",
        &[("team", "two"), small, ("robots.1.x_m", "-0.3"), ("object.position_m", "[3.0, 0.0, 0.96]")],
    );
    let mut knock_kneed = standing_team("hold", &[("team", "two")]);
    for (name, inwards_rad) in [("RLEG_JOINT1", 0.2), ("LLEG_JOINT1", -0.2)] {
        let index = joint(&knock_kneed, name);
        knock_kneed.robots[0].initial_posture_rad[index] = inwards_rad;
    }
    for (run, is_self_contact) in [(too_close, false), (knock_kneed, true)] {
        let world = World::new(&run).expect("a world");
        let pair = look(&world).object.unintended_pair;
        let robots = pair.map(|geom| {
            let name = world.geom_name((geom as usize).wrapping_sub(1)).unwrap_or("nothing");
            name.split('/').next().map(str::to_owned)
        });
        assert_eq!(robots[0] == robots[1], is_self_contact, "{robots:?}");
        assert!(robots.iter().any(|robot| robot.as_deref() == Some("A")), "{robots:?}");
    }
}

#[test]
fn a_robot_whose_legs_give_way_has_fallen_and_stays_fallen() {
    let (run, mut world) = two(&[]);
    assert_eq!(look(&world).robots[0].fallen, 0);
    let mut commands = constant_commands(&run);
    for side in ["R", "L"] {
        commands[0].joint_position_ref_rad[joint(&run, &format!("{side}LEG_JOINT3"))] = 2.6;
        commands[0].joint_position_ref_rad[joint(&run, &format!("{side}LEG_JOINT2"))] = 0.6;
    }
    let mut fallen = vec![];
    for _ in 0..600 {
        world.step(&commands).expect("physics");
        fallen.push(look(&world).robots[0].fallen);
    }
    assert_eq!(fallen.last(), Some(&1));
    assert!(fallen.is_sorted(), "who has fallen stays fallen");
}

#[test]
fn a_drive_at_its_limit_is_reported_and_gives_no_more() {
    let (run, mut world) = two(&[]);
    let (yaw, knee) = (joint(&run, "CHEST_JOINT0"), joint(&run, "RLEG_JOINT3"));
    let mut commands = constant_commands(&run);
    let signs = [1.0, -1.0];
    for (command, sign) in commands.iter_mut().zip(signs) {
        command.joint_position_ref_rad[yaw] += sign * 0.1;
    }
    world.step(&commands).expect("physics");
    let seen = look(&world);
    for ((truth, sensors), sign) in seen.robots.iter().zip(&seen.sensors).zip(signs) {
        assert_eq!(truth.saturated_joints, 1 << yaw);
        // 0.1 rad at 20000 Nm/rad, less what the joint has followed.
        assert!(truth.joint_torque_peak_nm[yaw] > 500.0);
        let torque_nm = sign * sensors.joint_torque_nm[yaw];
        assert!(torque_nm > 20.0 && torque_nm <= 40.0, "{torque_nm}");
        assert!(truth.joint_torque_peak_nm[knee] < 100.0);
    }
}

#[test]
fn references_run_linearly_through_a_tick_and_rates_feed_the_damping_forward() {
    let (run, mut world) = two(&[]);
    let neck = joint(&run, "HEAD_JOINT0");
    let rate_rad_s = 0.4;
    let mut lag_rad = [0.0; 2];
    for (robot, feeds_forward) in [(0, true), (1, false)] {
        let mut commands = constant_commands(&run);
        for _ in 0..200 {
            let command = &mut commands[robot];
            command.joint_position_ref_rad[neck] += rate_rad_s * 0.005;
            command.joint_velocity_ref_rad_s[neck] = if feeds_forward { rate_rad_s } else { 0.0 };
            world.step(&commands).expect("physics");
        }
        let position_rad = look(&world).sensors[robot].joint_position_rad[neck];
        lag_rad[robot] = commands[robot].joint_position_ref_rad[neck] - position_rad;
    }
    // kv / kp · rate = 20 / 500 · 0.4
    assert!((lag_rad[1] - 0.016).abs() < 1e-3, "without feed-forward: {lag_rad:?}");
    assert!(lag_rad[0].abs() < 1e-3, "with feed-forward: {lag_rad:?}");
}

#[test]
fn grasp_offsets_are_drawn_by_seed_within_their_bound() {
    let strain = |seed: &str, offset: &str| {
        let (_, world) = two(&[("seed", seed), ("grasp.offset_m", offset)]);
        let hands = look(&world).robots.into_iter().flat_map(|robot| robot.hand_wrench);
        hands.map(|wrench| wrench[0].hypot(wrench[1])).fold(0.0, f64::max)
    };
    // Without offsets hands carry the object and the sag of their arms; with offsets they strain.
    assert!(strain("0", "0.0") < 10.0 && strain("0", "0.0") == strain("1", "0.0"));
    assert!(strain("0", "0.002") > 10.0 && strain("0", "0.002") != strain("1", "0.002"));

    // A soft spring lets the palms hang where they were, off their places on the object.
    let run = standing_team("hold_spring", &[("team", "two"), ("seed", "4")]);
    let seen = look(&World::new(&run).expect("a world"));
    let object = pose(&seen.object.pose);
    for (robot, spec) in seen.robots.iter().zip(&run.robots) {
        for (hand, nominal) in robot.hand_pose.iter().zip(&spec.hand_in_object) {
            let gap = (object * pose(nominal)).inverse() * pose(hand);
            assert!(gap.translation.vector.amax() < 0.03);
        }
    }
}

#[test]
fn commands_that_no_drive_can_follow_are_refused_and_change_nothing() {
    let (run, mut world) = two(&[]);
    let before = bytes_of(&look(&world));
    let commands = constant_commands(&run);
    assert_eq!(world.step(&commands[..1]), Err(StepWorldError::CommandCount));
    for value in [f64::NAN, f64::INFINITY] {
        let mut bad = commands.clone();
        bad[1].joint_velocity_ref_rad_s[27] = value;
        assert_eq!(world.step(&bad), Err(StepWorldError::NotFinite));
    }
    assert_eq!(world.tick(), 0);
    assert!(bytes_of(&look(&world)) == before);
}

#[test]
fn a_world_that_diverges_says_so() {
    let (run, mut world) = two(&[]);
    let mut commands = constant_commands(&run);
    commands[0].joint_velocity_ref_rad_s[0] = 1e300;
    let outcome = (0..20).try_for_each(|_| world.step(&commands));
    assert_eq!(outcome, Err(StepWorldError::Diverged));
}
