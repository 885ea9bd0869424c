//! What robots and the world look like: shapes that hang in a coordinate frame and move with it.

use crate::convert::{color, pose, vector};
use crate::frames::{WORLD, of_link};
use foxglove::messages::{
    CubePrimitive, CylinderPrimitive, ModelPrimitive, SceneEntity, SpherePrimitive, Vector3,
};
use mikoshi_config::scenario::FixedBox;
use mikoshi_humanoid::Model;
use mikoshi_humanoid::model::{Body, Geometry, Shape};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use std::path::Path;

const FIXED_BOX: [f64; 4] = [0.5, 0.5, 0.5, 1.0];

/// Something that is what it is for the whole run.
pub fn entity(id: String, frame_id: String) -> SceneEntity {
    SceneEntity { id, frame_id, frame_locked: true, ..SceneEntity::default() }
}

/// Every body of a robot: as it looks, or as it touches where it has no looks.
pub fn of_robot(name: &str, model: &Model) -> Vec<SceneEntity> {
    model.bodies().iter().map(|body| of_body(&of_link(name, &body.name), body)).collect()
}

fn of_body(frame: &str, body: &Body) -> SceneEntity {
    let mut entity = entity(frame.to_owned(), frame.to_owned());
    let shapes = if body.visuals.is_empty() { &body.collisions } else { &body.visuals };
    shapes.iter().for_each(|shape| add(&mut entity, shape));
    entity
}

fn add(entity: &mut SceneEntity, shape: &Shape) {
    let (at, rgba) = (Some(pose(&shape.pose)), Some(color(shape.rgba)));
    let cube = |x, y, z| Some(Vector3 { x, y, z });
    let cylinder = |radius: f64, length| CylinderPrimitive {
        pose: at,
        size: cube(2.0 * radius, 2.0 * radius, length),
        bottom_scale: 1.0,
        top_scale: 1.0,
        color: rgba,
    };
    let sphere = |at: &Isometry3<f64>, radius: f64| SpherePrimitive {
        pose: Some(pose(at)),
        size: cube(2.0 * radius, 2.0 * radius, 2.0 * radius),
        color: rgba,
    };
    match &shape.geometry {
        Geometry::Box { size } => {
            entity.cubes.push(CubePrimitive { pose: at, size: Some(vector(size)), color: rgba });
        }
        &Geometry::Cylinder { radius, length } => entity.cylinders.push(cylinder(radius, length)),
        &Geometry::Capsule { radius, length } => {
            entity.cylinders.push(cylinder(radius, length));
            let end = |z| shape.pose * Translation3::new(0.0, 0.0, z);
            entity.spheres.extend([0.5, -0.5].map(|share| sphere(&end(share * length), radius)));
        }
        &Geometry::Sphere { radius } => entity.spheres.push(sphere(&shape.pose, radius)),
        Geometry::Mesh { file, scale } => entity.models.push(ModelPrimitive {
            pose: at,
            scale: Some(vector(scale)),
            color: rgba,
            override_color: true,
            url: format!("file://{}", file.display()),
            media_type: media_type(file).to_owned(),
            ..ModelPrimitive::default()
        }),
    }
}

/// What tools call the content of a mesh's file.
fn media_type(file: &Path) -> &'static str {
    let extension = file.extension().unwrap_or_default().to_ascii_lowercase();
    match extension.to_str() {
        Some("stl") => "model/stl",
        Some("obj") => "model/obj",
        Some("dae") => "model/vnd.collada+xml",
        Some("glb" | "gltf") => "model/gltf-binary",
        _ => "",
    }
}

/// A box of the world that nothing moves.
pub fn of_fixed_box(fixed: &FixedBox) -> SceneEntity {
    let mut entity = entity(of_link(WORLD, &fixed.name), WORLD.to_owned());
    let heading = UnitQuaternion::from_euler_angles(0.0, 0.0, fixed.yaw_deg.to_radians());
    let X = Isometry3::from_parts(nalgebra::Vector3::from(fixed.position_m).into(), heading);
    let size = Some(vector(&fixed.size_m.into()));
    entity.cubes.push(CubePrimitive { pose: Some(pose(&X)), size, color: Some(color(FIXED_BOX)) });
    entity
}
