//! Where the object is, if its grasps yield.

use mikoshi_config::scenario::Scenario;
use mikoshi_cooperation::{HandInput, VirtualStick};
use mikoshi_spatial::{Hand, Pose, Twist, World, Wrench};

/// How grasps yield, which no encoder sees.
///
/// A hand that applies (f, n) to the object has left its grip behind by (f / k, n / k_φ).
#[derive(Clone, Copy, Debug)]
pub(crate) struct GraspCompliance {
    m_n: f64,
    rad_nm: f64,
    /// Pole of the wrenches' low-pass: noise is no displacement.
    filter_pole: f64,
}

impl GraspCompliance {
    /// As the scenario has it calibrated; none if it hasn't.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let hybrid = &scenario.hybrid;
        let inverse = |stiffness: Option<f64>| stiffness.map_or(0.0, f64::recip);
        let filter_rad = core::f64::consts::TAU * hybrid.filter_hz * scenario.control_period_s;
        Self {
            m_n: inverse(hybrid.grasp_stiffness_n_m),
            rad_nm: inverse(hybrid.grasp_stiffness_nm_rad),
            filter_pole: (-filter_rad).exp(),
        }
    }

    /// How far the object is from the mean of the sticks' tips (eq. 27), by the hands' filtered wrenches,
    /// which go one tick on. `shares` are the tips' weights in that mean.
    pub(crate) fn object_yield<'a>(
        &self,
        filtered: &mut [[f64; 6]],
        hands: impl Iterator<Item = (&'a HandInput, &'a VirtualStick)>,
        shares: &[f64],
    ) -> Twist<World> {
        let mut mean = Twist::zero();
        for ((filtered, share), (hand, stick)) in filtered.iter_mut().zip(shares).zip(hands) {
            for (filtered, wrench) in filtered.iter_mut().zip(hand.wrench.to_array()) {
                *filtered = wrench + self.filter_pole * (*filtered - wrench);
            }
            mean += self.tip_yield(&hand.pose, stick, &Wrench::from_array(filtered)) * *share;
        }
        mean
    }

    /// How far the point of the object is displaced where the tip of a hand's stick is.
    fn tip_yield(
        &self,
        X_WH: &Pose<World, Hand>,
        stick: &VirtualStick,
        wrench: &Wrench<World>,
    ) -> Twist<World> {
        let grip = -Twist::new(wrench.force * self.m_n, wrench.moment * self.rad_nm);
        grip.shifted(&stick.vector(X_WH))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_spatial::Object;
    use nalgebra::{UnitQuaternion, Vector3};

    #[test]
    fn an_object_hangs_behind_hands_that_push_it() {
        let compliance = GraspCompliance { m_n: 1e-3, rad_nm: 1e-2, filter_pole: 0.0 };
        let hand = |y: f64, force: Vector3<f64>, moment: Vector3<f64>| {
            let pose = Pose::<World, Hand>::new(Vector3::new(0.0, y, 0.0), UnitQuaternion::identity());
            HandInput { pose, pose_commanded: pose, wrench: Wrench::new(force, moment) }
        };
        let lift = Vector3::new(0.0, 0.0, 2.0);
        let hands = [hand(0.5, lift, Vector3::zeros()), hand(-0.5, lift, Vector3::new(0.4, 0.0, 0.0))];
        let sticks = hands.map(|hand| VirtualStick::at_grasp(&hand.pose, &Pose::<World, Object>::identity()));
        let mut filtered = [[0.0; 6]; 2];
        let found = compliance.object_yield(&mut filtered, hands.iter().zip(&sticks), &[0.5, 0.5]);
        // Both lift 2 mm short; one turns 4 mrad about its palm, half a metre from the middle.
        assert!(
            (found.linear - Vector3::new(0.0, 0.0, -0.002 - 0.5 * 0.004 * 0.5)).norm() < 1e-12,
            "{found:?}"
        );
        assert!((found.angular - Vector3::new(-0.002, 0.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn noise_is_filtered_before_it_moves_the_object() {
        let compliance = GraspCompliance { m_n: 1e-3, rad_nm: 0.0, filter_pole: 0.9 };
        let pose = Pose::<World, Hand>::identity();
        let wrench = Wrench::new(Vector3::new(10.0, 0.0, 0.0), Vector3::zeros());
        let hand = HandInput { pose, pose_commanded: pose, wrench };
        let stick = VirtualStick::at_grasp(&pose, &Pose::<World, Object>::identity());
        let mut filtered = [[0.0; 6]];
        let found = compliance.object_yield(&mut filtered, [(&hand, &stick)].into_iter(), &[1.0]);
        assert!((found.linear.x + 0.001).abs() < 1e-12, "a tenth of 10 N by 1 mm/N");
    }
}
