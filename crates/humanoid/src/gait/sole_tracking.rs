//! A swinging foot lands where it should although legs yield under the robot's weight.

use crate::balance::PerFoot;
use mikoshi_spatial::{Base, Pose, Twist, World};
use nalgebra::Vector3;

/// Correction of a swinging sole by where the base is.
///
/// Drives are springs: the leg that bears the robot yields by a millimetre or two, and with the base the
/// swinging foot sinks and tilts, so that it would meet the ground early and at speed. While a foot swings,
/// its command makes up for what the base lacks at the foot in height and tilt; along the ground readings
/// that are late would tell motion for yielding. Once the foot stands, both legs share the weight and the
/// correction fades.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoleTracking {
    /// Time constant in which the correction of a swinging foot follows \[s\].
    pub follow_s: f64,
    /// Time constant in which the correction of a standing foot fades \[s\].
    pub fade_s: f64,
    /// Largest correction \[m\].
    pub max_m: f64,
    /// Largest correction of attitude \[rad\].
    pub max_rad: f64,
}

impl Default for SoleTracking {
    fn default() -> Self {
        Self { follow_s: 0.05, fade_s: 0.1, max_m: 0.015, max_rad: 0.03 }
    }
}

/// The correction of each sole, in world axes: linear \[m\], angular \[rad\].
pub type SoleCorrection = PerFoot<Twist<World>>;

impl SoleTracking {
    /// One tick of `dt` \[s\] of a foot in the air at `foot` \[m\], with the base measured and as it is
    /// commanded.
    pub fn follow(
        &self,
        correction: &mut Twist<World>,
        foot: &Vector3<f64>,
        measured: &Pose<World, Base>,
        commanded: &Pose<World, Base>,
        dt: f64,
    ) {
        let lacking = measured.displacement_to(commanded).shifted(&(foot - measured.translation));
        let upright = Twist::new(
            Vector3::new(0.0, 0.0, lacking.linear.z.clamp(-self.max_m, self.max_m)),
            Vector3::new(
                lacking.angular.x.clamp(-self.max_rad, self.max_rad),
                lacking.angular.y.clamp(-self.max_rad, self.max_rad),
                0.0,
            ),
        );
        *correction += (upright - *correction) * (dt / self.follow_s).min(1.0);
    }

    /// One tick of `dt` \[s\] of a foot that stands.
    pub fn fade(&self, correction: &mut Twist<World>, dt: f64) {
        *correction = *correction * (1.0 - (dt / self.fade_s).min(1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    const TRACKING: SoleTracking = SoleTracking { follow_s: 0.05, fade_s: 0.1, max_m: 0.015, max_rad: 0.03 };

    /// A base that has sunk by 2 mm and rolled by 3 mrad about its own origin, 0.8 m over the ground.
    fn sunk() -> (Pose<World, Base>, Pose<World, Base>) {
        let commanded = Pose::new(Vector3::new(1.0, 2.0, 0.8), UnitQuaternion::identity());
        let sag = Twist::new(Vector3::new(0.004, 0.0, -0.002), Vector3::new(0.003, 0.0, 0.0));
        (commanded.displaced(&sag), commanded)
    }

    #[test]
    fn a_foot_is_lifted_by_what_its_base_has_sunk_and_the_correction_fades_when_it_stands() {
        let (measured, commanded) = sunk();
        let foot = measured.translation + Vector3::new(0.0, 0.2, -0.8);
        let mut correction = Twist::zero();
        (0..200).for_each(|_| TRACKING.follow(&mut correction, &foot, &measured, &commanded, 0.005));
        // Sunk by 2 mm, raised by 0.2 m × 3 mrad; what it lacks along the ground is not its business.
        assert!((correction.linear - Vector3::new(0.0, 0.0, 0.002 - 0.0006)).norm() < 1e-5, "{correction:?}");
        assert!((correction.angular - Vector3::new(-0.003, 0.0, 0.0)).norm() < 1e-5);
        (0..200).for_each(|_| TRACKING.fade(&mut correction, 0.005));
        assert!(correction.linear.norm() < 1e-6);
    }

    #[test]
    fn a_base_that_is_far_off_does_not_pull_a_foot_without_bound() {
        let (measured, _) = sunk();
        let far = measured.displaced(&Twist::new(Vector3::z(), Vector3::x()));
        let mut correction = Twist::zero();
        let foot = measured.translation;
        (0..1000).for_each(|_| TRACKING.follow(&mut correction, &foot, &measured, &far, 0.005));
        assert!((correction.linear.norm() - TRACKING.max_m).abs() < 1e-9);
        assert!((correction.angular.norm() - TRACKING.max_rad).abs() < 1e-9);
    }
}
