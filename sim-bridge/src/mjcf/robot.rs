//! One robot as MJCF.

use super::text::{escape, inertia, numbers, pose, vector};
use super::{OBJECT, isometry, qualified};
use crate::robot::Robot;
use core::fmt::{Result, Write};
use mikoshi_humanoid::model::{FrameId, Geometry, Inertial, JointKind, Shape};
use nalgebra::Isometry3;
use std::collections::BTreeSet;

/// What stands for a joint without limits.
const UNLIMITED_TORQUE_NM: f64 = 1e9;

/// Mesh files, once each. MuJoCo collides with their convex hulls.
pub fn write_meshes(xml: &mut String, robots: &[Robot]) -> Result {
    let shapes = robots.iter().flat_map(|robot| robot.model.bodies()).flat_map(|body| &body.collisions);
    let meshes: BTreeSet<String> = shapes.filter_map(|shape| mesh_attributes(&shape.geometry)).collect();
    if meshes.is_empty() {
        return Ok(());
    }
    writeln!(xml, "  <asset>")?;
    for mesh in meshes {
        writeln!(xml, "    <mesh {mesh}/>")?;
    }
    writeln!(xml, "  </asset>")
}

fn mesh_attributes(geometry: &Geometry) -> Option<String> {
    let Geometry::Mesh { file, scale } = geometry else { return None };
    let file = escape(&file.to_string_lossy());
    let scale = vector(scale);
    Some(format!(r#"name="{file} {scale}" file="{file}" scale="{scale}""#))
}

/// The tree of bodies.
pub fn write_bodies(xml: &mut String, robot: &Robot) -> Result {
    write_body(xml, robot, 0)
}

fn write_body(xml: &mut String, robot: &Robot, body: usize) -> Result {
    let model = &robot.model;
    let name = escape(&qualified(robot.name(), &model.bodies()[body].name));
    match body.checked_sub(1) {
        None => {
            let base = isometry(&robot.spec.initial_base_pose);
            writeln!(xml, r#"    <body name="{name}" {}><freejoint/>"#, pose(&base))?;
        }
        Some(joint) => {
            let (joint, drive) = (&model.joints()[joint], robot.drives[joint]);
            let kind = match joint.kind {
                JointKind::Revolute => "hinge",
                JointKind::Prismatic => "slide",
            };
            writeln!(xml, r#"    <body name="{name}" {}>"#, pose(&joint.origin))?;
            write!(
                xml,
                r#"      <joint name="{}" type="{kind}" axis="{}" armature="{}""#,
                escape(&qualified(robot.name(), &joint.name)),
                vector(&joint.axis),
                drive.armature_kg_m2,
            )?;
            if joint.lower.is_finite() && joint.upper.is_finite() {
                write!(xml, r#" range="{} {}""#, joint.lower, joint.upper)?;
            }
            writeln!(xml, "/>")?;
        }
    }
    // What no force sensor carries belongs to the moving body itself.
    let own = |frame: FrameId| robot.carrier_of(frame).is_none();
    write_content(xml, robot, body, &own, Isometry3::identity())?;
    for sensor in robot.force_sensors().filter(|&sensor| model.frame(sensor).body == body) {
        let frame = model.frame(sensor);
        let name = escape(&qualified(robot.name(), &sensor_body(&frame.name)));
        writeln!(xml, r#"    <body name="{name}" {}>"#, pose(&frame.pose))?;
        let carried = |id: FrameId| robot.carrier_of(id) == Some(sensor);
        write_content(xml, robot, body, &carried, frame.pose.inverse())?;
        writeln!(xml, "    </body>")?;
    }
    for (child, _) in model.joints().iter().enumerate().filter(|(_, joint)| joint.parent_body == body) {
        write_body(xml, robot, child + 1)?;
    }
    writeln!(xml, "    </body>")
}

/// The body of what a force sensor carries.
pub fn sensor_body(sensor: &str) -> String {
    format!("{sensor}+")
}

/// Mass, shapes and sites of those frames of a body that belong to it, with `to_body` from the moving
/// body's frame to the MJCF body's.
fn write_content(
    xml: &mut String,
    robot: &Robot,
    body: usize,
    belongs: &dyn Fn(FrameId) -> bool,
    to_body: Isometry3<f64>,
) -> Result {
    let model = &robot.model;
    let frames = || robot.frames().filter(|&id| model.frame(id).body == body && belongs(id));
    let mass = frames()
        .map(|id| model.frame(id).inertial.transformed(&(to_body * model.frame(id).pose)))
        .fold(Inertial::zero(), |sum, part| sum.combined(&part));
    if mass.mass_kg > 0.0 {
        writeln!(
            xml,
            r#"      <inertial pos="{}" mass="{}" fullinertia="{}"/>"#,
            vector(&mass.com),
            mass.mass_kg,
            inertia(&mass.inertia),
        )?;
    }
    for id in frames() {
        let frame = model.frame(id);
        let name = escape(&qualified(robot.name(), &frame.name));
        if robot.is_measured(id) {
            writeln!(xml, r#"      <site name="{name}" {}/>"#, pose(&(to_body * frame.pose)))?;
        }
        let shapes = model.bodies()[body].collisions.iter().filter(|shape| shape.frame == id);
        for (index, shape) in shapes.enumerate() {
            let pose = pose(&(to_body * shape.pose));
            writeln!(xml, r#"      <geom name="{name}#{index}" {pose} {}/>"#, form(shape))?;
        }
    }
    Ok(())
}

fn form(shape: &Shape) -> String {
    match &shape.geometry {
        Geometry::Box { size } => format!(r#"type="box" size="{}""#, vector(&(size * 0.5))),
        Geometry::Cylinder { radius, length } => {
            format!(r#"type="cylinder" size="{}""#, numbers(&[*radius, 0.5 * length]))
        }
        Geometry::Capsule { radius, length } => {
            format!(r#"type="capsule" size="{}""#, numbers(&[*radius, 0.5 * length]))
        }
        Geometry::Sphere { radius } => format!(r#"type="sphere" size="{radius}""#),
        Geometry::Mesh { file, scale } => {
            format!(r#"type="mesh" mesh="{} {}""#, escape(&file.to_string_lossy()), vector(scale))
        }
    }
}

/// Position servos: torque = kp (ctrl − q) − kv q̇, within the joint's effort.
pub fn write_actuators(xml: &mut String, robot: &Robot) -> Result {
    for (joint, drive) in robot.model.joints().iter().zip(&robot.drives) {
        let name = escape(&qualified(robot.name(), &joint.name));
        let effort = joint.effort.min(UNLIMITED_TORQUE_NM);
        writeln!(
            xml,
            r#"    <position name="{name}" joint="{name}" kp="{}" kv="{}" forcerange="{} {effort}"/>"#,
            drive.kp_nm_rad, drive.kv_nms_rad, -effort,
        )?;
    }
    Ok(())
}

/// Names of the two halves of a force/torque sensor.
pub fn force_and_torque(robot: &str, sensor: &str) -> [String; 2] {
    ["force", "torque"].map(|half| format!("{}/{half}", qualified(robot, sensor)))
}

/// Names of the two halves of an IMU.
pub fn gyro_and_accelerometer(robot: &str, imu: &str) -> [String; 2] {
    ["gyro", "accelerometer"].map(|half| format!("{}/{half}", qualified(robot, imu)))
}

pub fn write_sensors(xml: &mut String, robot: &Robot) -> Result {
    let mut write_pair = |kinds: [&str; 2], names: [String; 2], frame: FrameId| -> Result {
        let site = escape(&qualified(robot.name(), &robot.model.frame(frame).name));
        for (kind, name) in kinds.into_iter().zip(names) {
            writeln!(xml, r#"    <{kind} name="{}" site="{site}"/>"#, escape(&name))?;
        }
        Ok(())
    };
    for sensor in robot.force_sensors() {
        let names = force_and_torque(robot.name(), &robot.model.frame(sensor).name);
        write_pair(["force", "torque"], names, sensor)?;
    }
    let names = gyro_and_accelerometer(robot.name(), &robot.model.frame(robot.imu).name);
    write_pair(["gyro", "accelerometer"], names, robot.imu)
}

/// Pairs of bodies that may not collide: neighbours, and grasping hands with the object.
pub fn write_exclusions(xml: &mut String, robot: &Robot) -> Result {
    let model = &robot.model;
    let mut write_pair = |first: &str, second: &str| {
        writeln!(xml, r#"    <exclude body1="{}" body2="{}"/>"#, escape(first), escape(second))
    };
    // The MJCF bodies that a body of the model became.
    let parts = |body: usize| {
        let sensors = robot.force_sensors().filter(move |&sensor| model.frame(sensor).body == body);
        core::iter::once(qualified(robot.name(), &model.bodies()[body].name))
            .chain(sensors.map(|sensor| qualified(robot.name(), &sensor_body(&model.frame(sensor).name))))
    };
    let collides = |body: usize| !model.bodies()[body].collisions.is_empty();
    for body in (0..model.bodies().len()).filter(|&body| collides(body)) {
        let ancestors = core::iter::successors(model.bodies()[body].parent, |&up| model.bodies()[up].parent);
        let Some(neighbour) = ancestors.into_iter().find(|&up| collides(up)) else { continue };
        for first in parts(neighbour) {
            for second in parts(body) {
                write_pair(&first, &second)?;
            }
        }
    }
    for hand in &robot.hands {
        for part in parts(model.frame(hand.frame).body) {
            write_pair(&part, OBJECT)?;
        }
    }
    Ok(())
}
