//! How hands hold the object: where by seed, and with which wrench.

use crate::BuildWorldError;
use crate::layout::HandLayout;
use crate::mjcf::{OBJECT, qualified};
use crate::pose::{site_pose, site_twist};
use crate::random::{Draws, Purpose};
use crate::robot::{Robot, isometry};
use mikoshi_config::Scenario;
use mikoshi_config::scenario::Grasp;
use mikoshi_spatial::{Hand, World, Wrench};
use mujoco_rs::prelude::{MjData, MjModel};
use nalgebra::{Isometry3, Translation3, Vector3};

/// Where on the object a hand is pulled to.
pub struct GraspSite {
    /// The site at the palm.
    pub palm: String,
    /// The site on the object.
    pub site: String,
    /// Where the palm is at tick 0, displaced by the grasp offset along the object's axes.
    pub pose_in_object: Isometry3<f64>,
}

/// The grasps of all robots' grasping hands, in hand order.
pub fn sites(scenario: &Scenario, robots: &[Robot]) -> Vec<GraspSite> {
    let (Grasp::Weld { offset_m } | Grasp::Spring { offset_m, .. }) = scenario.grasp;
    let mut sites = vec![];
    for (index, robot) in robots.iter().enumerate() {
        let mut draws = Draws::new(scenario.seed, Purpose::GraspOffset, index);
        for (hand, nominal) in robot.hands.iter().zip(&robot.spec.hand_in_object) {
            let offset = Vector3::from_fn(|_, _| offset_m * (2.0 * draws.uniform() - 1.0));
            let palm = qualified(robot.name(), &robot.model.frame(hand.frame).name);
            sites.push(GraspSite {
                site: qualified(OBJECT, &palm),
                palm,
                pose_in_object: Translation3::from(offset) * isometry(nominal),
            });
        }
    }
    sites
}

/// A spring and damper at a hand, in all six directions.
#[derive(Clone, Copy, Debug)]
pub struct Spring {
    stiffness_n_m: f64,
    damping_ns_m: f64,
    stiffness_nm_rad: f64,
    damping_nms_rad: f64,
}

impl Spring {
    /// The spring of the scenario; none where the grasp is a weld.
    ///
    /// # Errors
    /// The explicit integration of so much damping would diverge: damping · step over the object's
    /// inertia nears 1.
    pub fn of(scenario: &Scenario, hands: usize) -> Result<Option<Self>, BuildWorldError> {
        let Grasp::Spring { stiffness_n_m, damping_ns_m, stiffness_nm_rad, damping_nms_rad, .. } =
            scenario.grasp
        else {
            return Ok(None);
        };
        let (object, step_s) = (&scenario.object, scenario.physics.step_s);
        let [mut x, mut y, mut z] = object.size_m;
        [x, y, z] = [x * x, y * y, z * z];
        let smallest_inertia = object.mass_kg / 12.0 * (y + z).min(x + z).min(x + y);
        let ratios = [damping_ns_m / object.mass_kg, damping_nms_rad / smallest_inertia];
        // An explicit damper is stable up to 2 and oscillates from 1 on.
        if let Some(ratio) =
            ratios.map(|ratio| hands as f64 * step_s * ratio).into_iter().find(|&r| r.is_nan() || r >= 0.5)
        {
            return Err(BuildWorldError::Inconsistent {
                place: "[grasp]".to_owned(),
                what: format!(
                    "{hands} dampers on this object give damping · step / inertia = {ratio:.2}, expected less \
                     than 0.5: take a shorter physics step, less damping or a heavier object"
                ),
            });
        }
        Ok(Some(Self { stiffness_n_m, damping_ns_m, stiffness_nm_rad, damping_nms_rad }))
    }

    /// The wrench on the object at the palm's origin, in world axes, and its opposite on the hand, are
    /// applied for the step that follows.
    ///
    /// `f = k (p_palm − p_site) + d (v_palm − v_object)`, both velocities at the palm's origin, and
    /// `n = k_r log(R_palm R_siteᵀ) + d_r (ω_palm − ω_object)`.
    pub fn wrench_on_object(&self, data: &MjData<Box<MjModel>>, hand: &HandLayout) -> Wrench<World> {
        let X_WH = site_pose::<Hand>(data, hand.palm_site);
        let X_WG = site_pose::<Hand>(data, hand.object_site);
        let stretch = X_WG.displacement_to(&X_WH);
        // The object's material at the palm's origin, so that the damper acts along one line.
        let rate =
            site_twist(data, hand.palm_site) - site_twist(data, hand.object_site).shifted(&stretch.linear);
        Wrench::new(
            stretch.linear * self.stiffness_n_m + rate.linear * self.damping_ns_m,
            stretch.angular * self.stiffness_nm_rad + rate.angular * self.damping_nms_rad,
        )
    }
}
