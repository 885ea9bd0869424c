//! Robots, of the shapes in their URDF.
//!
//! All primitives of a form are one entity: a robot is four of them, not fifty, and a shape's label says of which link
//! it is.

use super::colors;
use super::convert::{isometry, quaternion, transform, vector};
use mikoshi::failure::Failure;
use mikoshi_config::RobotSpec;
use mikoshi_humanoid::model::{Geometry, Shape};
use mikoshi_humanoid::{FrameId, Kinematics, Model};
use mikoshi_observation::Observation;
use mikoshi_spatial::{CoordinateFrame, Pose};
use nalgebra::{Isometry3, Translation3, Vector3};
use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{Asset3D, Boxes3D, Capsules3D, Cylinders3D, Ellipsoids3D};
use re_sdk_types::components::FillMode;

/// A link of a robot.
#[derive(Clone, Copy, Debug)]
enum Link {}
impl CoordinateFrame for Link {}

/// The shapes of one robot.
pub struct Bodies {
    robot: usize,
    model: Model,
    kinematics: Kinematics,
    /// Of each body.
    links: Vec<FrameId>,
    primitives: Vec<Primitives>,
    meshes: Vec<Mesh>,
}

/// All primitives of a form.
struct Primitives {
    form: Form,
    path: String,
    parts: Vec<Part>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Boxes,
    Cylinders,
    Capsules,
    Balls,
}

/// A shape on a body, with half the edges of the box around it.
struct Part {
    body: usize,
    X_BS: Isometry3<f64>,
    half_size: Vector3<f64>,
    rgba: [f64; 4],
    label: String,
}

struct Mesh {
    path: String,
    body: usize,
    X_BS: Isometry3<f64>,
    scale: Vector3<f64>,
}

impl Bodies {
    /// Of this robot.
    ///
    /// # Errors
    /// Nobody takes what is shown.
    pub fn set(
        stream: &RecordingStream,
        robot: usize,
        spec: &RobotSpec,
        model: &Model,
    ) -> Result<Self, Failure> {
        let links = model.bodies().iter().map(|body| model.find_frame(&body.name));
        let path = format!("/world/robots/{}", spec.member.name);
        let group = |(form, name): &(Form, &str)| Primitives {
            form: *form,
            path: format!("{path}/{name}"),
            parts: parts_of(model, *form),
        };
        let forms = [
            (Form::Boxes, "boxes"),
            (Form::Cylinders, "cylinders"),
            (Form::Capsules, "capsules"),
            (Form::Balls, "balls"),
        ];
        let bodies = Self {
            robot,
            kinematics: Kinematics::new(model),
            links: links.collect::<Result<_, _>>().map_err(Failure::fault)?,
            primitives: forms.iter().map(group).filter(|group| !group.parts.is_empty()).collect(),
            meshes: set_meshes(stream, &path, model)?,
            model: model.clone(),
        };
        for primitives in &bodies.primitives {
            primitives.show_fixed(stream, robot).map_err(Failure::fault)?;
        }
        Ok(bodies)
    }

    /// Where they are.
    ///
    /// # Errors
    /// Nobody takes it.
    pub fn show(&mut self, stream: &RecordingStream, observation: &Observation) -> RecordingStreamResult<()> {
        let truth = &observation.robot_truth[self.robot].payload;
        // Before the world has begun a robot is nowhere.
        let Some(X_WB) = Pose::from_array(&truth.base_pose) else { return Ok(()) };
        let angles = &truth.joint_position_rad[..self.model.joint_count()];
        self.kinematics.update(&self.model, &X_WB, angles);
        let in_world = |body: usize, X_BS: &Isometry3<f64>| {
            isometry(&self.kinematics.frame_pose::<Link>(&self.model, self.links[body])) * X_BS
        };
        for primitives in &self.primitives {
            let poses = primitives.parts.iter().map(|part| in_world(part.body, &part.X_BS));
            primitives.show(stream, &poses.collect::<Vec<_>>())?;
        }
        for mesh in &self.meshes {
            let at = transform(&in_world(mesh.body, &mesh.X_BS)).with_scale(vector(&mesh.scale));
            stream.log(mesh.path.as_str(), &at)?;
        }
        Ok(())
    }
}

