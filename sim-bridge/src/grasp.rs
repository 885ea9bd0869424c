//! Where on the object hands are pulled to, by MuJoCo's names.

use crate::mjcf::{OBJECT, qualified};
use crate::robot::Robot;
use mikoshi_config::Scenario;
use mikoshi_physics::grasp_offsets;
use nalgebra::Isometry3;

/// Where on the object a hand is pulled to.
pub struct GraspSite {
    /// The site at the palm.
    pub palm: String,
    /// The site on the object.
    pub site: String,
    /// Where the palm is at tick 0, displaced by the grasp offset along the object's axes.
    pub pose_in_object: Isometry3<f64>,
    /// Whether the hand holds at tick 0.
    pub begins_closed: bool,
}

/// The grasps of all robots' grasping hands, in hand order.
pub fn sites(scenario: &Scenario, robots: &[Robot]) -> Vec<GraspSite> {
    let of_robot = |(index, robot): (usize, &Robot)| {
        let palms =
            robot.hands.iter().map(|hand| qualified(robot.name(), &robot.model.frame(hand.frame).name));
        let poses = grasp_offsets(scenario, index, robot.spec);
        let site = |(palm, pose_in_object): (String, _)| GraspSite {
            site: qualified(OBJECT, &palm),
            palm,
            pose_in_object,
            begins_closed: scenario.begins_closed(robot.name()),
        };
        palms.zip(poses).map(site).collect::<Vec<_>>()
    };
    robots.iter().enumerate().flat_map(of_robot).collect()
}
