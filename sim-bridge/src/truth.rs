//! The world as it truly is, for observers only.

use crate::layout::{BodyLayout, HandLayout, Layout, RobotLayout};
use crate::pose::{body_pose, free_body_twist, site_pose, wire};
use crate::support;
use crate::tally::{Tally, Unintended};
use mikoshi_ipc_types::{MAX_HANDS, ObjectTruth, RobotTruth};
use mikoshi_spatial::{World, Wrench};
use mujoco_rs::prelude::{MjData, MjModel, MjtConstraint};
use nalgebra::{Vector2, Vector3};

/// Share of its weight that a foot must bear to count as a support.
const BEARING_SHARE: f64 = 0.05;
/// A robot whose base is tilted further has fallen.
const FALLEN_TILT_RAD: f64 = 0.6;
/// A robot whose base is lower than this share of its height at tick 0 has fallen.
const FALLEN_HEIGHT_SHARE: f64 = 0.5;

/// The robot of now, and what happened to it in the last tick. `truth.fallen` stays set.
pub fn of_robot(
    data: &MjData<Box<MjModel>>,
    layout: &RobotLayout,
    tally: &Tally,
    hand_wrenches: &[Wrench<World>; MAX_HANDS],
    truth: &mut RobotTruth,
) {
    let base = body_pose(data, &layout.base);
    truth.base_pose = wire(&base);
    for (index, joint) in layout.joints.iter().enumerate() {
        truth.joint_position_rad[index] = data.qpos()[joint.qpos];
    }
    truth.joint_torque_peak_nm = tally.torque_peak_nm;
    truth.saturated_joints = tally.saturated_joints;
    for (index, hand) in layout.hands.iter().enumerate() {
        truth.hand_pose[index] = wire(&site_pose(data, hand.palm_site));
        truth.hand_wrench[index] = hand_wrenches[index].to_array();
    }
    for (index, foot) in layout.feet.iter().enumerate() {
        truth.sole_pose[index] = wire(&site_pose(data, foot.sole_site));
        truth.ground_wrench[index] = tally.mean_ground_wrench(index).to_array();
    }
    let com = data.subtree_com()[layout.base.body];
    truth.com_position_m = com;
    let (zmp, margin) = zero_moment_point(data, layout, tally, &com);
    truth.zmp_position_m = zmp.into();
    truth.zmp_margin_m = margin;
    truth.tilt_rad = (base.rotation * Vector3::z()).angle(&Vector3::z());
    let has_fallen = truth.tilt_rad > FALLEN_TILT_RAD
        || base.translation.z < FALLEN_HEIGHT_SHARE * layout.initial_base_height_m
        || tally.is_on_the_floor;
    truth.fallen |= u64::from(has_fallen);
}

/// Centre of pressure of all ground contact, and its margin in the hull of the feet that bear.
///
/// With the mean ground wrench (f, n) about the world's origin: p = (−n_y, n_x) / f_z. Where no foot
/// bears, the ground point below the centre of mass, with margin 0.
fn zero_moment_point(
    data: &MjData<Box<MjModel>>,
    layout: &RobotLayout,
    tally: &Tally,
    com: &[f64; 3],
) -> (Vector2<f64>, f64) {
    let bears = |foot: usize| tally.mean_ground_wrench(foot).force.z > BEARING_SHARE * layout.weight_n;
    let ground = (0..layout.feet.len())
        .fold(Wrench::<World>::zero(), |sum, foot| sum + tally.mean_ground_wrench(foot));
    let point = if ground.force.z > BEARING_SHARE * layout.weight_n {
        Vector2::new(-ground.moment.y, ground.moment.x) / ground.force.z
    } else {
        Vector2::new(com[0], com[1])
    };
    let mut corners = [Vector2::zeros(); support::MAX_CORNERS];
    let mut count = 0;
    for (_, foot) in layout.feet.iter().enumerate().filter(|(index, _)| bears(*index)) {
        let sole = site_pose(data, foot.sole_site);
        for (corner, in_sole) in corners[count..].iter_mut().zip(&foot.corners) {
            *corner = sole.transform_point(&in_sole.push(0.0).into()).coords.xy();
        }
        count += foot.corners.len();
    }
    (point, support::margin(&mut corners[..count], &point).unwrap_or(0.0))
}

/// The object of now, and what touched what in the last tick.
pub fn of_object(
    data: &MjData<Box<MjModel>>,
    layout: &Layout,
    unintended: &Unintended,
    truth: &mut ObjectTruth,
) {
    truth.pose = wire(&body_pose(data, &layout.object));
    truth.twist = free_body_twist(data, &layout.object).to_array();
    truth.unintended_contacts = unintended.count;
    truth.unintended_pair = unintended.first_pair;
    truth.robot_count = layout.robots.len() as u64;
}

/// The wrench that a weld passes from a hand to the object, at the palm's origin, in world axes; of the
/// physics step whose constraint forces stand.
///
/// A constraint's generalized forces are Jᵀ λ. The columns of the object's free joint hold what acts
/// on the object: a force in world axes and a moment about its origin in its own axes.
///
/// # Safety
/// The constraint forces of a physics step stand: the simulator has solved for them, and has not yet
/// set up the next step's constraints.
pub unsafe fn weld_wrench(
    data: &MjData<Box<MjModel>>,
    object: &BodyLayout,
    hand: &HandLayout,
) -> Wrench<World> {
    let Some(equality) = hand.equality else { return Wrench::zero() };
    // SAFETY: these arrays are of the step's constraints, which the caller vouches for.
    let (forces, lengths, starts, columns) =
        unsafe { (data.efc_force(), data.efc_j_rownnz(), data.efc_j_rowadr(), data.efc_j_colind()) };
    let mut generalized = [0.0; 6];
    let rows = data.efc_type().iter().zip(data.efc_id()).enumerate();
    for (row, _) in
        rows.filter(|(_, (kind, id))| **kind == MjtConstraint::mjCNSTR_EQUALITY && **id == equality as i32)
    {
        let entries = starts[row] as usize..(starts[row] + lengths[row]) as usize;
        for (column, value) in columns[entries.clone()].iter().zip(&data.efc_j()[entries]) {
            if let Some(sum) = (*column as usize).checked_sub(object.dof).and_then(|i| generalized.get_mut(i))
            {
                *sum += value * forces[row];
            }
        }
    }
    let [fx, fy, fz, nx, ny, nz] = generalized;
    let pose = site_pose(data, hand.palm_site);
    let object = body_pose(data, object);
    Wrench::new(Vector3::new(fx, fy, fz), object.rotation * Vector3::new(nx, ny, nz))
        .shifted(&(object.translation.vector - pose.translation.vector))
}
