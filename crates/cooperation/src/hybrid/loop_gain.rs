//! The loop gain of a law on a given grasp.

use super::HybridLaw;
use crate::{Linear, VirtualStick};
use faer::Mat;
use mikoshi_spatial::{Hand, Pose, Twist, World, Wrench};
use nalgebra::{DMatrix, Vector6};

/// How stiffly one hand, its arm and its robot hold their place against the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandStiffness {
    /// \[N/m\]
    pub n_m: f64,
    /// \[Nm/rad\]
    pub nm_rad: f64,
}

impl HybridLaw {
    /// The share of an internal force or moment that one tick corrects, for the worst combination of all
    /// force axes: compare with [`critical_loop_gain`](crate::critical_loop_gain).
    ///
    /// For two arms without lever it is [`loop_gain`](crate::loop_gain). In general a virtual stick turns a
    /// rotation of its tip into a displacement l times as large at its hand, so that l² k adds to a hand's
    /// rotational stiffness, and rows are coupled. This takes the generalized stiffness K = ∂h/∂z of the
    /// grasp at rest, lets the object, free and without inertia, move to equilibrium, and returns the
    /// largest eigenvalue of `kz kh S K`. O(n³); `sticks` are n.
    pub fn loop_gain(&self, sticks: &[VirtualStick], stiffness: HandStiffness) -> f64 {
        let K = self.generalized_stiffness(sticks, stiffness);
        let internal = K.nrows() - 6;
        // The object is free: its displacement makes the external force vanish.
        let K_ee = K.view((0, 0), (6, 6)).into_owned();
        let K_ei = K.view((0, 6), (6, internal));
        let free =
            K_ee.pseudo_inverse(1e-12 * K.amax()).map_or_else(|_| K_ei.scale(0.0), |inverse| inverse * K_ei);
        let K_ii = K.view((6, 6), (internal, internal)) - K_ei.transpose() * free;
        let gains = self.force_gains().skip(1).flat_map(|gain| gain.map(f64::sqrt).data.0[0]);
        let root_gains: Vec<f64> = gains.collect();
        // diag(√g) K diag(√g) is symmetric and has the eigenvalues of diag(g) K.
        Mat::from_fn(internal, internal, |i, j| root_gains[i] * K_ii[(i, j)] * root_gains[j])
            .self_adjoint_eigenvalues(faer::Side::Lower)
            .ok()
            .and_then(|eigenvalues| eigenvalues.last().copied())
            .unwrap_or(f64::NAN)
    }

    /// K = ∂h/∂z with the object held, 6n × 6n, column by column: z → tips → hands → springs → tips → h.
    fn generalized_stiffness(&self, sticks: &[VirtualStick], stiffness: HandStiffness) -> DMatrix<f64> {
        let n = self.arms();
        // World axes along the object's: at the grasp a hand's pose is X_AH = X_HB⁻¹.
        let hands: Vec<Pose<World, Hand>> =
            sticks.iter().map(|stick| stick.X_HB.inverse().relabel()).collect();
        let internal_forces = self.internal_forces();
        let (mut rows_z, mut tips_z, mut work_z) = buffers::<Twist<World>>(n, internal_forces.work_len());
        let (mut rows_h, mut tips_h, mut work_h) = buffers::<Wrench<World>>(n, internal_forces.work_len());
        DMatrix::from_columns(
            &(0..6 * n)
                .map(|column| {
                    let mut unit = Vector6::zeros();
                    unit[column % 6] = 1.0;
                    rows_z[column / 6] = Twist::from_vector(&unit);
                    internal_forces.tip_displacements(&rows_z, &mut tips_z, &mut work_z);
                    rows_z[column / 6] = Twist::zero();
                    for (((f_B, dy), stick), X_WH) in tips_h.iter_mut().zip(&tips_z).zip(sticks).zip(&hands) {
                        let hand = stick.hand_displacement(X_WH, dy);
                        let f_H = Wrench::new(hand.linear * stiffness.n_m, hand.angular * stiffness.nm_rad);
                        *f_B = stick.tip_wrench(X_WH, &f_H);
                    }
                    internal_forces.generalized_force(&tips_h, &mut rows_h, &mut work_h);
                    nalgebra::DVector::from_iterator(6 * n, rows_h.iter().flat_map(Wrench::to_array))
                })
                .collect::<Vec<_>>(),
        )
    }
}

fn buffers<T: Linear>(rows: usize, work: usize) -> (Vec<T>, Vec<T>, Vec<T>) {
    (vec![T::default(); rows], vec![T::default(); rows], vec![T::default(); work])
}
