//! `hrp2.urdf` says what `hrp2/parameters.toml` says.

mod common;

use common::{HRP2_URDF, hrp2};
use mikoshi_humanoid::model::{Geometry, JointKind, Model};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

#[derive(Deserialize)]
struct Parameters {
    mass_total: f64,
    sole: Sole,
    foot_force_sensor_z: f64,
    imu_offset: [f64; 3],
    link: Vec<Link>,
}

#[derive(Deserialize)]
struct Sole {
    x_min: f64,
    x_max: f64,
    y_min: f64,
    y_max: f64,
    z: f64,
}

#[derive(Deserialize)]
struct Link {
    name: String,
    parent: Option<String>,
    axis: Option<[f64; 3]>,
    offset: Option<[f64; 3]>,
    limit_deg: Option<[f64; 2]>,
    torque_max: Option<f64>,
    mass: f64,
    com: [f64; 3],
    inertia: [f64; 6],
}

fn parameters() -> Parameters {
    toml::from_str(include_str!("../../../config/robots/hrp2/parameters.toml")).unwrap()
}

fn is_close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-11
}

#[test]
fn every_link_has_the_mass_centre_and_inertia_of_the_parameters() {
    let model = hrp2();
    for link in parameters().link {
        let frame = model.frame(model.find_frame(&link.name).unwrap());
        let [ixx, iyy, izz, ixy, ixz, iyz] = link.inertia;
        let inertia = Matrix3::new(ixx, ixy, ixz, ixy, iyy, iyz, ixz, iyz, izz);
        assert_eq!(frame.inertial.mass_kg, link.mass, "{}", link.name);
        assert_eq!(frame.inertial.com, Vector3::from(link.com), "{}", link.name);
        assert!((frame.inertial.inertia - inertia).norm() < 1e-15, "{}", link.name);
    }
}

#[test]
fn no_other_link_has_mass() {
    let parameters = parameters();
    // The source prints the total with seven digits.
    assert!((hrp2().total_mass_kg() - parameters.mass_total).abs() < 5e-6);
    assert!(is_close(hrp2().total_mass_kg(), parameters.link.iter().map(|link| link.mass).sum()));
}

#[test]
fn every_joint_but_the_grippers_has_the_axis_offset_and_limits_of_the_parameters() {
    let (model, links) = (hrp2(), parameters().link);
    let moving = links.iter().filter(|link| link.parent.is_some() && !link.name.ends_with("ARM_JOINT6"));
    assert_eq!(model.joint_count(), moving.clone().count());
    for link in moving {
        let joint = &model.joints()[model.find_joint(&link.name).unwrap()];
        let [lower, upper] = link.limit_deg.unwrap().map(f64::to_radians);
        assert_eq!(joint.kind, JointKind::Revolute);
        assert_eq!(Some(&model.bodies()[joint.parent_body].name), link.parent.as_ref());
        assert_eq!(joint.axis.into_inner(), Vector3::from(link.axis.unwrap()));
        assert_eq!(joint.origin.translation.vector, Vector3::from(link.offset.unwrap()));
        assert!(is_close(joint.lower, lower) && is_close(joint.upper, upper), "{}", link.name);
        assert_eq!((joint.effort, joint.velocity), (link.torque_max.unwrap(), 3.0));
    }
}

#[test]
fn joints_come_depth_first_and_each_arm_in_a_row() {
    let names: Vec<_> = hrp2().joints().iter().map(|joint| joint.name.clone()).collect();
    let chain = |stem: &str, count| (0..count).map(move |i| format!("{stem}_JOINT{i}")).collect::<Vec<_>>();
    let expected = [
        chain("RLEG", 6),
        chain("LLEG", 6),
        chain("CHEST", 2),
        chain("HEAD", 2),
        chain("RARM", 6),
        chain("LARM", 6),
    ];
    assert_eq!(names, expected.concat());
}

