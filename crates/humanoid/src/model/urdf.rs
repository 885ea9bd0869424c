//! From URDF to a [`Model`]: every check of the input is here.

use super::{
    Body, Frame, FrameId, Geometry, Inertial, Joint, JointKind, LoadModelError, MAX_JOINTS, Model, Shape,
};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, UnitVector3, Vector3};
use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;

/// Colour of a shape that has none.
const DEFAULT_RGBA: [f64; 4] = [0.7, 0.7, 0.7, 1.0];

/// Where `package://NAME/` leads.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PackageTable(pub BTreeMap<String, PathBuf>);

impl PackageTable {
    /// The existing file that a mesh's URI names: `package://NAME/PATH` by the table, `file://PATH` and
    /// plain paths as they are. `None` where the package is unknown or the file is missing.
    pub fn find(&self, uri: &str) -> Option<PathBuf> {
        let file = match uri.strip_prefix("package://") {
            Some(rest) => {
                let (package, path) = rest.split_once('/')?;
                self.0.get(package)?.join(path)
            }
            None => PathBuf::from(uri.strip_prefix("file://").unwrap_or(uri)),
        };
        file.is_file().then_some(file)
    }
}

pub(super) fn load(text: &str, find_mesh: &dyn Fn(&str) -> Option<PathBuf>) -> Result<Model, LoadModelError> {
    let robot = parse(text)?;
    let tree = Tree::of(&robot)?;

    let mut builder = Builder { robot: &robot, find_mesh, bodies: vec![], joints: vec![], frames: vec![] };
    builder.add_moving_link(tree.root, None)?;
    // Depth-first without recursion: a description may be a chain of any length. Children are pushed
    // in reverse, so that the first of them comes off first.
    let mut open: Vec<(&urdf_rs::Joint, FrameId)> = vec![];
    let push_children = |open: &mut Vec<_>, link: &str, id: FrameId| {
        open.extend(tree.children_of(link).rev().map(|joint| (joint, id)));
    };
    push_children(&mut open, &tree.root.name, FrameId(0));
    while let Some((joint, parent)) = open.pop() {
        let link = tree.links[&*joint.child.link];
        let id = builder.add_joint(joint, link, parent)?;
        push_children(&mut open, &link.name, id);
    }
    if let Some(link) = robot.links.iter().find(|link| builder.frames.iter().all(|f| f.name != link.name)) {
        return Err(LoadModelError::Loop { link: link.name.clone() });
    }
    builder.finish()
}

/// URDF as elements. The reader says what is wrong, but not where: a malformed element is found by
/// reading each of them alone.
fn parse(text: &str) -> Result<urdf_rs::Robot, LoadModelError> {
    let malformed = |place: String, reason: String| Err(LoadModelError::Malformed { place, reason });
    let document = match roxmltree::Document::parse(text) {
        Ok(document) => document,
        Err(error) => return malformed(format!("line {}", error.pos().row), error.to_string()),
    };
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        return malformed("root".into(), format!("<{}>; expected <robot>", root.tag_name().name()));
    }
    let error = match urdf_rs::read_from_string(text) {
        Ok(robot) => return Ok(robot),
        Err(error) => error,
    };
    for element in root.children().filter(roxmltree::Node::is_element) {
        let alone = format!(r#"<robot name="">{}</robot>"#, &text[element.range()]);
        if let Err(reason) = urdf_rs::read_from_string(&alone) {
            let line = document.text_pos_at(element.range().start).row;
            let (tag, name) = (element.tag_name().name(), element.attribute("name").unwrap_or("nameless"));
            return malformed(format!("line {line}: {tag} '{name}'"), reason.to_string());
        }
    }
    malformed("robot".into(), error.to_string())
}

/// Which joint hangs on which link.
struct Tree<'a> {
    links: HashMap<&'a str, &'a urdf_rs::Link>,
    children: HashMap<&'a str, Vec<&'a urdf_rs::Joint>>,
    root: &'a urdf_rs::Link,
}

