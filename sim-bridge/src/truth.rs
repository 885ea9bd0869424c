//! The world as it truly is, for observers only.

use crate::layout::{BodyLayout, HandLayout, Layout, RobotLayout};
use crate::pose::{body_pose, body_twist, site_pose};
use crate::tally::{Contacts, Tally};
use mikoshi_humanoid::balance::PerFoot;
use mikoshi_humanoid::estimate::{self, SupportPolygon};
use mikoshi_ipc_types::{MAX_HANDS, ObjectTruth, RobotTruth};
use mikoshi_spatial::{Base, Foot, Hand, Object, World, Wrench};
use mujoco_rs::prelude::{MjData, MjModel, MjtConstraint};
use nalgebra::{Vector2, Vector3};

/// Share of its weight that a foot must bear to count as a support.
const BEARING_SHARE: f64 = 0.05;
/// Margin of a robot that nothing supports: finite, as everything that travels.
const NO_SUPPORT_M: f64 = -1.0;
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
    let X_WB = body_pose::<Base>(data, &layout.base);
    truth.base_pose = X_WB.to_array();
    for (index, joint) in layout.joints.iter().enumerate() {
        truth.joint_position_rad[index] = data.qpos()[joint.qpos];
    }
    truth.joint_torque_peak_nm = tally.torque_peak_nm;
    truth.saturated_joints = tally.saturated_joints;
    for (index, hand) in layout.hands.iter().enumerate() {
        truth.hand_pose[index] = site_pose::<Hand>(data, hand.palm_site).to_array();
        truth.hand_wrench[index] = hand_wrenches[index].to_array();
    }
    for (index, foot) in layout.feet.iter().enumerate() {
        truth.sole_pose[index] = site_pose::<Foot>(data, foot.sole_site).to_array();
        truth.ground_wrench[index] = tally.mean_ground_wrench(index).to_array();
    }
    let com = data.subtree_com()[layout.base.body];
    truth.com_position_m = com;
    let (zmp, margin) = zero_moment_point(data, layout, tally, &com);
    truth.zmp_position_m = zmp.into();
    truth.zmp_margin_m = margin;
    truth.tilt_rad = (X_WB.rotation * Vector3::z()).angle(&Vector3::z());
    let has_fallen = truth.tilt_rad > FALLEN_TILT_RAD
        || X_WB.translation.z < FALLEN_HEIGHT_SHARE * layout.initial_base_height_m
        || tally.is_on_the_floor;
    truth.fallen |= u64::from(has_fallen);
}

/// Centre of pressure of all ground contact on z = 0, and its distance from the edge of the hull of the
/// feet that bear. Where none bears, the ground point below the centre of mass, and −1 m.
fn zero_moment_point(
    data: &MjData<Box<MjModel>>,
    layout: &RobotLayout,
    tally: &Tally,
    com: &[f64; 3],
) -> (Vector2<f64>, f64) {
    let least_force_n = BEARING_SHARE * layout.weight_n;
    let feet = || layout.feet.iter().enumerate();
    let ground = feet().fold(Wrench::zero(), |sum, (foot, _)| sum + tally.mean_ground_wrench(foot));
    let point = estimate::zero_moment_point(&ground, 0.0, least_force_n)
        .unwrap_or_else(|| Vector2::new(com[0], com[1]));
    let standing = PerFoot::from_fn(|side| {
        let (foot, layout) = feet().nth(side as usize)?;
        let bears = tally.mean_ground_wrench(foot).force.z > least_force_n;
        bears.then(|| site_pose(data, layout.sole_site))
    });
    let support = SupportPolygon::of_feet(&layout.soles, &standing);
    (point, support.signed_distance(&point).max(NO_SUPPORT_M))
}

/// The object of now, and what touched what in the last tick.
pub fn of_object(data: &MjData<Box<MjModel>>, layout: &Layout, contacts: &Contacts, truth: &mut ObjectTruth) {
    truth.pose = body_pose::<Object>(data, &layout.object).to_array();
    truth.twist = body_twist::<Object>(data, &layout.object).to_array();
    truth.support_wrench = contacts.mean_support_wrench().to_array();
    truth.unintended_contacts = contacts.unintended;
    truth.unintended_pair = contacts.unintended_pair;
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
    let X_WH = site_pose::<Hand>(data, hand.palm_site);
    let X_WA = body_pose::<Object>(data, object);
    Wrench::new(Vector3::new(fx, fy, fz), X_WA.rotation * Vector3::new(nx, ny, nz))
        .shifted(&(X_WA.translation - X_WH.translation))
}
