//! A swinging foot lands where it should although legs yield under the robot's weight.

use crate::balance::PerFoot;
use mikoshi_spatial::{Foot, Pose, Twist, World};

/// Correction of commanded soles by measured ones.
///
/// Drives are springs: the leg that bears the robot sags by a millimetre or two, and the swinging foot
/// with it, so that it would meet the ground early, at speed, and beside its foothold. While a foot
/// swings, the correction integrates what its measured sole lacks: `d(o)/dt = k (reference − measured)`.
/// Once it stands, both legs share the weight and the correction fades: `d(o)/dt = −o / fade`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoleTracking {
    /// k \[1/s\].
    pub gain_1_s: f64,
    /// Time constant in which the correction of a standing foot fades \[s\].
    pub fade_s: f64,
    /// Largest correction \[m\].
    pub max_m: f64,
    /// Largest correction of attitude \[rad\].
    pub max_rad: f64,
}

impl Default for SoleTracking {
    fn default() -> Self {
        Self { gain_1_s: 10.0, fade_s: 0.1, max_m: 0.015, max_rad: 0.03 }
    }
}

/// The correction of each sole, in world axes: linear \[m\], angular \[rad\].
pub type SoleCorrection = PerFoot<Twist<World>>;

impl SoleTracking {
    /// One tick of `dt` \[s\] of a foot in the air, whose sole is at `measured` and should be at
    /// `reference`.
    pub fn follow(
        &self,
        correction: &mut Twist<World>,
        reference: &Pose<World, Foot>,
        measured: &Pose<World, Foot>,
        dt: f64,
    ) {
        *correction += measured.displacement_to(reference) * (self.gain_1_s * dt);
        let bounded = |size: f64, most: f64| if size > most { most / size } else { 1.0 };
        correction.linear *= bounded(correction.linear.norm(), self.max_m);
        correction.angular *= bounded(correction.angular.norm(), self.max_rad);
    }

    /// One tick of `dt` \[s\] of a foot that stands.
    pub fn fade(&self, correction: &mut Twist<World>, dt: f64) {
        *correction = *correction * (1.0 - (dt / self.fade_s).min(1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    #[test]
    fn a_sagging_foot_is_brought_to_its_reference_and_the_correction_fades_when_it_stands() {
        let tracking = SoleTracking::default();
        let sag = Twist::<World>::new(Vector3::new(0.001, 0.0, -0.002), Vector3::new(0.0, 0.003, 0.0));
        let reference = Pose::<World, Foot>::new(Vector3::new(1.0, 2.0, 0.05), UnitQuaternion::identity());
        let mut correction = Twist::zero();
        for _ in 0..200 {
            let measured = reference.displaced(&(correction + sag));
            tracking.follow(&mut correction, &reference, &measured, 0.005);
        }
        assert!((correction + sag).linear.norm() < 1e-6 && (correction + sag).angular.norm() < 1e-6);
        (0..200).for_each(|_| tracking.fade(&mut correction, 0.005));
        assert!(correction.linear.norm() < 1e-6);
    }

    #[test]
    fn a_foot_that_is_held_is_not_pulled_without_bound() {
        let tracking = SoleTracking::default();
        let reference = Pose::<World, Foot>::identity();
        let held = reference.displaced(&Twist::new(Vector3::new(0.1, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.5)));
        let mut correction = Twist::zero();
        (0..1000).for_each(|_| tracking.follow(&mut correction, &reference, &held, 0.005));
        assert!((correction.linear.norm() - tracking.max_m).abs() < 1e-12);
        assert!((correction.angular.norm() - tracking.max_rad).abs() < 1e-12);
    }
}
