//! Boxes that stand in the world: what they do to the object, and who may not touch them.

mod common;

use common::{look, standing_team, wrench};
use mikoshi_config::RunSpec;
use mikoshi_physics::{GRAVITY_M_S2, Physics as _};
use mikoshi_sim_bridge::World;
use nalgebra::Vector3;

/// Two robots hold an object over a box that reaches `depth_m` into it from below.
fn over_a_box(depth_m: f64, more: &str) -> RunSpec {
    let half_height_m = 0.1;
    let z_m = 0.96 - 0.15 + depth_m - half_height_m;
    let fixed = format!(
        r#"[{{name = "pedestal", position_m = [0.1, 0.0, {z_m}], size_m = [0.2, 0.2, 0.2], yaw_deg = 20.0{more}}}]"#
    );
    standing_team("hold", &[("team", "two"), ("world.boxes", &fixed)])
}

#[test]
fn hands_weight_and_boxes_balance_on_an_object_at_rest() {
    let run = over_a_box(0.002, "");
    let seen = look(&World::new(&run).expect("a world"));
    let (support_n, support_nm) = wrench(&seen.object.support_wrench);
    assert!(support_n.z > 10.0, "{support_n}");
    let origin = Vector3::from_column_slice(&seen.object.pose[..3]);
    let mut force_n = support_n - Vector3::z() * run.scenario.object.mass_kg * GRAVITY_M_S2;
    let mut moment_nm = support_nm;
    for robot in &seen.robots {
        for (pose, by_hand) in robot.hand_pose.iter().zip(&robot.hand_wrench) {
            let (f, n) = wrench(by_hand);
            force_n += f;
            moment_nm += n + (Vector3::from_column_slice(&pose[..3]) - origin).cross(&f);
        }
    }
    assert!(force_n.norm() < 0.05 && moment_nm.norm() < 0.05, "{force_n} {moment_nm}");
    assert_eq!(seen.object.unintended_contacts, 0);
}

#[test]
fn a_box_that_does_not_reach_the_object_does_nothing_to_it() {
    let truth = look(&World::new(&over_a_box(-0.01, "")).expect("a world")).object;
    assert_eq!(truth.support_wrench, [0.0; 6]);
}

#[test]
fn the_friction_of_a_box_is_its_own() {
    // Grasps strain the object to all sides, and whatever can hold against that does.
    let tangential = |friction: &str| {
        let truth = look(&World::new(&over_a_box(0.002, friction)).expect("a world")).object;
        (wrench(&truth.support_wrench).0.xy().norm(), truth.support_wrench[2])
    };
    let (smooth_n, normal_n) = tangential(", friction = 0.0");
    assert!(smooth_n < 1e-3 * normal_n, "{smooth_n}");
    let (rough_n, normal_n) = tangential("");
    assert!(rough_n > 0.01 * normal_n, "{rough_n}");
}

#[test]
fn a_robot_that_touches_a_box_is_reported() {
    let in_the_way = r#"[{name = "post", position_m = [-0.55, 0.0, 1.0], size_m = [0.1, 0.1, 0.4]}]"#;
    let run = standing_team("hold", &[("team", "two"), ("world.boxes", in_the_way)]);
    let world = World::new(&run).expect("a world");
    let truth = look(&world).object;
    assert!(truth.unintended_contacts > 0);
    let names = truth.unintended_pair.map(|geom| world.geom_name(geom as usize - 1).expect("a geom"));
    assert!(names.contains(&"world/post"), "{names:?}");
    assert!(names.iter().any(|name| name.starts_with("A/")), "{names:?}");
}
