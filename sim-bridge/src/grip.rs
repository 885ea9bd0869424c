//! Which hands hold the object: a hand closes where its palm is near its place, and opens when it is told to.

use crate::layout::{HandLayout, Layout};
use crate::pose::{body_pose, site_pose};
use mikoshi_ipc_types::JointCommand;
use mikoshi_spatial::{Hand, Object};
use mujoco_rs::prelude::{MjData, MjModel};

/// How near its place on the object a palm must be for its hand to close on it.
const REACH_M: f64 = 0.02;
/// The same about an axis.
const REACH_RAD: f64 = 0.1;

/// Closes and opens hands as commanded; bit h of `holding` says for each robot whether hand h holds. What
/// changes acts from the second physics step on: the first one's constraints are set up already.
pub fn close_and_open(
    data: &mut MjData<Box<MjModel>>,
    layout: &Layout,
    commands: &[JointCommand],
    holding: &mut [u64],
) {
    for ((robot, command), holding) in layout.robots.iter().zip(commands).zip(holding) {
        for (index, hand) in robot.hands.iter().enumerate() {
            let bit = 1 << index;
            let (holds, shall_hold) = (*holding & bit != 0, command.closed_hands & bit != 0);
            if holds == shall_hold || shall_hold && !is_in_reach(data, layout, hand) {
                continue;
            }
            *holding ^= bit;
            if let Some(equality) = hand.equality {
                data.eq_active_mut()[equality] = shall_hold;
            }
        }
    }
}

fn is_in_reach(data: &MjData<Box<MjModel>>, layout: &Layout, hand: &HandLayout) -> bool {
    let place = body_pose::<Object>(data, &layout.object) * hand.place_on_object;
    let gap = place.displacement_to(&site_pose::<Hand>(data, hand.palm_site));
    gap.linear.norm() <= REACH_M && gap.angular.norm() <= REACH_RAD
}
