//! The simulated world, put where a snapshot says and drawn.

use crate::Size;
use crate::error::PictureError;
use crate::snapshot::Snapshot;
use mikoshi_config::RunSpec;
use mikoshi_robot::Robot;
use mikoshi_sim_bridge::{OBJECT, qualified, world_xml};
use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase, MjvCamera};
use mujoco_rs::renderer::MjRenderer;

pub use mikoshi_sim_bridge::{MAX_PICTURE_HEIGHT as MAX_HEIGHT, MAX_PICTURE_WIDTH as MAX_WIDTH};

/// Of robots, in turn.
const ROBOT_COLORS: [[f32; 4]; 4] =
    [[0.35, 0.55, 0.80, 1.0], [0.85, 0.60, 0.30, 1.0], [0.45, 0.70, 0.45, 1.0], [0.70, 0.45, 0.65, 1.0]];
const OBJECT_COLOR: [f32; 4] = [0.80, 0.25, 0.20, 1.0];

pub struct Stage {
    data: MjData<Box<MjModel>>,
    renderer: MjRenderer,
    object: usize,
    robots: Vec<RobotPlaces>,
}

/// Where the simulator keeps a robot's positions.
struct RobotPlaces {
    base: usize,
    joints: Vec<usize>,
}

impl Stage {
    pub fn new(run: &RunSpec, size: Size) -> Result<Self, PictureError> {
        let simulator = |error: &dyn core::fmt::Display| PictureError::Simulator(error.to_string());
        let mut model = MjModel::from_xml_string(&world_xml(run)?).map_err(|error| simulator(&error))?;
        let find = |kind, name: &str| {
            model.name_to_id(kind, name).ok_or_else(|| PictureError::Simulator(format!("it has no {name}")))
        };
        let of_body = |name: &str| -> Result<usize, PictureError> {
            let joint = model.body_jntadr()[find(MjtObjBase::mjOBJ_BODY, name)?];
            Ok(model.jnt_qposadr()[joint as usize] as usize)
        };
        let object = of_body(OBJECT)?;
        let mut robots = vec![];
        for spec in &run.robots {
            let described = Robot::new(&spec.config, &spec.urdf);
            let robot = described.map_err(|error| PictureError::Simulator(error.to_string()))?.model;
            let name = |element: &str| qualified(&spec.member.name, element);
            let joints = robot.joints().iter().map(|joint| {
                let joint = find(MjtObjBase::mjOBJ_JOINT, &name(&joint.name))?;
                Ok(model.jnt_qposadr()[joint] as usize)
            });
            let joints = joints.collect::<Result<_, PictureError>>()?;
            robots.push(RobotPlaces { base: of_body(&name(&robot.bodies()[0].name))?, joints });
        }
        paint(&mut model, run);
        let renderer = MjRenderer::builder().width(size.width).height(size.height).build(&model);
        let renderer = renderer.map_err(|error| PictureError::OpenRenderer(error.to_string()))?;
        let data = MjData::try_new(Box::new(model)).map_err(|error| simulator(&error))?;
        Ok(Self { data, renderer, object, robots })
    }

    /// A moment as rows of red, green and blue, the uppermost first.
    pub fn picture(&mut self, moment: &Snapshot, camera: MjvCamera) -> Result<&[u8], PictureError> {
        let positions = self.data.qpos_mut();
        positions[self.object..][..7].copy_from_slice(&moment.object);
        for (places, robot) in self.robots.iter().zip(&moment.robots) {
            positions[places.base..][..7].copy_from_slice(&robot.base);
            for (place, angle) in places.joints.iter().zip(robot.joints_rad) {
                positions[*place] = angle;
            }
        }
        self.data.kinematics();
        self.data.com_pos();
        self.data.camlight();
        self.renderer.set_camera(camera);
        let failed = |error: mujoco_rs::renderer::RendererError| PictureError::Render(error.to_string());
        self.renderer.sync_data(&mut self.data).map_err(failed)?;
        self.renderer.render().map_err(failed)?;
        Ok(self.renderer.rgb_flat().unwrap_or_default())
    }
}

/// So that robots are told apart.
fn paint(model: &mut MjModel, run: &RunSpec) {
    for geom in 0..model.ngeom() as usize {
        let Some(name) = model.id_to_name(MjtObjBase::mjOBJ_GEOM, geom) else { continue };
        let is_of = |robot: &str| name.strip_prefix(robot).is_some_and(|rest| rest.starts_with('/'));
        let robot = run.robots.iter().position(|spec| is_of(&spec.member.name));
        let color = match robot {
            _ if name == OBJECT => OBJECT_COLOR,
            Some(robot) => ROBOT_COLORS[robot % ROBOT_COLORS.len()],
            None => continue,
        };
        model.geom_rgba_mut()[geom] = color;
    }
}
