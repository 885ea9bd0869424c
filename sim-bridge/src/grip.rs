//! Which hands hold the object: a hand closes where its palm is near its place, and opens when it is told to. It is pulled to
//! its place where the object rests. Of an object that hangs in other robots' hands it takes hold where it is, near where it
//! held before.

use crate::layout::{HandLayout, Layout};
use crate::pose::{body_pose, site_pose};
use mikoshi_ipc_types::{JointCommand, MAX_HANDS, PoseWire};
use mikoshi_spatial::{Hand, Object, Pose};
use mujoco_rs::prelude::{MjData, MjModel, MjtSameFrame};
use nalgebra::UnitQuaternion;

/// How near its place on the object a palm must be for its hand to close on it.
const REACH_M: f64 = 0.02;
/// The same about an axis.
const REACH_RAD: f64 = 0.1;

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
    let held = holding.iter().enumerate();
    let holders = held.fold(0_u64, |set, (robot, holding)| set | u64::from(*holding != 0) << robot);
    let robots = layout.robots.iter().zip(commands).zip(holding.iter_mut().zip(taken));
    for (index_of_robot, ((robot, command), (holding, taken))) in robots.enumerate() {
        let others_hold = holders & !(1 << index_of_robot) != 0;
        for (index, (hand, taken)) in robot.hands.iter().zip(taken).enumerate() {
            let bit = 1 << index;
            let (holds, shall_hold) = (*holding & bit != 0, command.closed_hands & bit != 0);
            if holds == shall_hold {
                continue;
            }
            if shall_hold {
                let palm = in_object(data, layout, hand.palm_site);
                let place = match others_hold {
                    true => in_object(data, layout, hand.object_site),
                    false => hand.place_on_object,
                };
                if !is_in_reach(&place, &palm) {
                    continue;
                }
                if others_hold && !has_failed(index_of_robot, index) {
                    *taken = palm.to_array();
                    move_site(data, hand, taken);
                }
            }
            *holding ^= bit;
            if let Some(equality) = hand.equality {
                data.eq_active_mut()[equality] = shall_hold;
            }
        }
    }
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

fn is_in_reach(place: &Pose<Object, Hand>, palm: &Pose<Object, Hand>) -> bool {
    let gap = place.displacement_to(palm);
    gap.linear.norm() <= REACH_M && gap.angular.norm() <= REACH_RAD
}