/// What bodies look like, or touch with where they have no looks.
fn shapes_of(model: &Model) -> impl Iterator<Item = (usize, &Shape)> {
    model.bodies().iter().enumerate().flat_map(|(index, body)| {
        let shapes = if body.visuals.is_empty() { &body.collisions } else { &body.visuals };
        shapes.iter().map(move |shape| (index, shape))
    })
}

fn parts_of(model: &Model, form: Form) -> Vec<Part> {
    let part = |(body, shape): (usize, &Shape)| {
        let round = |radius: f64, length: f64| Vector3::new(radius, radius, 0.5 * length);
        let (found, half_size, X_BS) = match shape.geometry {
            Geometry::Box { size } => (Form::Boxes, size * 0.5, shape.pose),
            Geometry::Sphere { radius } => (Form::Balls, Vector3::repeat(radius), shape.pose),
            Geometry::Cylinder { radius, length } => (Form::Cylinders, round(radius, length), shape.pose),
            Geometry::Capsule { radius, length } => {
                // Rerun's begin at their origin.
                let begin = Translation3::new(0.0, 0.0, -0.5 * length);
                (Form::Capsules, round(radius, length), shape.pose * begin)
            }
            Geometry::Mesh { .. } => return None,
        };
        let label = model.frame(shape.frame).name.clone();
        (found == form).then_some(Part { body, X_BS, half_size, rgba: shape.rgba, label })
    };
    shapes_of(model).filter_map(part).collect()
}

fn set_meshes(stream: &RecordingStream, path: &str, model: &Model) -> Result<Vec<Mesh>, Failure> {
    let mut meshes = vec![];
    for (body, shape) in shapes_of(model) {
        let Geometry::Mesh { file, scale } = &shape.geometry else { continue };
        let path = format!("{path}/meshes/{}/{}", model.frame(shape.frame).name, meshes.len());
        let asset =
            Asset3D::from_file_path(file).map_err(|error| Failure::usage(error).context(file.display()))?;
        stream.log_static(path.as_str(), &asset).map_err(Failure::fault)?;
        meshes.push(Mesh { path, body, X_BS: shape.pose, scale: *scale });
    }
    Ok(meshes)
}

impl Primitives {
    fn show_fixed(&self, stream: &RecordingStream, robot: usize) -> RecordingStreamResult<()> {
        let sizes = || self.parts.iter().map(|part| vector(&part.half_size));
        let radii = || sizes().map(|[radius, ..]| radius);
        let lengths = || sizes().map(|[.., half]| 2.0 * half);
        let colors = self.parts.iter().map(|part| colors::of_part(robot, part.rgba));
        let labels = self.parts.iter().map(|part| part.label.as_str());
        let (path, solid) = (self.path.as_str(), FillMode::Solid);
        macro_rules! show {
            ($shapes:expr) => {
                stream.log_static(
                    path,
                    &$shapes
                        .with_colors(colors)
                        .with_labels(labels)
                        .with_show_labels(false)
                        .with_fill_mode(solid),
                )
            };
        }
        match self.form {
            Form::Boxes => show!(Boxes3D::from_half_sizes(sizes())),
            Form::Balls => show!(Ellipsoids3D::from_half_sizes(sizes())),
            Form::Cylinders => show!(Cylinders3D::from_lengths_and_radii(lengths(), radii())),
            Form::Capsules => show!(Capsules3D::from_lengths_and_radii(lengths(), radii())),
        }
    }

    fn show(&self, stream: &RecordingStream, poses: &[Isometry3<f64>]) -> RecordingStreamResult<()> {
        let places = poses.iter().map(|X| vector(&X.translation.vector));
        let turns = poses.iter().map(|X| quaternion(&X.rotation));
        let path = self.path.as_str();
        match self.form {
            Form::Boxes => {
                stream.log(path, &Boxes3D::update_fields().with_centers(places).with_quaternions(turns))
            }
            Form::Balls => {
                stream.log(path, &Ellipsoids3D::update_fields().with_centers(places).with_quaternions(turns))
            }
            Form::Cylinders => {
                stream.log(path, &Cylinders3D::update_fields().with_centers(places).with_quaternions(turns))
            }
            Form::Capsules => stream
                .log(path, &Capsules3D::update_fields().with_translations(places).with_quaternions(turns)),
        }
    }
}
