//! `/scene` and `/scene/static`: object, robots, their support, zero moment points and forces, to be looked at.

use crate::convert::{color, isometry, point, pose, timestamp, vector};
use crate::frames::{OBJECT, WORLD, of_link};
use crate::shapes::{self, entity};
use crate::topic::Topic;
use foxglove::messages::line_primitive::Type;
use foxglove::messages::{
    ArrowPrimitive, CubePrimitive, LinePrimitive, SceneEntity, SceneUpdate, SpherePrimitive, Vector3 as Size,
};
use mikoshi_config::{RobotSpec, RunSpec};
use mikoshi_humanoid::balance::PerFoot;
use mikoshi_humanoid::estimate::SoleRectangle;
use mikoshi_ipc_types::RobotTruth;
use mikoshi_observation::{LogWriter, Observation, ObservedRobot, WriteLogError, true_support};
use mikoshi_robot::Robot;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

const OBJECT_COLOR: [f64; 4] = [0.80, 0.55, 0.25, 0.9];
const SUPPORT_COLOR: [f64; 4] = [0.10, 0.60, 0.25, 1.0];
const ZMP_COLOR: [f64; 4] = [0.85, 0.10, 0.10, 1.0];
const FORCE_COLOR: [f64; 4] = [0.15, 0.35, 0.85, 1.0];
/// Length of an arrow for each newton of the force it stands for.
const ARROW_M_N: f64 = 0.005;
/// A shorter arrow can't be seen, and has no direction.
const SHORTEST_ARROW_M: f64 = 0.002;
/// Over the floor, so that lines are not in it.
const GROUND_M: f64 = 0.002;

/// What is to be looked at.
pub struct Scene {
    changing: Topic<SceneUpdate>,
    fixed: Topic<SceneUpdate>,
    entities: Vec<SceneEntity>,
    size_m: [f64; 3],
    robots: Vec<Standing>,
}

/// What a robot stands on, and its grasping hands.
struct Standing {
    name: String,
    soles: PerFoot<SoleRectangle>,
    weight_n: f64,
    hands: Vec<String>,
}

impl Scene {
    pub fn add(
        log: &mut LogWriter,
        run: &RunSpec,
        robots: &[Robot],
        observed: &[ObservedRobot],
    ) -> Result<Self, WriteLogError> {
        let names = run.robots.iter().map(|spec| &spec.member.name);
        let of_robots = names.zip(robots).flat_map(|(name, robot)| shapes::of_robot(name, &robot.model));
        let standing = |((spec, robot), observed): ((&RobotSpec, &Robot), &ObservedRobot)| Standing {
            name: spec.member.name.clone(),
            soles: robot.sole_rectangles,
            weight_n: observed.weight_n(),
            hands: spec.grasping_hands.iter().map(|&hand| spec.config.hands[hand].name.clone()).collect(),
        };
        Ok(Self {
            changing: Topic::add(log, "/scene")?,
            fixed: Topic::add(log, "/scene/static")?,
            entities: of_robots.chain(run.scenario.world.boxes.iter().map(shapes::of_fixed_box)).collect(),
            size_m: run.scenario.object.size_m,
            robots: run.robots.iter().zip(robots).zip(observed).map(standing).collect(),
        })
    }

    /// What never changes, but moves with its coordinate frame.
    pub fn write_fixed(&self, log: &mut LogWriter, tick: u64, time_ns: u64) -> Result<(), WriteLogError> {
        self.fixed.write(log, tick, &update(self.entities.iter().cloned(), time_ns))
    }

    pub fn write(
        &self,
        log: &mut LogWriter,
        time_ns: u64,
        observation: &Observation,
    ) -> Result<(), WriteLogError> {
        let truths = observation.robot_truth.iter().map(|frame| &frame.payload);
        let of_robots = self.robots.iter().zip(truths).map(|(robot, truth)| robot.entity(truth));
        let entities = core::iter::once(self.object()).chain(of_robots);
        self.changing.write(log, observation.tick(), &update(entities, time_ns))
    }

    fn object(&self) -> SceneEntity {
        let mut entity = entity(OBJECT.to_owned(), OBJECT.to_owned());
        let [x, y, z] = self.size_m;
        entity.cubes.push(CubePrimitive {
            pose: Some(pose(&Isometry3::identity())),
            size: Some(Size { x, y, z }),
            color: Some(color(OBJECT_COLOR)),
        });
        entity
    }
}

fn update(entities: impl Iterator<Item = SceneEntity>, time_ns: u64) -> SceneUpdate {
    let time = Some(timestamp(time_ns));
    let entities = entities.map(|entity| SceneEntity { timestamp: time, ..entity }).collect();
    SceneUpdate { deletions: vec![], entities }
}

impl Standing {
    /// Support polygon, zero moment point, and the forces that its hands apply to the object.
    fn entity(&self, truth: &RobotTruth) -> SceneEntity {
        let mut entity = entity(of_link(&self.name, "balance"), WORLD.to_owned());
        let support = true_support(&self.soles, truth, self.weight_n);
        let corner = |corner: &nalgebra::Vector2<f64>| point(&Vector3::new(corner.x, corner.y, GROUND_M));
        entity.lines.push(LinePrimitive {
            r#type: Type::LineLoop as i32,
            thickness: 2.0,
            scale_invariant: true,
            points: support.vertices().iter().map(corner).collect(),
            color: Some(color(SUPPORT_COLOR)),
            pose: Some(pose(&Isometry3::identity())),
            ..LinePrimitive::default()
        });
        let [x, y] = truth.zmp_position_m;
        let diameter = 0.03;
        entity.spheres.push(SpherePrimitive {
            pose: Some(pose(&Isometry3::translation(x, y, GROUND_M))),
            size: Some(Size { x: diameter, y: diameter, z: diameter }),
            color: Some(color(ZMP_COLOR)),
        });
        let hands = truth.hand_pose.iter().zip(&truth.hand_wrench).take(self.hands.len());
        entity.arrows.extend(hands.filter_map(|(pose, wrench)| force_arrow(pose, wrench)));
        entity
    }
}

/// A force where it acts, if it is long enough to be seen.
fn force_arrow(at: &[f64; 7], &[x, y, z, ..]: &[f64; 6]) -> Option<ArrowPrimitive> {
    let (at, force) = (isometry(at)?, Vector3::new(x, y, z));
    let length = ARROW_M_N * force.norm();
    // Against the x axis any half turn does.
    let turn = UnitQuaternion::rotation_between(&Vector3::x(), &force)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), core::f64::consts::PI));
    (length > SHORTEST_ARROW_M).then(|| ArrowPrimitive {
        pose: Some(foxglove::messages::Pose {
            position: Some(vector(&at.translation.vector)),
            orientation: Some(crate::convert::quaternion(&turn)),
        }),
        shaft_length: 0.8 * length,
        shaft_diameter: 0.012,
        head_length: 0.2 * length,
        head_diameter: 0.03,
        color: Some(color(FORCE_COLOR)),
    })
}