impl<'a> Tree<'a> {
    fn of(robot: &'a urdf_rs::Robot) -> Result<Self, LoadModelError> {
        let duplicate =
            |element, name: &str| LoadModelError::DuplicateName { element, name: name.to_owned() };
        let mut links = HashMap::new();
        for link in &robot.links {
            if links.insert(&*link.name, link).is_some() {
                return Err(duplicate("link", &link.name));
            }
        }
        let mut names = HashMap::new();
        let mut parents: HashMap<&str, &urdf_rs::Joint> = HashMap::new();
        let mut children: HashMap<&str, Vec<&urdf_rs::Joint>> = HashMap::new();
        for joint in &robot.joints {
            if names.insert(&*joint.name, ()).is_some() {
                return Err(duplicate("joint", &joint.name));
            }
            for link in [&joint.parent.link, &joint.child.link] {
                if !links.contains_key(&**link) {
                    return Err(LoadModelError::UnknownLink {
                        joint: joint.name.clone(),
                        link: link.clone(),
                    });
                }
            }
            if let Some(first) = parents.insert(&joint.child.link, joint) {
                return Err(LoadModelError::SecondParent {
                    link: joint.child.link.clone(),
                    first: first.name.clone(),
                    second: joint.name.clone(),
                });
            }
            children.entry(&joint.parent.link).or_default().push(joint);
        }
        let mut roots = robot.links.iter().filter(|link| !parents.contains_key(&*link.name));
        let root = roots.next().ok_or(LoadModelError::NoRoot)?;
        if let Some(second) = roots.next() {
            return Err(LoadModelError::SecondRoot { first: root.name.clone(), second: second.name.clone() });
        }
        Ok(Self { links, children, root })
    }

    fn children_of(&self, link: &str) -> impl DoubleEndedIterator<Item = &'a urdf_rs::Joint> {
        self.children.get(link).into_iter().flatten().copied()
    }
}

struct Builder<'a> {
    robot: &'a urdf_rs::Robot,
    find_mesh: &'a dyn Fn(&str) -> Option<PathBuf>,
    bodies: Vec<Body>,
    joints: Vec<Joint>,
    frames: Vec<Frame>,
}

