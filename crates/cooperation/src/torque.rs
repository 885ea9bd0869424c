//! For robots that are controlled by joint torques: from generalized forces to joint torques.

use crate::{GeneralizedForce, InternalForces};
use mikoshi_spatial::{Object, Pose, World, Wrench};
use nalgebra::{Dyn, Matrix, Storage, U6};

/// q_b = U h (eq. 7): the wrench at each tip, in world axes, that makes up a generalized force.
///
/// With h in the mixed axes of eq. 28, n tips and n rows. Allocates.
pub fn tip_wrenches(
    internal_forces: &InternalForces,
    h: &GeneralizedForce,
    X_WA: &Pose<World, Object>,
) -> Vec<Wrench<World>> {
    let internal = h.internal.iter().map(|wrench| wrench.expressed_in(X_WA));
    let rows: Vec<_> = core::iter::once(h.external).chain(internal).collect();
    let mut tips = vec![Wrench::zero(); internal_forces.arms()];
    let mut work = vec![Wrench::zero(); internal_forces.work_len()];
    internal_forces.of_all().tip_forces(&rows, &mut tips, &mut work);
    tips
}

/// Λ = Jᵀ h (eq. 33), arm by arm: the joint torques \[Nm\] with which a hand applies a wrench.
///
/// By eq. 32 u = J Θ̇, where J stacks the Jacobians of all tips under Uᵀ; so Jᵀ h is, for each robot, the sum
/// of `J_hᵀ f_h` over its hands. `jacobian` is 6 × joints, linear before angular, of the point where the
/// wrench acts, both in world axes; the torques are added to `torques_nm`.
pub fn joint_torques<S: Storage<f64, U6, Dyn>>(
    jacobian: &Matrix<f64, U6, Dyn, S>,
    wrench: &Wrench<World>,
    torques_nm: &mut [f64],
) {
    let wrench = wrench.to_vector();
    for (column, torque_nm) in jacobian.column_iter().zip(torques_nm) {
        *torque_nm += column.dot(&wrench);
    }
}
