//! What a robot stands on, where its weight is, and what its hands apply to the object.

use super::colors;
use super::convert::vector;
use mikoshi_config::RobotSpec;
use mikoshi_humanoid::balance::PerFoot;
use mikoshi_humanoid::estimate::SoleRectangle;
use mikoshi_ipc_types::RobotTruth;
use mikoshi_observation::{Observation, true_support};
use mikoshi_robot::Robot;
use mikoshi_spatial::{Foot, Hand, Pose, World};
use nalgebra::Vector3;
use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{Arrows3D, LineStrips3D, Points3D};

/// Length of an arrow for each newton of the force it stands for.
const ARROW_M_N: f64 = 0.02;
/// Over the floor, so that lines are not in it.
const GROUND_M: f64 = 0.004;
const LINE_RADIUS_M: f32 = 0.006;
const ZMP_RADIUS_M: f32 = 0.02;
const ARROW_RADIUS_M: f32 = 0.008;

/// The balance of one robot.
pub struct Balance {
    robot: usize,
    soles: PerFoot<SoleRectangle>,
    weight_n: f64,
    hands: usize,
    feet_path: String,
    support_path: String,
    zmp_path: String,
    forces_path: String,
}

impl Balance {
    /// Of this robot.
    ///
    /// # Errors
    /// Nobody takes what is shown.
    pub fn set(
        stream: &RecordingStream,
        index: usize,
        spec: &RobotSpec,
        robot: &Robot,
        weight_n: f64,
    ) -> RecordingStreamResult<Self> {
        let name = &spec.member.name;
        let balance = Self {
            robot: index,
            soles: robot.sole_rectangles,
            weight_n,
            hands: spec.grasping_hands.len(),
            feet_path: format!("/world/balance/{name}/feet"),
            support_path: format!("/world/balance/{name}/support"),
            zmp_path: format!("/world/balance/{name}/zmp"),
            forces_path: format!("/world/forces/{name}"),
        };
        let lines = || LineStrips3D::update_fields().with_radii([LINE_RADIUS_M]);
        stream.log_static(balance.feet_path.as_str(), &lines().with_colors([colors::of_robot(index)]))?;
        stream.log_static(balance.support_path.as_str(), &lines().with_colors([colors::support()]))?;
        let points = Points3D::update_fields().with_radii([ZMP_RADIUS_M]).with_colors([colors::zmp()]);
        stream.log_static(balance.zmp_path.as_str(), &points)?;
        let arrows = Arrows3D::update_fields().with_radii([ARROW_RADIUS_M]).with_colors([colors::force()]);
        stream.log_static(balance.forces_path.as_str(), &arrows)?;
        Ok(balance)
    }

    /// How it is.
    ///
    /// # Errors
    /// Nobody takes it.
    pub fn show(&self, stream: &RecordingStream, observation: &Observation) -> RecordingStreamResult<()> {
        let truth = &observation.robot_truth[self.robot].payload;
        let feet = LineStrips3D::update_fields().with_strips(self.feet(truth));
        stream.log(self.feet_path.as_str(), &feet)?;
        let support = true_support(&self.soles, truth, self.weight_n);
        let corners = support.vertices().iter();
        let loops = closed(corners.map(|corner| Vector3::new(corner.x, corner.y, GROUND_M)).collect());
        let support = LineStrips3D::update_fields().with_strips([loops]);
        stream.log(self.support_path.as_str(), &support)?;
        let [x, y] = truth.zmp_position_m;
        let zmp = Points3D::update_fields().with_positions([vector(&Vector3::new(x, y, GROUND_M))]);
        stream.log(self.zmp_path.as_str(), &zmp)?;
        let (origins, vectors): (Vec<_>, Vec<_>) = self.forces(truth).unzip();
        let arrows = Arrows3D::update_fields().with_origins(origins).with_vectors(vectors);
        stream.log(self.forces_path.as_str(), &arrows)
    }

    /// The edges of its soles.
    fn feet<'a>(&'a self, truth: &'a RobotTruth) -> impl Iterator<Item = Vec<[f32; 3]>> + 'a {
        [self.soles.right, self.soles.left].into_iter().zip(&truth.sole_pose).filter_map(|(sole, pose)| {
            let X_WF = Pose::<World, Foot>::from_array(pose)?;
            let corners = [
                (sole.x_min, sole.y_min),
                (sole.x_max, sole.y_min),
                (sole.x_max, sole.y_max),
                (sole.x_min, sole.y_max),
            ];
            let corner = |(x, y): (f64, f64)| X_WF.transform_point(&Vector3::new(x, y, GROUND_M));
            Some(closed(corners.map(corner).to_vec()))
        })
    }

    /// Where each hand's force acts, and the arrow that stands for it.
    fn forces<'a>(&self, truth: &'a RobotTruth) -> impl Iterator<Item = ([f32; 3], [f32; 3])> + 'a {
        let hands = truth.hand_pose.iter().zip(&truth.hand_wrench).take(self.hands);
        hands.filter_map(|(pose, &[x, y, z, ..])| {
            let X_WH = Pose::<World, Hand>::from_array(pose)?;
            Some((vector(&X_WH.translation), vector(&(Vector3::new(x, y, z) * ARROW_M_N))))
        })
    }
}

fn closed(corners: Vec<Vector3<f64>>) -> Vec<[f32; 3]> {
    let first = corners.first().copied();
    corners.into_iter().chain(first).map(|corner| vector(&corner)).collect()
}
