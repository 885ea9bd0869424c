//! A configuration is matched to its URDF, or the key that does not fit is named.

use mikoshi_config::{LoadedRobot, RobotConfig, load_robot};
use mikoshi_humanoid::balance::Side;
use mikoshi_robot::{MatchRobotError, Robot};
use std::path::Path;

fn hrp2() -> LoadedRobot {
    let robots = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/robots");
    load_robot(&robots, "hrp2").expect("it loads")
}

fn refusal(change: impl Fn(&mut RobotConfig)) -> MatchRobotError {
    let LoadedRobot { mut config, urdf, .. } = hrp2();
    change(&mut config);
    Robot::new(&config, &urdf).expect_err("it does not fit")
}

#[test]
fn every_role_is_the_frame_that_the_configuration_names() {
    let LoadedRobot { config, urdf, .. } = hrp2();
    let robot = Robot::new(&config, &urdf).expect("it fits");
    let name = |id| robot.model.frame(id).name.as_str();
    for (index, hand) in config.hands.iter().enumerate() {
        assert_eq!(name(robot.palms[index]), hand.palm_link);
        assert_eq!(name(robot.wrist_sensors[index].frame), hand.sensor_link);
    }
    for (side, foot) in Side::BOTH.into_iter().zip(&config.feet) {
        assert_eq!(name(robot.soles[side]), foot.sole_link);
        assert_eq!(name(robot.ankle_sensors[side].frame), foot.sensor_link);
        assert_eq!(robot.sole_rectangles[side].x_max, foot.sole_m[1]);
        assert_eq!(robot.sole_rectangles[side].y_min, foot.sole_m[2]);
    }
    assert_eq!(name(robot.waist), config.waist_link);
    assert_eq!(name(robot.imu), config.imu_link);
    for (joint, angle_rad) in robot.model.joints().iter().zip(&robot.carry_posture_rad) {
        assert_eq!(config.carry_posture_deg[&joint.name].to_radians(), *angle_rad);
    }
}

#[test]
fn a_robot_with_one_hand_moves_that_hand() {
    let LoadedRobot { config, urdf, .. } = hrp2();
    let both = Robot::new(&config, &urdf).expect("it fits");
    let left = both.clone().with_hands(&[1]).expect("it has two");
    assert_eq!(left.palms, [both.palms[1]]);
    assert_eq!(left.wrist_sensors, [both.wrist_sensors[1]]);
    let ik = left.whole_body_ik(0.005).expect("it can be moved");
    assert_eq!(ik.config().hands, left.palms);
    assert_eq!(both.with_hands(&[0, 2]).unwrap_err().key, "hands");
}

#[test]
fn a_link_that_the_urdf_lacks_is_named_by_its_key() {
    assert_eq!(refusal(|config| config.hands[1].palm_link = "hook".into()).key, "hands.1.palm_link");
    assert_eq!(refusal(|config| config.hands[0].sensor_link = "hook".into()).key, "hands.0.sensor_link");
    assert_eq!(refusal(|config| config.feet[1].sole_link = "paw".into()).key, "feet.1.sole_link");
    assert_eq!(refusal(|config| config.feet[0].sensor_link = "paw".into()).key, "feet.0.sensor_link");
    assert_eq!(refusal(|config| config.waist_link = "hip".into()).key, "waist_link");
    let error = refusal(|config| config.imu_link = "gyro".into());
    assert!(error.to_string().starts_with("imu_link: found \"gyro\", expected a link of hrp2.urdf: "));
}

#[test]
fn a_posture_needs_every_joint_within_its_limits_and_no_other() {
    let error = refusal(|config| {
        config.carry_posture_deg.remove("HEAD_JOINT0");
    });
    assert_eq!(error.key, "carry_posture_deg.HEAD_JOINT0");
    assert_eq!(error.problem, "found nothing, expected an angle for every joint of hrp2.urdf");
    let error = refusal(|config| {
        config.carry_posture_deg.insert("TAIL".into(), 0.0);
    });
    assert!(error.problem.starts_with("found \"TAIL\", expected a joint of hrp2.urdf: "), "{error}");
    let error = refusal(|config| {
        config.carry_posture_deg.insert("RLEG_JOINT3".into(), -90.0);
    });
    assert!(error.problem.starts_with("found -90, expected ") && error.problem.contains("limits"), "{error}");
}

#[test]
fn a_urdf_that_is_no_robot_and_a_robot_with_one_foot_are_refused() {
    let LoadedRobot { config, .. } = hrp2();
    assert_eq!(Robot::new(&config, "<robot").unwrap_err().key, "urdf");
    assert_eq!(refusal(|config| drop(config.feet.pop())).key, "feet");
}
