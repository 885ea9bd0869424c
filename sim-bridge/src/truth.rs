//! The world as it truly is, for observers only.

use crate::layout::{BodyLayout, HandLayout, Layout, RobotLayout};
use crate::pose::{body_pose, body_twist, site_pose};
use crate::tally::{Contacts, Tally};
use mikoshi_humanoid::balance::PerFoot;
use mikoshi_ipc_types::{MAX_HANDS, ObjectTruth, RobotTruth};
use mikoshi_physics::Stance;
use mikoshi_spatial::{Base, Hand, Object, World, Wrench};
use mujoco_rs::prelude::{MjData, MjModel, MjtConstraint};
use nalgebra::Vector3;

/// The robot of now, and what happened to it in the last tick. `truth.fallen` stays set.
pub fn of_robot(
    data: &MjData<Box<MjModel>>,
    layout: &RobotLayout,
    tally: &Tally,
    hand_wrenches: &[Wrench<World>; MAX_HANDS],
    truth: &mut RobotTruth,
) {
    let X_WB = body_pose::<Base>(data, &layout.base);
    for (index, joint) in layout.joints.iter().enumerate() {
        truth.joint_position_rad[index] = data.qpos()[joint.qpos];
    }
    truth.joint_torque_peak_nm = tally.torque_peak_nm;
    truth.saturated_joints = tally.saturated_joints;
    for (index, hand) in layout.hands.iter().enumerate() {
        truth.hand_pose[index] = site_pose::<Hand>(data, hand.palm_site).to_array();
        truth.hand_wrench[index] = hand_wrenches[index].to_array();
    }
    let feet = PerFoot::from_fn(|side| &layout.feet[side as usize]);
    let stance = Stance {
        base: X_WB,
        soles: PerFoot::from_fn(|side| site_pose(data, feet[side].sole_site)),
        ground: PerFoot::from_fn(|side| tally.mean_ground_wrench(side as usize)),
        com_m: data.subtree_com()[layout.base.body].into(),
        is_on_the_floor: tally.is_on_the_floor,
    };
    layout.standing.judge(&stance, truth);
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
