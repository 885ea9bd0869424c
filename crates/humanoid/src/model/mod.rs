//! A robot as a floating-base tree of at most [`MAX_JOINTS`] joints, read from URDF.
//!
//! # Glossary
//! - **link**: an element of the description. Links that fixed joints hold together are one body.
//! - **body**: what moves as one. Body 0 is the root and floats; body j + 1 is moved by joint j.
//! - **frame**: every link's coordinate frame by its name, fixed to a body.
//!
//! Poses between a body and what is fixed to it are plain isometries: bodies are known by index here,
//! and typed coordinate frames begin where a caller says which frame is a hand and which a foot.

mod error;
mod inertial;
mod urdf;

pub use error::{FindElementError, LoadModelError};
pub use inertial::Inertial;
pub use urdf::PackageTable;

use nalgebra::{Isometry3, Matrix3, UnitVector3, Vector3};
use std::path::PathBuf;

/// Most joints that a robot may have: joint sets are 64-bit masks.
pub const MAX_JOINTS: usize = 64;

/// Most grasping hands that a robot may have.
pub const MAX_HANDS: usize = 4;

/// A frame of a [`Model`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct FrameId(usize);

impl FrameId {
    /// Its place in [`Model::frames`].
    pub fn index(self) -> usize {
        self.0
    }
}

/// A robot. Immutable; what changes from tick to tick lives in workspaces and states.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    name: String,
    bodies: Vec<Body>,
    joints: Vec<Joint>,
    frames: Vec<Frame>,
    /// For each body, the set of joints between it and the root.
    paths: Vec<u64>,
    /// For each body, the mass of it and of all that hangs on it.
    subtree_masses_kg: Vec<f64>,
}

/// What moves as one.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Name of the link that its joint moves, or of the root.
    pub name: String,
    /// The body that its joint hangs on; `None` for the root.
    pub parent: Option<usize>,
    /// Mass distribution of all its links, in the body's frame.
    pub inertial: Inertial,
    /// What it looks like.
    pub visuals: Vec<Shape>,
    /// What it touches with.
    pub collisions: Vec<Shape>,
}

/// A moving joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// The body it hangs on. The body that it moves is its own index plus one.
    pub parent_body: usize,
    /// Its frame at zero in the parent body; the moved body's frame coincides with it there.
    pub origin: Isometry3<f64>,
    /// Rotation of `origin`, as a matrix; `None` if it is none.
    pub(crate) origin_rotation: Option<Matrix3<f64>>,
    /// Its axis in its own frame.
    pub axis: UnitVector3<f64>,
    /// The axis of its own frame that its axis is, if it is one: 0, 1, 2 for x, y, z.
    pub(crate) along: Option<usize>,
    /// Lower position limit \[rad or m\]; −∞ for continuous joints.
    pub lower: f64,
    /// Upper position limit \[rad or m\]; ∞ for continuous joints.
    pub upper: f64,
    /// Largest speed \[rad/s or m/s\].
    pub velocity: f64,
    /// Largest torque or force \[Nm or N\].
    pub effort: f64,
}

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// About its axis.
    Revolute,
    /// Along its axis.
    Prismatic,
}

/// A link's coordinate frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Name of the link.
    pub name: String,
    /// The link that its joint hangs on; `None` for the root.
    pub parent: Option<FrameId>,
    /// The body that it is fixed to.
    pub body: usize,
    /// Its pose in that body.
    pub pose: Isometry3<f64>,
    /// Whether its axes are others than the body's.
    pub(crate) is_turned: bool,
    /// Mass distribution of this link alone, in its own frame.
    pub inertial: Inertial,
}

/// A shape to see or to touch.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// The link that carries it.
    pub frame: FrameId,
    /// Its pose in the body.
    pub pose: Isometry3<f64>,
    /// Its form.
    pub geometry: Geometry,
    /// Red, green, blue and opacity, each within 0 and 1.
    pub rgba: [f64; 4],
}

/// A primitive or a mesh, centred on its frame; axes of cylinders and capsules along z.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Geometry {
    /// Full edge lengths \[m\].
    Box { size: Vector3<f64> },
    /// Radius and length \[m\].
    Cylinder { radius: f64, length: f64 },
    /// Radius and length of the part between the half spheres \[m\].
    Capsule { radius: f64, length: f64 },
    /// Radius \[m\].
    Sphere { radius: f64 },
    /// A file, and by how much each axis is scaled.
    Mesh { file: PathBuf, scale: Vector3<f64> },
}

