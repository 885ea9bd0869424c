//! Closing and opening hands, and where they have taken hold.

use crate::layout::{HandLayout, Layout};
use crate::pose::{body_pose, site_pose};
use mikoshi_ipc_types::{JointCommand, MAX_HANDS, PoseWire};
use mikoshi_physics::{Grip, is_in_reach};
use mikoshi_spatial::{Hand, Object, Pose};
use mujoco_rs::prelude::{MjData, MjModel, MjtSameFrame};
use nalgebra::UnitQuaternion;

/// Where on the object each hand of a robot has taken hold; zeros where it is pulled to its place.
pub type Taken = [PoseWire; MAX_HANDS];

/// Closes and opens hands as commanded; bit h of `holding` says for each robot whether hand h holds. What
/// changes acts from the second physics step on: the first one's constraints are set up already.
pub fn close_and_open(
    data: &mut MjData<Box<MjModel>>,
    layout: &Layout,
    commands: &[JointCommand],
    (holding, taken): (&mut [u64], &mut [Taken]),
    has_failed: impl Fn(usize, usize) -> bool,
) {
    mikoshi_physics::close_and_open(holding, commands, |robot, index, grip| {
        let Some(hand) = layout.robots[robot].hands.get(index) else { return false };
        let palm = || in_object(data, layout, hand.palm_site);
        let place = match grip {
            Grip::Open => None,
            Grip::Close => Some((hand.place_on_object, palm())),
            Grip::CloseBesideOthers => Some((in_object(data, layout, hand.object_site), palm())),
        };
        if place.is_some_and(|(place, palm)| !is_in_reach(&place, &palm)) {
            return false;
        }
        if let (Grip::CloseBesideOthers, Some((_, palm))) = (grip, place)
            && !has_failed(robot, index)
        {
            let taken = &mut taken[robot][index];
            *taken = palm.to_array();
            move_site(data, hand, taken);
        }
        if let Some(equality) = hand.equality {
            data.eq_active_mut()[equality] = grip != Grip::Open;
        }
        true
    });
}

/// Has all hands hold where they have taken hold, in a model that may not know of it.
pub fn restore(data: &mut MjData<Box<MjModel>>, layout: &Layout, taken: &[Taken]) {
    for (robot, taken) in layout.robots.iter().zip(taken) {
        for (hand, taken) in robot.hands.iter().zip(taken) {
            move_site(data, hand, taken);
        }
    }
}

/// The site that a hand is pulled to.
fn move_site(data: &mut MjData<Box<MjModel>>, hand: &HandLayout, X_OH: &PoseWire) {
    let [x, y, z, quaternion @ ..] = *X_OH;
    if quaternion == [0.0; 4] {
        return;
    }
    // SAFETY: numbers of the model change, no size and no index.
    let model = unsafe { data.model_mut() };
    model.site_pos_mut()[hand.object_site] = [x, y, z];
    model.site_quat_mut()[hand.object_site] = quaternion;
    model.site_sameframe_mut()[hand.object_site] = MjtSameFrame::mjSAMEFRAME_NONE;
}

/// Where a site is on the object.
fn in_object(data: &MjData<Box<MjModel>>, layout: &Layout, site: usize) -> Pose<Object, Hand> {
    let X_WO = body_pose::<Object>(data, &layout.object);
    let X_OS = X_WO.inverse() * site_pose::<Hand>(data, site);
    Pose::new(X_OS.translation, UnitQuaternion::new_normalize(X_OS.rotation.into_inner()))
}