#[test]
fn soles_sensors_palms_and_imu_are_where_the_parameters_say() {
    let (model, parameters) = (hrp2(), parameters());
    let frame = |name: &str| model.frame(model.find_frame(name).unwrap()).clone();
    for (side, mirror) in [("r", 1.0), ("l", -1.0)] {
        let limb = side.to_uppercase();
        let [sole, ankle, wrist, palm] =
            ["sole", "ankle_sensor", "wrist_sensor", "palm"].map(|part| frame(&format!("{side}_{part}")));
        assert_eq!(model.bodies()[sole.body].name, format!("{limb}LEG_JOINT5"));
        assert_eq!(model.bodies()[palm.body].name, format!("{limb}ARM_JOINT5"));
        assert_eq!(sole.pose.translation.vector, Vector3::new(0.0, 0.0, parameters.sole.z));
        assert_eq!(ankle.pose.translation.vector, Vector3::new(0.0, 0.0, parameters.foot_force_sensor_z));
        assert_eq!(wrist.pose.translation.vector, Vector3::zeros());
        assert_eq!(palm.pose.translation.vector, Vector3::new(0.0, 0.0, -0.085));

        let shapes = &model.bodies()[sole.body].collisions;
        let [shape] = &shapes[..] else { panic!("one contact shape per foot, not {}", shapes.len()) };
        let Geometry::Box { size } = shape.geometry else { panic!("soles are boxes") };
        let (corner, other) =
            (shape.pose.translation.vector - size / 2.0, shape.pose.translation.vector + size / 2.0);
        let s = &parameters.sole;
        let (y_min, y_max) = if mirror > 0.0 { (s.y_min, s.y_max) } else { (-s.y_max, -s.y_min) };
        assert!((corner - Vector3::new(s.x_min, y_min, s.z)).norm() < 1e-12);
        assert!(is_close(other.x, s.x_max) && is_close(other.y, y_max));
        assert_eq!(shape.frame, model.find_frame(&format!("{side}_sole")).unwrap());
    }
    assert_eq!(model.bodies()[frame("imu").body].name, "CHEST_JOINT1");
    assert_eq!(frame("imu").pose.translation.vector, Vector3::from(parameters.imu_offset));
}

#[test]
fn a_wrist_sensor_carries_the_gripper_and_an_ankle_sensor_nothing_that_weighs() {
    let model = hrp2();
    for side in ["r", "l"] {
        let find = |part: &str| model.find_frame(&format!("{side}_{part}")).unwrap();
        let gripper = model.find_frame(&format!("{}ARM_JOINT6", side.to_uppercase())).unwrap();
        let carried = model.carried_inertial(find("wrist_sensor"));
        assert_eq!(carried.mass_kg, model.frame(gripper).inertial.mass_kg);
        let offset = model.frame(gripper).pose.translation.vector;
        assert!((carried.com - offset - model.frame(gripper).inertial.com).norm() < 1e-15);
        assert_eq!(model.carried_inertial(find("ankle_sensor")).mass_kg, 0.0);
        assert!(model.is_carried_by(find("palm"), find("wrist_sensor")));
        assert!(model.is_carried_by(find("sole"), find("ankle_sensor")));
        assert!(!model.is_carried_by(find("wrist_sensor"), find("palm")));
    }
    // What hangs on a moving joint is not carried: its torque is the drive's.
    let waist = model.find_frame("BODY").unwrap();
    assert!(!model.is_carried_by(model.find_frame("r_sole").unwrap(), waist));
    assert_eq!(model.carried_inertial(waist).mass_kg, model.bodies()[0].inertial.mass_kg);
}

#[test]
fn what_a_sensor_carries_and_the_rest_make_up_the_body() {
    let model = hrp2();
    let sensor = model.find_frame("r_wrist_sensor").unwrap();
    let frame = model.frame(sensor);
    let whole =
        model.carried_inertial(sensor).transformed(&frame.pose).combined(&model.uncarried_inertial(sensor));
    let body = &model.bodies()[frame.body].inertial;
    assert!(is_close(whole.mass_kg, body.mass_kg));
    assert!((whole.com - body.com).norm() < 1e-15);
    assert!((whole.inertia - body.inertia).norm() < 1e-15);
}

#[test]
fn the_left_side_mirrors_the_right_in_all_contact_shapes() {
    let model = hrp2();
    let shapes_of = |model: &Model, name: &str| {
        model.bodies().iter().find(|body| body.name == name).unwrap().collisions.clone()
    };
    for body in model.bodies().iter().filter(|body| body.name.starts_with('R')) {
        let left = shapes_of(&model, &body.name.replacen('R', "L", 1));
        assert_eq!(left.len(), body.collisions.len());
        for (right, left) in body.collisions.iter().zip(left) {
            let mut mirrored = right.pose.translation.vector;
            mirrored.y = -mirrored.y;
            assert!((left.pose.translation.vector - mirrored).norm() < 1e-12, "{}", body.name);
        }
    }
}

#[test]
fn all_colours_of_the_description_are_resolved() {
    assert!(HRP2_URDF.contains("material"));
    let model = hrp2();
    let mut visuals = model.bodies().iter().flat_map(|body| &body.visuals);
    assert!(visuals.all(|shape| shape.rgba != [0.7, 0.7, 0.7, 1.0]));
}
