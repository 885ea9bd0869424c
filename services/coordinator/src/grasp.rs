//! Where the object is, if its grasps yield.

use mikoshi_config::scenario::Scenario;
use mikoshi_cooperation::HandInput;
use mikoshi_spatial::{Twist, World, Wrench};
use nalgebra::Vector3;

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
        Self::of_stiffness(scenario, hybrid.grasp_stiffness_n_m, hybrid.grasp_stiffness_nm_rad)
    }

    /// The same; where nobody has calibrated it, as if all that yields were the grasp.
    pub(crate) fn at_least_of_a_hand(scenario: &Scenario) -> Self {
        let hybrid = &scenario.hybrid;
        let n_m = hybrid.grasp_stiffness_n_m.unwrap_or(hybrid.hand_stiffness_n_m);
        let nm_rad = hybrid.grasp_stiffness_nm_rad.unwrap_or(hybrid.hand_stiffness_nm_rad);
        Self::of_stiffness(scenario, Some(n_m), Some(nm_rad))
    }

    fn of_stiffness(scenario: &Scenario, n_m: Option<f64>, nm_rad: Option<f64>) -> Self {
        let hybrid = &scenario.hybrid;
        let inverse = |stiffness: Option<f64>| stiffness.map_or(0.0, f64::recip);
        let filter_rad = core::f64::consts::TAU * hybrid.filter_hz * scenario.control_period_s;
        Self { m_n: inverse(n_m), rad_nm: inverse(nm_rad), filter_pole: (-filter_rad).exp() }
    }

    /// How far the object is from the mean of the sticks' tips (eq. 27), by the hands' filtered wrenches,
    /// which go one tick on. With each hand comes the lever from it to its tip, in the world. `shares` are
    /// the tips' weights in that mean, and in what they bear of the external wrench (W⁻); hands without a
    /// share take no part.
    ///
    /// Unless the object `is_free`, only the internal part of the wrenches counts. An object that something
    /// holds, a wall that it is pressed against or what it rests on, would else seem not to follow its hands
    /// at all, and they would push it harder and harder until it slips.
    pub(crate) fn object_yield<'a>(
        &self,
        filtered: &mut [[f64; 6]],
        hands: impl Iterator<Item = (&'a HandInput, &'a Vector3<f64>)> + Clone,
        shares: &[f64],
        is_free: bool,
    ) -> Twist<World> {
        let mut held = Wrench::zero();
        for ((filtered, share), (hand, lever)) in filtered.iter_mut().zip(shares).zip(hands.clone()) {
            for (filtered, wrench) in filtered.iter_mut().zip(hand.wrench.to_array()) {
                *filtered = wrench + self.filter_pole * (*filtered - wrench);
            }
            if !is_free && *share != 0.0 {
                held += Wrench::from_array(filtered).shifted(&-lever);
            }
        }
        let mut mean = Twist::zero();
        for ((filtered, share), (_, lever)) in filtered.iter().zip(shares).zip(hands) {
            let on_holder = (held * *share).shifted(lever);
            let on_object = Wrench::from_array(filtered) - on_holder;
            mean += self.tip_yield(lever, &on_object) * *share;
        }
        mean
    }

    /// How far the point of the object is displaced where the tip of a hand's stick is, by the lever from hand to tip.
    pub(crate) fn tip_yield(&self, lever: &Vector3<f64>, wrench: &Wrench<World>) -> Twist<World> {
        self.grip_yield(wrench).shifted(lever)
    }

    /// How far the object is displaced in a hand's grip.
    pub(crate) fn grip_yield(&self, wrench: &Wrench<World>) -> Twist<World> {
        -Twist::new(wrench.force * self.m_n, wrench.moment * self.rad_nm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_cooperation::VirtualStick;
    use mikoshi_spatial::{Hand, Object, Pose};
    use nalgebra::UnitQuaternion;

    fn hand(y: f64, force: Vector3<f64>, moment: Vector3<f64>) -> HandInput {
        let pose = Pose::<World, Hand>::new(Vector3::new(0.0, y, 0.0), UnitQuaternion::identity());
        HandInput { pose, pose_commanded: pose, wrench: Wrench::new(force, moment) }
    }

    fn levers(hands: &[HandInput; 2]) -> [Vector3<f64>; 2] {
        let X_WA = Pose::<World, Object>::identity();
        hands.map(|hand| VirtualStick::at_grasp(&hand.pose, &X_WA).vector(&hand.pose))
    }

    fn found(compliance: &GraspCompliance, hands: &[HandInput; 2], is_free: bool) -> Twist<World> {
        compliance.object_yield(&mut [[0.0; 6]; 2], hands.iter().zip(&levers(hands)), &[0.5, 0.5], is_free)
    }

    #[test]
    fn an_object_hangs_behind_hands_that_push_it() {
        let compliance = GraspCompliance { m_n: 1e-3, rad_nm: 1e-2, filter_pole: 0.0 };
        let lift = Vector3::new(0.0, 0.0, 2.0);
        let hands = [hand(0.5, lift, Vector3::zeros()), hand(-0.5, lift, Vector3::new(0.4, 0.0, 0.0))];
        let found = found(&compliance, &hands, true);
        // Both lift 2 mm short; one turns 4 mrad about its palm, half a metre from the middle.
        assert!(
            (found.linear - Vector3::new(0.0, 0.0, -0.002 - 0.5 * 0.004 * 0.5)).norm() < 1e-12,
            "{found:?}"
        );
        assert!((found.angular - Vector3::new(-0.002, 0.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn an_object_hangs_behind_hands_that_strain_it_whether_it_is_free_or_not() {
        let compliance = GraspCompliance { m_n: 1e-3, rad_nm: 1e-2, filter_pole: 0.0 };
        // One turns by 4 mrad about its palm, half a metre from the middle; the other holds against it.
        let turn = Vector3::new(0.4, 0.0, 0.0);
        let hands = [hand(0.5, Vector3::zeros(), turn), hand(-0.5, Vector3::zeros(), -turn)];
        for is_free in [true, false] {
            let found = found(&compliance, &hands, is_free);
            assert!((found.linear - Vector3::new(0.0, 0.0, 0.5 * 0.004)).norm() < 1e-12, "{found:?}");
            assert!(found.angular.norm() < 1e-12);
        }
    }

    #[test]
    fn an_object_that_something_holds_does_not_hang_behind_what_pushes_it() {
        let compliance = GraspCompliance { m_n: 1e-3, rad_nm: 1e-2, filter_pole: 0.0 };
        // 4 N and, about the middle between them, 0.4 Nm, as W⁻ deals them out.
        let (lift, turn) = (Vector3::new(0.0, 0.0, 2.0), Vector3::new(0.2, 0.0, 0.0));
        let lever = Vector3::new(1.0, 0.0, 0.0);
        let hands = [hand(0.5, lift, turn - lever), hand(-0.5, lift, turn + lever)];
        let found = found(&compliance, &hands, false);
        assert!(found.linear.norm() < 1e-12 && found.angular.norm() < 1e-12, "{found:?}");
    }

    #[test]
    fn noise_is_filtered_before_it_moves_the_object() {
        let compliance = GraspCompliance { m_n: 1e-3, rad_nm: 0.0, filter_pole: 0.9 };
        let pull = Vector3::new(0.0, 10.0, 0.0);
        let hands = [hand(0.5, pull, Vector3::zeros()), hand(-0.5, -pull, Vector3::zeros())];
        let mut filtered = [[0.0; 6]; 2];
        let found =
            compliance.object_yield(&mut filtered, hands.iter().zip(&levers(&hands)), &[1.0, 0.0], true);
        assert!((found.linear.y + 0.001).abs() < 1e-12, "a tenth of 10 N by 1 mm/N: {found:?}");
    }
}
