//! The object, what it can rest on, and where it and the hands are asked to be.

use super::colors;
use super::convert::{isometry, quaternion, transform, vector};
use mikoshi_config::RunSpec;
use mikoshi_observation::{Observation, TrackedObject};
use mikoshi_spatial::{Hand, Object, Odometry, Pose, World};
use nalgebra::{UnitQuaternion, Vector3};
use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{Boxes3D, Points3D};
use re_sdk_types::components::FillMode;

const OBJECT: &str = "/world/object";
const GHOST: &str = "/world/reference/object";
/// Of the mark of where a hand is asked to be.
const HAND_RADIUS_M: f32 = 0.03;
/// The ghost stands out from the object by so much where they coincide.
const GHOST_MARGIN_M: f32 = 0.01;

/// The object and its ghost.
pub struct Objects {
    half_size: [f32; 3],
    /// Grasping hands of each robot.
    hands: Vec<usize>,
}

impl Objects {
    /// Of a run.
    pub fn set(stream: &RecordingStream, run: &RunSpec) -> RecordingStreamResult<Self> {
        let half_size = run.scenario.object.size_m.map(|edge| 0.5 * edge as f32);
        let solid = |boxes: Boxes3D| boxes.with_fill_mode(FillMode::Solid);
        let object = Boxes3D::from_half_sizes([half_size]).with_colors([colors::object()]);
        stream.log_static(OBJECT, &solid(object))?;
        let fixed = &run.scenario.world.boxes;
        if !fixed.is_empty() {
            let turn = |yaw_deg: f64| {
                quaternion(&UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_deg.to_radians()))
            };
            let boxes = Boxes3D::from_centers_and_sizes(
                fixed.iter().map(|fixed| fixed.position_m),
                fixed.iter().map(|fixed| fixed.size_m),
            );
            let boxes = boxes
                .with_quaternions(fixed.iter().map(|fixed| turn(fixed.yaw_deg)))
                .with_labels(fixed.iter().map(|fixed| fixed.name.as_str()))
                .with_show_labels(false)
                .with_colors([colors::fixed()]);
            stream.log_static("/world/fixed", &solid(boxes))?;
        }
        let hands = run.robots.iter().map(|robot| robot.grasping_hands.len()).collect();
        Ok(Self { half_size, hands })
    }

    /// Where they are.
    ///
    /// # Errors
    /// Nobody takes it.
    pub fn show(
        &self,
        stream: &RecordingStream,
        observation: &Observation,
        object: &TrackedObject,
        X_BodyA: Option<&Pose<Object, Object>>,
    ) -> RecordingStreamResult<()> {
        stream.log(OBJECT, &transform(&isometry(&object.X_WBody)))?;
        let body_in_ref = X_BodyA.map_or_else(Pose::identity, Pose::inverse);
        let ghost = object.X_WA_ref.map(|X_WA_ref| isometry(&(X_WA_ref * body_in_ref)));
        let ghosts =
            Boxes3D::from_half_sizes(ghost.map(|_| self.half_size.map(|half| half + GHOST_MARGIN_M)))
                .with_centers(ghost.map(|X| vector(&X.translation.vector)))
                .with_quaternions(ghost.map(|X| quaternion(&X.rotation)))
                .with_colors([colors::ghost()])
                .with_fill_mode(FillMode::TransparentFillMajorWireframe);
        stream.log(GHOST, &ghosts)?;
        for (robot, frame) in observation.team_command.iter().enumerate() {
            let X_WO =
                Pose::<World, Odometry>::from_array(&observation.team_state.payload.odometry_pose[robot]);
            let poses = frame.payload.hand_pose_ref.iter().take(self.hands[robot]);
            let hands = poses.filter_map(|pose| Some(X_WO? * Pose::<Odometry, Hand>::from_array(pose)?));
            let marks = Points3D::new(hands.map(|X_WH| vector(&X_WH.translation)))
                .with_colors([colors::of_robot(robot)])
                .with_radii([HAND_RADIUS_M]);
            stream.log(format!("/world/reference/hands/{robot}"), &marks)?;
        }
        Ok(())
    }
}
