//! Where the simulator keeps what the frames need: addresses, found once by name.

use crate::grasp::GraspSite;
use crate::mjcf::{self, FLOOR, OBJECT, fixed_box, ground_prefix, qualified};
use crate::rejects;
use crate::robot::Robot;
use mikoshi_config::scenario::FixedBox;
use mikoshi_humanoid::balance::PerFoot;
use mikoshi_humanoid::estimate::SoleRectangle;
use mikoshi_humanoid::model::FrameId;
use mikoshi_physics::{BuildWorldError, GRAVITY_M_S2, Standing};
use mikoshi_spatial::{Hand, Object, Pose};
use mujoco_rs::prelude::{MjModel, MjtObjBase};

/// The whole world's addresses.
pub struct Layout {
    pub robots: Vec<RobotLayout>,
    pub object: BodyLayout,
    /// Whose each geom is.
    pub geoms: Vec<GeomOwner>,
}

/// A body on a free joint.
#[derive(Clone, Copy)]
pub struct BodyLayout {
    pub body: usize,
    /// In the velocities: linear in world axes, angular in the body's.
    pub dof: usize,
}

/// One robot's addresses.
pub struct RobotLayout {
    pub base: BodyLayout,
    pub joints: Vec<JointLayout>,
    /// Grasping hands.
    pub hands: Vec<HandLayout>,
    pub feet: Vec<FootLayout>,
    pub standing: Standing,
    /// In the sensor data.
    pub gyro: usize,
    /// In the sensor data.
    pub accelerometer: usize,
}

/// A joint and its drive.
pub struct JointLayout {
    pub qpos: usize,
    pub dof: usize,
    pub actuator: usize,
    pub kp: f64,
    pub kv: f64,
    pub effort: f64,
    /// Lower and upper \[rad\].
    pub limits: [f64; 2],
}

/// A force/torque sensor, in the sensor data.
#[derive(Clone, Copy)]
pub struct ForceTorqueLayout {
    pub force: usize,
    pub torque: usize,
}

/// A grasping hand.
pub struct HandLayout {
    pub sensor: ForceTorqueLayout,
    pub palm_site: usize,
    pub palm_body: usize,
    /// Where on the object the palm is pulled to.
    pub object_site: usize,
    /// Where on the object it was to hold: the same without the grasp offset.
    pub place_on_object: Pose<Object, Hand>,
    /// The weld, where there is one.
    pub equality: Option<usize>,
}

/// A foot.
pub struct FootLayout {
    pub sensor: ForceTorqueLayout,
    pub sole_site: usize,
}

/// Whose a geom is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GeomOwner {
    Floor,
    Object,
    /// Of the world's boxes, all alike.
    FixedBox,
    /// A robot's foot.
    Foot {
        robot: usize,
        foot: usize,
    },
    /// Any other part of a robot.
    Part {
        robot: usize,
    },
}

impl Layout {
    pub fn of(
        model: &MjModel,
        boxes: &[FixedBox],
        robots: &[Robot],
        grasps: &[GraspSite],
    ) -> Result<Self, BuildWorldError> {
        let find = Finder(model);
        let mut grasps = grasps.iter();
        let robots_layout = robots.iter().map(|robot| find.robot(robot, &mut grasps));
        let robots_layout = robots_layout.collect::<Result<_, _>>()?;
        let object = find.body(OBJECT)?;
        let geoms = (0..model.ngeom() as usize).map(|geom| find.owner_of(geom, object.body, boxes, robots));
        Ok(Self { robots: robots_layout, object, geoms: geoms.collect::<Result<_, _>>()? })
    }
}

struct Finder<'a>(&'a MjModel);

