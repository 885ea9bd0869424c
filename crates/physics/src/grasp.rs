//! How hands hold the object: where by seed, and with which wrench.

use crate::BuildWorldError;
use crate::random::{Draws, Purpose};
use mikoshi_config::scenario::Grasp;
use mikoshi_config::{RobotSpec, Scenario};
use mikoshi_spatial::{Hand, Object, Pose, Twist, World, Wrench};
use nalgebra::{Isometry3, Translation3, Vector3};

/// Where on the object the grasping hands of robot `robot` are pulled to: where their palms are at tick 0, displaced by
/// the grasp offset along the object's axes.
pub fn grasp_offsets(scenario: &Scenario, robot: usize, spec: &RobotSpec) -> Vec<Isometry3<f64>> {
    let (Grasp::Weld { offset_m } | Grasp::Spring { offset_m, .. }) = scenario.grasp;
    let mut draws = Draws::new(scenario.seed, Purpose::GraspOffset, robot);
    let nominal = spec.hand_in_object.iter();
    let nominal = nominal.map(|pose| Pose::<Object, Hand>::from_array(pose).unwrap_or_else(Pose::identity));
    nominal
        .map(|X_OH| {
            let offset = Vector3::from_fn(|_, _| offset_m * (2.0 * draws.uniform() - 1.0));
            let at_tick_0 = Isometry3::from_parts(X_OH.translation.into(), X_OH.rotation);
            Translation3::from(offset) * at_tick_0
        })
        .collect()
}

/// A spring and damper at a hand, in all six directions.
#[derive(Clone, Copy, Debug)]
pub struct Spring {
    /// Along every axis.
    pub stiffness_n_m: f64,
    /// Along every axis.
    pub damping_ns_m: f64,
    /// About every axis.
    pub stiffness_nm_rad: f64,
    /// About every axis.
    pub damping_nms_rad: f64,
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
    /// applied for the step that follows. `palm` and `place` are where the hand is and is pulled to, with their twists.
    ///
    /// `f = k (p_palm − p_place) + d (v_palm − v_object)`, both velocities at the palm's origin, and
    /// `n = k_r log(R_palm R_placeᵀ) + d_r (ω_palm − ω_object)`.
    pub fn wrench_on_object(
        &self,
        palm: (&Pose<World, Hand>, Twist<World>),
        place: (&Pose<World, Hand>, Twist<World>),
    ) -> Wrench<World> {
        let stretch = place.0.displacement_to(palm.0);
        // The object's material at the palm's origin, so that the damper acts along one line.
        let rate = palm.1 - place.1.shifted(&stretch.linear);
        Wrench::new(
            stretch.linear * self.stiffness_n_m + rate.linear * self.damping_ns_m,
            stretch.angular * self.stiffness_nm_rad + rate.angular * self.damping_nms_rad,
        )
    }
}