impl Builder<'_> {
    fn add_joint(
        &mut self,
        joint: &urdf_rs::Joint,
        link: &urdf_rs::Link,
        parent: FrameId,
    ) -> Result<FrameId, LoadModelError> {
        // What a fixed joint mimics does not matter.
        let is_fixed = matches!(joint.joint_type, urdf_rs::JointType::Fixed);
        if let Some(mimic) = joint.mimic.as_ref().filter(|_| !is_fixed) {
            return Err(LoadModelError::MimicJoint {
                joint: joint.name.clone(),
                mimicked: mimic.joint.clone(),
            });
        }
        let origin = isometry(&joint.origin, || format!("the origin of joint '{}'", joint.name))?;
        let (parent_body, origin) = (self.frames[parent.0].body, self.frames[parent.0].pose * origin);
        let (kind, is_bounded) = match joint.joint_type {
            urdf_rs::JointType::Fixed => {
                return self.add_link(link, Some(parent), parent_body, origin);
            }
            urdf_rs::JointType::Revolute => (JointKind::Revolute, true),
            urdf_rs::JointType::Continuous => (JointKind::Revolute, false),
            urdf_rs::JointType::Prismatic => (JointKind::Prismatic, true),
            ref other => {
                return Err(LoadModelError::UnsupportedJoint {
                    joint: joint.name.clone(),
                    kind: format!("{other:?}").to_lowercase(),
                });
            }
        };
        let (lower, upper) = check_limits(joint, is_bounded)?;
        let rotation = origin.rotation.to_rotation_matrix().into_inner();
        let axis = check_axis(joint)?;
        self.joints.push(Joint {
            name: joint.name.clone(),
            kind,
            parent_body,
            origin,
            origin_rotation: (rotation != Matrix3::identity()).then_some(rotation),
            axis,
            along: (0..3).find(|&along| axis[along] == 1.0),
            lower,
            upper,
            velocity: joint.limit.velocity,
            effort: joint.limit.effort,
        });
        self.add_moving_link(link, Some((parent, parent_body)))
    }

    fn add_moving_link(
        &mut self,
        link: &urdf_rs::Link,
        parent: Option<(FrameId, usize)>,
    ) -> Result<FrameId, LoadModelError> {
        self.bodies.push(Body {
            name: link.name.clone(),
            parent: parent.map(|(_, body)| body),
            inertial: Inertial::zero(),
            visuals: vec![],
            collisions: vec![],
        });
        self.add_link(link, parent.map(|(frame, _)| frame), self.bodies.len() - 1, Isometry3::identity())
    }

    fn add_link(
        &mut self,
        link: &urdf_rs::Link,
        parent: Option<FrameId>,
        body: usize,
        pose: Isometry3<f64>,
    ) -> Result<FrameId, LoadModelError> {
        let id = FrameId(self.frames.len());
        let inertial = check_inertial(link)?;
        for visual in &link.visual {
            let rgba = self.rgba(visual.material.as_ref());
            let shape = self.shape(link, id, &pose, &visual.origin, &visual.geometry, rgba)?;
            self.bodies[body].visuals.push(shape);
        }
        for collision in &link.collision {
            let shape = self.shape(link, id, &pose, &collision.origin, &collision.geometry, DEFAULT_RGBA)?;
            self.bodies[body].collisions.push(shape);
        }
        let merged = &mut self.bodies[body].inertial;
        *merged = merged.combined(&inertial.transformed(&pose));
        let is_turned = pose.rotation != UnitQuaternion::identity();
        self.frames.push(Frame { name: link.name.clone(), parent, body, pose, is_turned, inertial });
        Ok(id)
    }

    /// Colour of a material, which may be defined where it is used or once for the robot.
    fn rgba(&self, material: Option<&urdf_rs::Material>) -> [f64; 4] {
        let Some(material) = material else { return DEFAULT_RGBA };
        let shared = || self.robot.materials.iter().find(|shared| shared.name == material.name);
        let color = material.color.as_ref().or_else(|| shared()?.color.as_ref());
        color.map_or(DEFAULT_RGBA, |color| color.rgba.0.map(|value| value.clamp(0.0, 1.0)))
    }

    fn shape(
        &self,
        link: &urdf_rs::Link,
        frame: FrameId,
        X_body_link: &Isometry3<f64>,
        origin: &urdf_rs::Pose,
        geometry: &urdf_rs::Geometry,
        rgba: [f64; 4],
    ) -> Result<Shape, LoadModelError> {
        let X_link_shape = isometry(origin, || format!("the origin of a shape of link '{}'", link.name))?;
        let positive = |shape: &'static str, sizes: &[f64]| match sizes
            .iter()
            .find(|&&size| !(size.is_finite() && size > 0.0))
        {
            Some(&size) => Err(LoadModelError::InvalidShape { link: link.name.clone(), shape, size }),
            None => Ok(()),
        };
        let geometry = match geometry {
            urdf_rs::Geometry::Box { size } => {
                positive("box", &size.0)?;
                Geometry::Box { size: Vector3::from(size.0) }
            }
            &urdf_rs::Geometry::Cylinder { radius, length } => {
                positive("cylinder", &[radius, length])?;
                Geometry::Cylinder { radius, length }
            }
            &urdf_rs::Geometry::Capsule { radius, length } => {
                positive("capsule", &[radius, length])?;
                Geometry::Capsule { radius, length }
            }
            &urdf_rs::Geometry::Sphere { radius } => {
                positive("sphere", &[radius])?;
                Geometry::Sphere { radius }
            }
            urdf_rs::Geometry::Mesh { filename, scale } => {
                let file = (self.find_mesh)(filename).ok_or_else(|| LoadModelError::MissingMesh {
                    link: link.name.clone(),
                    uri: filename.clone(),
                })?;
                let scale = finite(scale.map_or([1.0; 3], |scale| scale.0), || {
                    format!("the scale of a mesh of link '{}'", link.name)
                })?;
                Geometry::Mesh { file, scale }
            }
        };
        Ok(Shape { frame, pose: X_body_link * X_link_shape, geometry, rgba })
    }

    fn finish(self) -> Result<Model, LoadModelError> {
        if self.joints.len() > MAX_JOINTS {
            return Err(LoadModelError::TooManyJoints { count: self.joints.len(), limit: MAX_JOINTS });
        }
        if let Some(body) = self.bodies.iter().find(|body| body.inertial.mass_kg <= 0.0) {
            return Err(LoadModelError::InvalidInertial {
                link: body.name.clone(),
                what: "it moves without mass, and so do the links fixed to it; expected a positive mass"
                    .into(),
            });
        }
        let is_line = |body: &&Body| body.inertial.inertia.symmetric_eigenvalues().min() <= 0.0;
        if let Some(body) = self.bodies.iter().find(is_line) {
            return Err(LoadModelError::InvalidInertial {
                link: body.name.clone(),
                what: "it moves without an inertia about every axis, and so do the links fixed to it; expected one"
                    .into(),
            });
        }
        let mut paths = vec![0; self.bodies.len()];
        let mut subtree_masses_kg: Vec<f64> = self.bodies.iter().map(|body| body.inertial.mass_kg).collect();
        for (j, joint) in self.joints.iter().enumerate() {
            paths[j + 1] = paths[joint.parent_body] | 1 << j;
        }
        for (j, joint) in self.joints.iter().enumerate().rev() {
            subtree_masses_kg[joint.parent_body] += subtree_masses_kg[j + 1];
        }
        Ok(Model {
            name: self.robot.name.clone(),
            paths,
            subtree_masses_kg,
            bodies: self.bodies,
            joints: self.joints,
            frames: self.frames,
        })
    }
}