impl Model {
    /// Reads a robot from the text of a URDF. `find_mesh` turns what the description calls a mesh into
    /// a file that exists ([`PackageTable::find`]), or says that there is none.
    ///
    /// Joints are ordered depth-first, siblings in the order of the document; links of fixed joints are
    /// merged into the body that carries them and remain as frames.
    ///
    /// # Errors
    /// Whatever [`LoadModelError`] lists.
    pub fn from_urdf(
        text: &str,
        find_mesh: &dyn Fn(&str) -> Option<PathBuf>,
    ) -> Result<Self, LoadModelError> {
        urdf::load(text, find_mesh)
    }

    /// The same without shapes that are meshes.
    #[must_use]
    pub fn without_meshes(mut self) -> Self {
        let is_mesh = |shape: &Shape| matches!(shape.geometry, Geometry::Mesh { .. });
        for body in &mut self.bodies {
            body.visuals.retain(|shape| !is_mesh(shape));
            body.collisions.retain(|shape| !is_mesh(shape));
        }
        self
    }

    /// Name of the robot.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its bodies; every parent comes before its children.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Its joints; joint j moves body j + 1.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Number of moving joints.
    pub fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// Its frames, one for each link.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// A frame.
    pub fn frame(&self, id: FrameId) -> &Frame {
        &self.frames[id.0]
    }

    /// Sum of all masses \[kg\].
    pub fn total_mass_kg(&self) -> f64 {
        self.subtree_masses_kg[0]
    }

    /// The set of joints that move a body against the root: bit j for joint j.
    pub fn path(&self, body: usize) -> u64 {
        self.paths[body]
    }

    /// Mass of a body and of all that hangs on it \[kg\].
    pub fn subtree_mass_kg(&self, body: usize) -> f64 {
        self.subtree_masses_kg[body]
    }

    /// The frame of a link.
    ///
    /// # Errors
    /// No link has this name.
    pub fn find_frame(&self, link: &str) -> Result<FrameId, FindElementError> {
        self.frames
            .iter()
            .position(|frame| frame.name == link)
            .map(FrameId)
            .ok_or_else(|| self.not_found("link", link, self.frames.iter().map(|frame| &*frame.name)))
    }

    /// The index of a moving joint.
    ///
    /// # Errors
    /// No moving joint has this name.
    pub fn find_joint(&self, name: &str) -> Result<usize, FindElementError> {
        self.joints
            .iter()
            .position(|joint| joint.name == name)
            .ok_or_else(|| self.not_found("joint", name, self.joints.iter().map(|joint| &*joint.name)))
    }

    /// Whether `frame` is `ancestor` or hangs on it by fixed joints only: whether a sensor at
    /// `ancestor` carries it.
    pub fn is_carried_by(&self, frame: FrameId, ancestor: FrameId) -> bool {
        let same_body = self.frame(frame).body == self.frame(ancestor).body;
        let mut line = core::iter::successors(Some(frame), |&id| self.frame(id).parent);
        same_body && line.any(|id| id == ancestor)
    }

    /// Mass distribution of what a sensor at `frame` carries: this link and all that fixed joints hang
    /// on it, in its own frame. Links beyond a moving joint are not part of it.
    pub fn carried_inertial(&self, frame: FrameId) -> Inertial {
        let to_frame = self.frame(frame).pose.inverse();
        (0..self.frames.len())
            .map(FrameId)
            .filter(|&id| self.is_carried_by(id, frame))
            .map(|id| self.frame(id).inertial.transformed(&(to_frame * self.frame(id).pose)))
            .fold(Inertial::zero(), |sum, part| sum.combined(&part))
    }

    /// Mass distribution of the rest of a frame's body, which a sensor at `frame` does not carry, in
    /// the body's frame.
    pub fn uncarried_inertial(&self, frame: FrameId) -> Inertial {
        (0..self.frames.len())
            .map(FrameId)
            .filter(|&id| self.frame(id).body == self.frame(frame).body && !self.is_carried_by(id, frame))
            .map(|id| self.frame(id).inertial.transformed(&self.frame(id).pose))
            .fold(Inertial::zero(), |sum, part| sum.combined(&part))
    }

    fn not_found<'a>(
        &self,
        element: &'static str,
        name: &str,
        known: impl Iterator<Item = &'a str>,
    ) -> FindElementError {
        FindElementError {
            robot: self.name.clone(),
            element,
            name: name.to_owned(),
            known: known.collect::<Vec<_>>().join(", "),
        }
    }
}
