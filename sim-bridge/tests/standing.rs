//! Four robots stand with constant commands, the object in their hands: nothing is controlled, and the
//! bodies, drives, soles and grasps must bear it.

mod common;

use common::{constant_commands, look, pose, standing_team};
use mikoshi_physics::Physics as _;
use mikoshi_sim_bridge::{World, world_xml};

/// 10 s; the largest horizontal displacement of a sole.
fn stand(scenario: &str) -> f64 {
    let run = standing_team(scenario, &[]);
    let mut world = World::new(&run).expect("a world");
    let start = look(&world);
    let commands = constant_commands(&run);
    let mut slip_m = 0.0_f64;
    for _ in 0..2000 {
        world.step(&commands).expect("physics");
        let now = look(&world);
        assert_eq!(now.object.unintended_contacts, 0);
        for (truth, first) in now.robots.iter().zip(&start.robots) {
            assert_eq!((truth.fallen, truth.saturated_joints), (0, 0));
            assert!(truth.zmp_margin_m > 0.03, "margin {}", truth.zmp_margin_m);
            for (sole, at_start) in truth.sole_pose.iter().zip(&first.sole_pose) {
                let moved = pose(sole).translation.vector - pose(at_start).translation.vector;
                slip_m = slip_m.max(moved.xy().norm());
            }
        }
    }
    let (now, first) = (pose(&look(&world).object.pose), pose(&start.object.pose));
    assert!((now.translation.vector - first.translation.vector).norm() < 0.01);
    assert!(now.rotation.angle_to(&first.rotation) < 0.01);
    slip_m
}

#[test]
fn four_robots_stand_with_a_welded_object_and_their_soles_stick() {
    let slip_m = stand("hold");
    assert!(slip_m < 0.5e-3, "slip {slip_m}");
}

#[test]
fn four_robots_stand_with_a_sprung_object_and_their_soles_stick() {
    let slip_m = stand("hold_spring");
    assert!(slip_m < 0.5e-3, "slip {slip_m}");
}

#[test]
fn teams_of_any_size_stand_at_tick_0_and_touch_nothing_but_object_and_ground() {
    for (team, robots) in [("two", 2), ("three", 3), ("five", 5), ("eight", 8)] {
        let run = standing_team("hold", &[("team", team)]);
        let world = World::new(&run).expect("a world");
        let seen = look(&world);
        assert_eq!((world.robot_count(), seen.object.robot_count), (robots, robots as u64));
        let names = seen.object.unintended_pair.map(|geom| world.geom_name((geom as usize).wrapping_sub(1)));
        assert_eq!(seen.object.unintended_contacts, 0, "{team}: {names:?}");
        assert!(seen.robots.iter().all(|truth| truth.fallen == 0 && truth.zmp_margin_m > 0.03));
    }
}

#[test]
fn neighbours_in_a_robot_and_a_grasping_hand_with_the_object_may_touch() {
    let run = standing_team("hold", &[("team", "two")]);
    let xml = world_xml(&run).expect("a world");
    let may_touch = |a: &str, b: &str| xml.contains(&format!(r#"<exclude body1="{a}" body2="{b}"/>"#));
    // Nothing between the waist and the thigh has a shape, though two bodies lie between them.
    assert!(may_touch("A/BODY", "A/RLEG_JOINT2") && may_touch("B/BODY", "B/CHEST_JOINT1"));
    assert!(may_touch("A/r_wrist_sensor+", "object"));
    assert!(!may_touch("A/RARM_JOINT3", "object") && !may_touch("A/RLEG_JOINT2", "A/LLEG_JOINT2"));
}

#[test]
fn a_world_starts_where_the_run_says_and_at_rest() {
    let run = standing_team("hold", &[("grasp.offset_m", "0.0")]);
    let seen = look(&World::new(&run).expect("a world"));
    let object = pose(&seen.object.pose);
    let is_near = |found: &[f64], expected: &[f64]| {
        found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 0.01)
    };
    assert!(is_near(object.translation.vector.as_slice(), &run.scenario.object.position_m));
    assert!(seen.object.twist.iter().all(|rate| rate.abs() < 1e-3), "{:?}", seen.object.twist);
    for ((truth, sensors), spec) in seen.robots.iter().zip(&seen.sensors).zip(&run.robots) {
        assert!(is_near(&truth.base_pose, &spec.initial_base_pose));
        assert!(is_near(&truth.joint_position_rad, &spec.initial_posture_rad));
        assert!(sensors.joint_velocity_rad_s.iter().all(|rate| rate.abs() < 1e-3));
        for (hand, in_object) in truth.hand_pose.iter().zip(&spec.hand_in_object) {
            let gap = (object * pose(in_object)).inverse() * pose(hand);
            assert!(gap.translation.vector.norm() < 1e-3 && gap.rotation.angle() < 5e-3, "{gap}");
        }
        assert!(truth.sole_pose.iter().all(|sole| sole[2].abs() < 1e-3));
        assert!(truth.zmp_margin_m > 0.05 && truth.fallen == 0);
    }
}