fn finite(values: [f64; 3], place: impl Fn() -> String) -> Result<Vector3<f64>, LoadModelError> {
    match values.iter().find(|value| !value.is_finite()) {
        Some(&value) => Err(LoadModelError::NotFinite { place: place(), value }),
        None => Ok(Vector3::from(values)),
    }
}

/// URDF's roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll).
fn isometry(pose: &urdf_rs::Pose, place: impl Fn() -> String) -> Result<Isometry3<f64>, LoadModelError> {
    let xyz = finite(pose.xyz.0, &place)?;
    let rpy = finite(pose.rpy.0, &place)?;
    Ok(Isometry3::from_parts(Translation3::from(xyz), UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z)))
}

fn check_axis(joint: &urdf_rs::Joint) -> Result<UnitVector3<f64>, LoadModelError> {
    let axis = joint.axis.xyz.0;
    // Within what six printed digits lose, an axis is meant to be a unit vector.
    UnitVector3::try_new(Vector3::from(axis), 0.0)
        .filter(|_| (Vector3::from(axis).norm() - 1.0).abs() < 1e-4)
        .ok_or_else(|| LoadModelError::InvalidAxis { joint: joint.name.clone(), axis })
}

fn check_limits(joint: &urdf_rs::Joint, is_bounded: bool) -> Result<(f64, f64), LoadModelError> {
    let limit = &joint.limit;
    let invalid = |what: String| Err(LoadModelError::InvalidLimits { joint: joint.name.clone(), what });
    let is_positive = |value: f64| value.is_finite() && value > 0.0;
    if !(is_positive(limit.velocity) && is_positive(limit.effort)) {
        return invalid(format!(
            "its limits are velocity {} and effort {}; expected both, positive and finite",
            limit.velocity, limit.effort
        ));
    }
    if !is_bounded {
        return Ok((f64::NEG_INFINITY, f64::INFINITY));
    }
    if !(limit.lower.is_finite() && limit.upper.is_finite() && limit.lower < limit.upper) {
        return invalid(format!(
            "its limits are lower {} and upper {}; expected both, finite, lower below upper",
            limit.lower, limit.upper
        ));
    }
    Ok((limit.lower, limit.upper))
}

/// A link may have no mass at all, but what has mass must be a body that can exist: principal moments
/// positive, none larger than the sum of the other two.
fn check_inertial(link: &urdf_rs::Link) -> Result<Inertial, LoadModelError> {
    let source = &link.inertial;
    let invalid = |what: String| Err(LoadModelError::InvalidInertial { link: link.name.clone(), what });
    let place = |what: &str| format!("the {what} of link '{}'", link.name);
    let pose = isometry(&source.origin, || place("inertial origin"))?;
    let mass_kg = finite([source.mass.value; 3], || place("mass"))?.x;
    let i = &source.inertia;
    finite([i.ixx, i.iyy, i.izz], || place("inertia"))?;
    finite([i.ixy, i.ixz, i.iyz], || place("inertia"))?;
    let inertia = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);

    if mass_kg < 0.0 {
        return invalid(format!("its mass is {mass_kg} kg; expected at least 0"));
    }
    if mass_kg == 0.0 {
        return match inertia.norm() {
            0.0 => Ok(Inertial::zero()),
            _ => invalid("it has an inertia but no mass; expected both or neither".into()),
        };
    }
    let principal = inertia.symmetric_eigenvalues();
    // A mass at a point, as cameras and markers often are: the body that carries it has an inertia.
    if inertia.norm() > 0.0 && principal.min() <= 0.0 {
        return invalid(format!(
            "its inertia has a principal moment of {:e} kg m²; expected a positive definite matrix",
            principal.min()
        ));
    }
    // The slack is for tables printed with few digits.
    if 2.0 * principal.max() > principal.sum() * (1.0 + 1e-2) {
        return invalid(format!(
            "one principal moment of its inertia, {:e} kg m², exceeds the sum of the other two; no body has that",
            principal.max()
        ));
    }
    let about_com = Inertial { mass_kg, com: Vector3::zeros(), inertia };
    Ok(about_com.transformed(&pose))
}
