//! From hands to the generalized vectors h, z and u (sections 2.1 and 2.4).

use crate::{
    FormedForces, GeneralizedForce, GeneralizedPosition, GeneralizedVelocity, InternalForces, VirtualStick,
};
use mikoshi_spatial::{CoordinateFrame, Hand, Object, Pose, Tip, Twist, World, Wrench, exp, log};
use nalgebra::{Quaternion, UnitQuaternion, Vector3, Vector4};

/// Attitude change times the tips' spread \[rad²\] below which the mean of the tips counts as found: what a deviation is
/// wrong by from which that change is subtracted is half of it.
const MEAN_TOLERANCE_RAD2: f64 = 1e-13;
/// A round leaves a share of the error that is the square of the tips' spread \[rad\] over twelve: two
/// rounds do for tips that belong to one object. The bound is for those that don't.
const MEAN_ROUNDS: usize = 8;

/// Buffers for n arms. Nothing in them outlives a call.
#[derive(Clone, Debug)]
pub struct WorkspaceScratch {
    /// From each hand to the tip of its stick, in the world.
    pub(crate) levers: Vec<Vector3<f64>>,
    pub(crate) tips: Vec<Pose<World, Tip>>,
    pub(crate) tip_wrenches: Vec<Wrench<World>>,
    pub(crate) tip_twists: Vec<Twist<World>>,
    pub(crate) row_wrenches: Vec<Wrench<World>>,
    pub(crate) row_twists: Vec<Twist<World>>,
    pub(crate) work_wrenches: Vec<Wrench<World>>,
    pub(crate) work_twists: Vec<Twist<World>>,
}

impl WorkspaceScratch {
    /// For these internal forces.
    pub fn new(internal_forces: &InternalForces) -> Self {
        let (n, work) = (internal_forces.arms(), internal_forces.work_len());
        Self {
            levers: vec![Vector3::zeros(); n],
            tips: vec![Pose::identity(); n],
            tip_wrenches: vec![Wrench::zero(); n],
            tip_twists: vec![Twist::zero(); n],
            row_wrenches: vec![Wrench::zero(); n],
            row_twists: vec![Twist::zero(); n],
            work_wrenches: vec![Wrench::zero(); work],
            work_twists: vec![Twist::zero(); work],
        }
    }

    /// Overwrites every number with NaN.
    pub fn poison(&mut self) {
        let nan = Vector3::from_element(f64::NAN);
        self.levers.fill(nan);
        self.tips.fill(nan_pose());
        for wrenches in [&mut self.tip_wrenches, &mut self.row_wrenches, &mut self.work_wrenches] {
            wrenches.fill(Wrench::new(nan, nan));
        }
        for twists in [&mut self.tip_twists, &mut self.row_twists, &mut self.work_twists] {
            twists.fill(Twist::new(nan, nan));
        }
    }

    /// h and z (eqs. 11, 27 to 29) of n hands, each with its virtual stick, its pose, and the wrench that it
    /// applies to the object, at its origin in world axes. What a hand says that takes no part changes nothing.
    pub fn evaluate(
        &mut self,
        internal_forces: &FormedForces<'_>,
        hands: impl Iterator<Item = (VirtualStick, Pose<World, Hand>, Wrench<World>)>,
        h: &mut GeneralizedForce,
        z: &mut GeneralizedPosition,
    ) {
        let tips = self.tips.iter_mut().zip(&mut self.tip_wrenches).zip(&mut self.levers);
        for (((tip, tip_wrench), lever), (stick, X_WH, f_H_W)) in tips.zip(hands) {
            *tip = stick.tip_pose(&X_WH);
            *lever = stick.vector(&X_WH);
            *tip_wrench = f_H_W.shifted(&-*lever);
        }

        // Eq. 27, row 0. What the tips deviate from it is left in `tip_twists`.
        let X_WA = mean_pose(internal_forces.formation().w_inverse(), &self.tips, &mut self.tip_twists);
        let X_AW = X_WA.inverse();
        z.external = X_WA;

        // Eq. 27, rows 1..: taken from the deviations, for the columns of V sum to zero.
        internal_forces.generalized_position(&self.tip_twists, &mut self.row_twists, &mut self.work_twists);
        for (internal, row) in z.internal.iter_mut().zip(self.row_twists.iter().skip(1)) {
            *internal = row.expressed_in(&X_AW);
        }

        // Eq. 11, then eq. 28.
        internal_forces.generalized_force(
            &self.tip_wrenches,
            &mut self.row_wrenches,
            &mut self.work_wrenches,
        );
        h.external = self.row_wrenches.first().copied().unwrap_or_default();
        for (internal, row) in h.internal.iter_mut().zip(self.row_wrenches.iter().skip(1)) {
            *internal = row.expressed_in(&X_AW);
        }
    }
}

