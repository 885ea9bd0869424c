//! The team of the hold scenario stands and holds, and what it can't reach is named.

#![allow(non_snake_case)]

use mikoshi_config::{LoadedScenario, load_scenario};
use mikoshi_humanoid::{Kinematics, Model};
use mikoshi_resolution::resolve;
use mikoshi_spatial::{Base, Foot, Hand, Object, Pose, World};
use std::path::Path;

fn hold(overrides: &[(&str, &str)]) -> LoadedScenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
    let overrides: Vec<_> =
        overrides.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    load_scenario(&path, &overrides, None).expect("the scenario can be loaded")
}

#[test]
fn every_robot_stands_on_its_soles_and_holds_what_it_should() {
    let run = resolve(&hold(&[])).expect("the grasps are reachable");
    assert_eq!(run.ticks, 4400);
    assert_eq!(run.robots.len(), 4);
    for robot in &run.robots {
        let model = Model::from_urdf(&robot.urdf, &|_| None).expect("it has no meshes");
        let mut kinematics = Kinematics::new(&model);
        let X_WB = Pose::<World, Base>::from_array(&robot.initial_base_pose).expect("a pose");
        kinematics.update(&model, &X_WB, &robot.initial_posture_rad);

        let (yaw, member) = (robot.member.yaw_deg.to_radians(), &robot.member);
        for (foot, side) in robot.config.feet.iter().zip([-0.5, 0.5]) {
            let sole = model.find_frame(&foot.sole_link).expect("it is there");
            let X_WF: Pose<World, Foot> = kinematics.frame_pose(&model, sole);
            assert!(X_WF.translation.z.abs() < 1e-3, "{} stands at {}", member.name, X_WF.translation.z);
            assert!((X_WF.rotation.angle() - yaw.abs()).abs() < 1e-3);
            let aside_m = side * robot.config.foot_spacing_m;
            let expected = [member.x_m - aside_m * yaw.sin(), member.y_m + aside_m * yaw.cos()];
            let [x, y] = [X_WF.translation.x, X_WF.translation.y];
            assert!(
                (x - expected[0]).abs() < 1e-3 && (y - expected[1]).abs() < 1e-3,
                "{}: {x} {y}",
                member.name
            );
        }
        let com = kinematics.com();
        assert!((com.x - member.x_m).abs() < 1e-3 && (com.y - member.y_m).abs() < 1e-3);
        assert!((com.z - robot.config.com_height_m).abs() < 1e-3);

        let X_WA = Pose::<World, Object>::new(run.scenario.object.position_m.into(), Default::default());
        for (&hand, X_AH) in robot.grasping_hands.iter().zip(&robot.hand_in_object) {
            let palm = model.find_frame(&robot.config.hands[hand].palm_link).expect("it is there");
            let X_WH: Pose<World, Hand> = kinematics.frame_pose(&model, palm);
            let expected = X_WA * Pose::<Object, Hand>::from_array(X_AH).expect("a pose");
            let error = expected.displacement_to(&X_WH);
            assert!(error.linear.norm() < 2e-4 && error.angular.norm() < 2e-4, "{error:?}");
        }
        for (joint, angle) in model.joints().iter().zip(&robot.initial_posture_rad) {
            let margin = (angle - joint.lower).min(joint.upper - angle);
            assert!(margin > 3.0_f64.to_radians(), "{} of {}", joint.name, member.name);
        }
    }
}

#[test]
fn the_encoded_run_is_accepted_by_those_who_decode_it() {
    let run = resolve(&hold(&[("team", "two")])).expect("the grasps are reachable");
    let decoded = mikoshi_config::RunSpec::decode(&run.encode()).expect("it is whole");
    assert_eq!(decoded, run);
}

#[test]
fn a_palm_that_hangs_in_the_air_is_named_with_its_distance() {
    let error = resolve(&hold(&[("robots.2.x_m", "0.75")])).expect_err("C stands too far away");
    let (place, text) =
        error.to_string().split_once(": ").map(|(a, b)| (a.to_owned(), b.to_owned())).unwrap();
    assert!(place.contains("teams/four.toml:"), "{place}");
    assert_eq!(
        text,
        "robots.2: unreachable grasp: the right palm of robot C is 100 mm off the object's surface, expected at most 20 mm"
    );
    let error = resolve(&hold(&[("robots.0.x_m", "-0.6")])).expect_err("A stands too near");
    assert!(error.to_string().contains("robot A is 50 mm inside the object's surface"), "{error}");
}

#[test]
fn a_hand_that_does_not_come_to_its_grasp_is_named_with_what_is_in_its_way() {
    let mut loaded = hold(&[("object.position_m", "[0, 0, 1.36]")]);
    let model = loaded.models.get_mut("hrp2").expect("it is in the team");
    for hand in &mut model.config.hands {
        hand.carry_position_m[2] += 0.4;
    }
    let error = resolve(&loaded).expect_err("that is overhead");
    let text = error.to_string();
    assert!(text.contains("teams/four.toml:") && text.contains(": robots.0: unreachable grasp: "), "{text}");
    assert!(text.contains("hand of robot A"), "{text}");
}

#[test]
fn names_that_the_urdf_lacks_are_found_in_the_file_that_uses_them() {
    let lacks = |change: fn(&mut mikoshi_config::RobotConfig)| {
        let mut loaded = hold(&[]);
        change(&mut loaded.models.get_mut("hrp2").expect("it is in the team").config);
        resolve(&loaded).expect_err("there is no such thing").to_string()
    };
    let error = lacks(|config| config.hands[1].palm_link = "nowhere".into());
    assert!(
        error.contains("hrp2.toml:") && error.contains("hands.1.palm_link: found \"nowhere\""),
        "{error}"
    );
    let error = lacks(|config| {
        config.carry_posture_deg.insert("RLEG_JOINT9".into(), 1.0);
    });
    assert!(error.contains("carry_posture_deg.RLEG_JOINT9: found"), "{error}");
    let error = lacks(|config| {
        config.carry_posture_deg.remove("HEAD_JOINT1");
    });
    assert!(
        error.contains("hrp2.toml:") && error.contains("carry_posture_deg.HEAD_JOINT1: found nothing"),
        "{error}"
    );
    let error = lacks(|config| {
        config.carry_posture_deg.insert("RLEG_JOINT3".into(), -90.0);
    });
    assert!(error.contains("RLEG_JOINT3: found -90, expected") && error.contains("limits"), "{error}");
}
