//! `/tf` and `/tf_static`: where everything is.

use crate::convert::{isometry, quaternion, timestamp, vector};
use crate::topic::Topic;
use foxglove::messages::{FrameTransform, FrameTransforms, Timestamp};
use mikoshi_config::RobotSpec;
use mikoshi_humanoid::Model;
use mikoshi_humanoid::model::{Joint, JointKind};
use mikoshi_ipc_types::RobotTruth;
use mikoshi_observation::{LogWriter, Observation, WriteLogError};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};

/// Where everything hangs in the end.
pub const WORLD: &str = "world";
/// The object as it truly is.
pub const OBJECT: &str = "object";

/// The coordinate frame of a robot's link.
pub fn of_link(robot: &str, link: &str) -> String {
    format!("{robot}/{link}")
}

/// Transforms between coordinate frames.
pub struct Frames {
    moving: Topic<FrameTransforms>,
    fixed: Topic<FrameTransforms>,
    /// Every body of every robot, to be filled in.
    bodies: FrameTransforms,
    models: Vec<Model>,
    links: Vec<FrameTransform>,
    references: Vec<References>,
}

/// Names of what a robot thinks and is told.
struct References {
    odometry: String,
    base: String,
    /// Of each grasping hand.
    hands: Vec<String>,
}

impl Frames {
    pub fn add(log: &mut LogWriter, robots: &[(&RobotSpec, &Model)]) -> Result<Self, WriteLogError> {
        let (mut bodies, mut links) = (vec![], vec![]);
        for (spec, model) in robots {
            let name = |link: &str| of_link(&spec.member.name, link);
            for body in model.bodies() {
                let parent =
                    body.parent.map_or_else(|| WORLD.to_owned(), |up| name(&model.bodies()[up].name));
                bodies.push(transform(&parent, &name(&body.name), &Isometry3::identity()));
            }
            for frame in model.frames() {
                let body = &model.bodies()[frame.body].name;
                if frame.name != *body {
                    links.push(transform(&name(body), &name(&frame.name), &frame.pose));
                }
            }
        }
        let references = robots.iter().map(|(spec, _)| {
            let name = |what: &str| of_link(&spec.member.name, what);
            let hands = spec.grasping_hands.iter().map(|&hand| &spec.config.hands[hand].name);
            References {
                odometry: name("odometry"),
                base: name("base_measured"),
                hands: hands.map(|hand| name(&format!("{hand}_ref"))).collect(),
            }
        });
        Ok(Self {
            moving: Topic::add(log, "/tf")?,
            fixed: Topic::add(log, "/tf_static")?,
            bodies: FrameTransforms { transforms: bodies },
            models: robots.iter().map(|(_, model)| (*model).clone()).collect(),
            links,
            references: references.collect(),
        })
    }

    /// What never changes.
    pub fn write_fixed(&self, log: &mut LogWriter, tick: u64, time_ns: u64) -> Result<(), WriteLogError> {
        let stamped =
            |link: &FrameTransform| FrameTransform { timestamp: Some(timestamp(time_ns)), ..link.clone() };
        let transforms = self.links.iter().map(stamped).collect();
        self.fixed.write(log, tick, &FrameTransforms { transforms })
    }

    pub fn write(
        &mut self,
        log: &mut LogWriter,
        time_ns: u64,
        observation: &Observation,
    ) -> Result<(), WriteLogError> {
        let time = timestamp(time_ns);
        self.fill_in(time, observation);
        let links = self.bodies.transforms.len();
        self.add_references(time, observation);
        let written = self.moving.write(log, observation.tick(), &self.bodies);
        self.bodies.transforms.truncate(links);
        written
    }

    fn fill_in(&mut self, time: Timestamp, observation: &Observation) {
        let truths = observation.robot_truth.iter().map(|frame| &frame.payload);
        let poses = self.models.iter().zip(truths).flat_map(|(model, truth)| body_poses(model, truth));
        for (transform, X) in self.bodies.transforms.iter_mut().zip(poses) {
            transform.timestamp = Some(time);
            transform.translation = Some(vector(&X.translation.vector));
            transform.rotation = Some(quaternion(&X.rotation));
        }
    }

    fn add_references(&mut self, time: Timestamp, observation: &Observation) {
        let team = &observation.team_state.payload;
        let mut add = |parent: &str, child: &str, pose: &[f64; 7]| {
            if let Some(X) = isometry(pose) {
                let transform = FrameTransform { timestamp: Some(time), ..transform(parent, child, &X) };
                self.bodies.transforms.push(transform);
            }
        };
        add(WORLD, OBJECT, &observation.object_truth.payload.pose);
        add(WORLD, "object_measured", &team.object_pose);
        add(WORLD, "object_ref", &team.object_pose_ref);
        for (robot, names) in self.references.iter().enumerate() {
            let (state, command) = (&observation.robot_state[robot], &observation.team_command[robot]);
            if let Some(pose) = team.odometry_pose.get(robot) {
                add(WORLD, &names.odometry, pose);
            }
            add(&names.odometry, &names.base, &state.payload.base_pose);
            for (hand, pose) in names.hands.iter().zip(&command.payload.hand_pose_ref) {
                add(&names.odometry, hand, pose);
            }
        }
    }
}

fn transform(parent: &str, child: &str, X: &Isometry3<f64>) -> FrameTransform {
    FrameTransform {
        timestamp: None,
        parent_frame_id: parent.to_owned(),
        child_frame_id: child.to_owned(),
        translation: Some(vector(&X.translation.vector)),
        rotation: Some(quaternion(&X.rotation)),
    }
}

/// Every body in the one it hangs on, the root in the world.
fn body_poses(model: &Model, truth: &RobotTruth) -> impl Iterator<Item = Isometry3<f64>> {
    let root = isometry(&truth.base_pose).unwrap_or_else(Isometry3::identity);
    let joints = model.joints().iter().zip(truth.joint_position_rad);
    core::iter::once(root).chain(joints.map(|(joint, q)| joint.origin * motion(joint, q)))
}

fn motion(joint: &Joint, q: f64) -> Isometry3<f64> {
    match joint.kind {
        JointKind::Revolute => {
            Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&joint.axis, q))
        }
        JointKind::Prismatic => Translation3::from(joint.axis.into_inner() * q).into(),
    }
}