/// u (eqs. 30, 31) from the twists of n tips. `scratch` is for the same internal forces.
///
/// Deviation from eqs. 31 and B2 to B4: the rates of rotation vectors about the mean attitude are angular
/// velocities, so Ba is the identity; in Euler angles it is singular at a pitch of ±90°.
pub fn generalized_velocity(
    internal_forces: &InternalForces,
    X_WA: &Pose<World, Object>,
    tip_twists: &[Twist<World>],
    u: &mut GeneralizedVelocity,
    scratch: &mut WorkspaceScratch,
) {
    let WorkspaceScratch { row_twists, work_twists, .. } = scratch;
    internal_forces.of_all().generalized_position(tip_twists, row_twists, work_twists);
    let X_AW = X_WA.inverse();
    u.external = row_twists.first().copied().unwrap_or_default();
    for (internal, row) in u.internal.iter_mut().zip(row_twists.iter().skip(1)) {
        *internal = row.expressed_in(&X_AW);
    }
}

/// A pose of NaN.
pub(crate) fn nan_pose<A: CoordinateFrame, B: CoordinateFrame>() -> Pose<A, B> {
    let quaternion = Quaternion::from(Vector4::from_element(f64::NAN));
    Pose::new(Vector3::from_element(f64::NAN), UnitQuaternion::new_unchecked(quaternion))
}

/// The weighted mean of the tips, and each tip's displacement from it in world axes.
///
/// The mean attitude R solves `Σ wᵢ log(Rᵢ Rᵀ) = 0`: eq. 27 with rotation vectors about R. (Deviation:
/// the paper averages Euler angles.)
pub(crate) fn mean_pose(
    weights: &[f64],
    tips: &[Pose<World, Tip>],
    deviations: &mut [Twist<World>],
) -> Pose<World, Object> {
    let position: Vector3<f64> =
        weights.iter().zip(tips).map(|(weight, tip)| tip.translation * *weight).sum();
    let mut attitude = tips.first().map_or_else(UnitQuaternion::identity, |tip| tip.rotation);
    for round in 1..=MEAN_ROUNDS {
        let (mut correction, mut spread_squared) = (Vector3::zeros(), 0.0_f64);
        for ((weight, tip), deviation) in weights.iter().zip(tips).zip(deviations.iter_mut()) {
            let angular = log(&(tip.rotation * attitude.inverse()));
            correction += angular * *weight;
            if *weight != 0.0 {
                spread_squared = spread_squared.max(angular.norm_squared());
            }
            *deviation = Twist::new(tip.translation - position, angular);
        }
        attitude = exp(&correction) * attitude;
        attitude.renormalize_fast();
        let doubt_squared = correction.norm_squared() * spread_squared;
        if doubt_squared <= MEAN_TOLERANCE_RAD2 * MEAN_TOLERANCE_RAD2 || round == MEAN_ROUNDS {
            deviations.iter_mut().for_each(|deviation| deviation.angular -= correction);
            break;
        }
    }
    Pose::new(position, attitude)
}