impl Finder<'_> {
    fn id(&self, kind: MjtObjBase, name: &str) -> Result<usize, BuildWorldError> {
        self.0.name_to_id(kind, name).ok_or_else(|| rejects(format!("no '{name}' among the {kind:?}")))
    }

    fn body(&self, name: &str) -> Result<BodyLayout, BuildWorldError> {
        let body = self.id(MjtObjBase::mjOBJ_BODY, name)?;
        let joint = self.0.body_jntadr()[body] as usize;
        Ok(BodyLayout { body, dof: self.0.jnt_dofadr()[joint] as usize })
    }

    fn sensor_pair(&self, names: [String; 2]) -> Result<[usize; 2], BuildWorldError> {
        let [first, second] =
            names.map(|name| Ok(self.0.sensor_adr()[self.id(MjtObjBase::mjOBJ_SENSOR, &name)?] as usize));
        Ok([first?, second?])
    }

    fn robot<'g>(
        &self,
        robot: &Robot,
        grasps: &mut impl Iterator<Item = &'g GraspSite>,
    ) -> Result<RobotLayout, BuildWorldError> {
        let model = &robot.model;
        let name_of = |frame: FrameId| qualified(robot.name(), &model.frame(frame).name);
        let site = |frame: FrameId| self.id(MjtObjBase::mjOBJ_SITE, &name_of(frame));
        let force_torque = |frame: FrameId| -> Result<_, BuildWorldError> {
            let names = mjcf::force_and_torque(robot.name(), &model.frame(frame).name);
            let [force, torque] = self.sensor_pair(names)?;
            Ok(ForceTorqueLayout { force, torque })
        };

        let joints = model.joints().iter().zip(&robot.drives).map(|(joint, drive)| {
            let name = qualified(robot.name(), &joint.name);
            let id = self.id(MjtObjBase::mjOBJ_JOINT, &name)?;
            Ok(JointLayout {
                qpos: self.0.jnt_qposadr()[id] as usize,
                dof: self.0.jnt_dofadr()[id] as usize,
                actuator: self.id(MjtObjBase::mjOBJ_ACTUATOR, &name)?,
                kp: drive.kp_nm_rad,
                kv: drive.kv_nms_rad,
                effort: joint.effort,
                limits: [joint.lower, joint.upper],
            })
        });
        let hands = robot.hands.iter().zip(grasps).zip(&robot.spec.hand_in_object);
        let hands = hands.map(|((hand, grasp), place)| {
            let palm_site = site(hand.frame)?;
            Ok(HandLayout {
                sensor: force_torque(hand.sensor)?,
                palm_site,
                palm_body: self.0.site_bodyid()[palm_site] as usize,
                object_site: self.id(MjtObjBase::mjOBJ_SITE, &grasp.site)?,
                // It was found to be a pose when the robot was resolved.
                place_on_object: Pose::from_array(place).unwrap_or_else(Pose::identity),
                equality: self.0.name_to_id(MjtObjBase::mjOBJ_EQUALITY, &grasp.palm),
            })
        });
        let feet = robot
            .feet
            .iter()
            .map(|foot| Ok(FootLayout { sensor: force_torque(foot.sensor)?, sole_site: site(foot.frame)? }));
        let sole = |side| {
            let foot = robot.spec.config.feet.get(side as usize);
            let [x_min, x_max, y_min, y_max] = foot.map_or([0.0; 4], |foot| foot.sole_m);
            SoleRectangle { x_min, x_max, y_min, y_max }
        };
        let imu = mjcf::gyro_and_accelerometer(robot.name(), &model.frame(robot.imu).name);
        let [gyro, accelerometer] = self.sensor_pair(imu)?;
        Ok(RobotLayout {
            base: self.body(&qualified(robot.name(), &model.bodies()[0].name))?,
            joints: joints.collect::<Result<_, BuildWorldError>>()?,
            hands: hands.collect::<Result<_, BuildWorldError>>()?,
            feet: feet.collect::<Result<_, BuildWorldError>>()?,
            standing: Standing {
                soles: PerFoot::from_fn(sole),
                weight_n: model.total_mass_kg() * GRAVITY_M_S2,
                initial_base_height_m: robot.spec.initial_base_pose[2],
            },
            gyro,
            accelerometer,
        })
    }

    fn owner_of(
        &self,
        geom: usize,
        object: usize,
        boxes: &[FixedBox],
        robots: &[Robot],
    ) -> Result<GeomOwner, BuildWorldError> {
        let body = self.0.geom_bodyid()[geom] as usize;
        if body == object {
            return Ok(GeomOwner::Object);
        }
        let name = self.0.id_to_name(MjtObjBase::mjOBJ_GEOM, geom).unwrap_or_default();
        if name == FLOOR || name.starts_with(&ground_prefix()) {
            return Ok(GeomOwner::Floor);
        }
        if boxes.iter().any(|fixed| fixed_box(&fixed.name) == name) {
            return Ok(GeomOwner::FixedBox);
        }
        // ROBOT/LINK#INDEX; a robot's name may hold a slash too, so whole names are compared.
        let link = name.rsplit_once('#').map_or(name, |(link, _)| link);
        for (index, robot) in robots.iter().enumerate() {
            let frame =
                robot.frames().find(|&id| qualified(robot.name(), &robot.model.frame(id).name) == link);
            if let Some(frame) = frame {
                let carries = |foot: &crate::robot::Extremity| {
                    robot.model.frame(foot.frame).body == robot.model.frame(frame).body
                };
                return Ok(match robot.feet.iter().position(carries) {
                    Some(foot) => GeomOwner::Foot { robot: index, foot },
                    None => GeomOwner::Part { robot: index },
                });
            }
        }
        Err(rejects(format!("geom '{name}' is nobody's")))
    }
}
