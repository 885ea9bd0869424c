//! Preview control of the cart-table model (Kajita et al., ICRA 2003; Katayama et al. 1985).

use super::riccati::{feedback_gain, solve_discrete_riccati};
use super::zmp_reference::{Line, ZmpReference};
use crate::balance::GRAVITY_M_S2;
use nalgebra::{Matrix3, Matrix4, RowVector3, Vector2, Vector3, Vector4};
use serde::{Deserialize, Serialize};

/// What the gains follow from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PreviewConfig {
    /// Control period \[s\].
    pub control_period_s: f64,
    /// Height of the centre of mass over the ground \[m\].
    pub com_height_m: f64,
    /// How far the controller looks ahead \[s\].
    pub horizon_s: f64,
    /// Qe: weight of the zero moment point's error.
    pub error_weight: f64,
    /// R: weight of the jerk's change.
    pub jerk_weight: f64,
    /// How far the zero moment point may leave its reference per axis when a plan changes within the
    /// horizon \[m\]; infinite for the linear law.
    pub deviation_max_m: f64,
}

impl Default for PreviewConfig {
    fn default() -> Self {
        Self {
            control_period_s: 0.005,
            com_height_m: 0.79,
            horizon_s: 1.6,
            error_weight: 1.0,
            jerk_weight: 1e-6,
            deviation_max_m: 0.02,
        }
    }
}

/// Why there are no gains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SolvePreviewError {
    /// A period, height, horizon, weight or deviation that is not positive.
    #[error("preview control needs positive period, height, horizon, weights and deviation")]
    NotPositive,
    /// The Riccati equation has no stabilising solution for these numbers.
    #[error("the Riccati equation of preview control has no stabilising solution")]
    NoSolution,
}

/// Centre of mass on its plane, world axes: the cart's state, and the integrated error of the zero
/// moment point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PreviewState {
    /// c \[m\].
    pub com: Vector2<f64>,
    /// ċ \[m/s\].
    pub com_velocity: Vector2<f64>,
    /// c̈ \[m/s²\].
    pub com_acceleration: Vector2<f64>,
    /// Sum over ticks of (zmp − reference) \[m\].
    pub error_sum: Vector2<f64>,
}

impl PreviewState {
    /// At rest.
    pub fn at_rest(com: Vector2<f64>) -> Self {
        let zero = Vector2::zeros();
        Self { com, com_velocity: zero, com_acceleration: zero, error_sum: zero }
    }
}

/// The controller: constant over a run. With x = (c, ċ, c̈) per axis, jerk input u, p = C x,
/// C = (1, 0, −h/g):
///
/// `u(k) = − Gi Σ_{i≤k} (p(i) − p_ref(i)) − Gx x(k) − Σ_{j=1..N} Gp(j) p_ref(k+j)`.
///
/// The gains come from the augmented system (p error, Δx), Ã = [1, CA; 0, A], B̃ = [CB; B],
/// Q̃ = diag(Qe, 0), whose Riccati solution is P:
/// - Gi = K̃₀, Gx = K̃₁₋₃ with K̃ = (R + B̃ᵀPB̃)⁻¹ B̃ᵀPÃ
/// - Gp(1) = −Gi, Gp(j) = (R + B̃ᵀPB̃)⁻¹ B̃ᵀ X(j−1), X(1) = −Ãcᵀ P e₁, X(j) = Ãcᵀ X(j−1),
///   Ãc = Ã − B̃ K̃.
///
/// First deviation from the source: the last gain holds the sum of all that lie past the horizon, i.e. the
/// reference is taken to stay as it is there. That makes the law exactly invariant to where the origin
/// lies; truncated, it would pull a robot far from the origin towards it.
///
/// Second deviation: where a plan changes within the horizon (a walk starts, a stop is decided), the
/// linear law with so small an R corrects the centre of mass within two ticks, by a zero moment point
/// decimetres off and a jolt of several m/s². Here the jerk is limited so that p leaves its reference
/// by no more than `deviation_max_m`, which spreads the same correction over a tenth of a second.
/// Beyond it the deviation goes on with a small slope, twice what holds an unstable pendulum, so that
/// no state is out of reach.
#[derive(Clone, Debug, PartialEq)]
pub struct PreviewControl {
    transition: Matrix3<f64>,
    input: Vector3<f64>,
    output: RowVector3<f64>,
    gain_error: f64,
    gain_state: RowVector3<f64>,
    gain_preview: Vec<f64>,
    gain_sums: Vec<GainSums>,
    deviation_max: f64,
    slope_beyond: f64,
}

/// Gains of the preview added up from 1 to some j.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct GainSums {
    /// Σ Gp(i).
    sum: f64,
    /// Σ i Gp(i).
    moment: f64,
}

impl GainSums {
    /// For j = 0..=N.
    fn of(gains: &[f64]) -> Vec<Self> {
        let mut last = Self::default();
        let sums = gains.iter().enumerate().map(|(index, gain)| {
            last = Self { sum: last.sum + gain, moment: last.moment + (index + 1) as f64 * gain };
            last
        });
        core::iter::once(Self::default()).chain(sums).collect()
    }
}

impl PreviewControl {
    /// Solves for the gains.
    pub fn new(config: &PreviewConfig) -> Result<Self, SolvePreviewError> {
        let PreviewConfig {
            control_period_s: dt, com_height_m, horizon_s, error_weight, jerk_weight, ..
        } = *config;
        let positive = [dt, com_height_m, horizon_s, error_weight, jerk_weight, config.deviation_max_m];
        if !positive.iter().all(|value| *value > 0.0) {
            return Err(SolvePreviewError::NotPositive);
        }
        let transition = Matrix3::new(1.0, dt, dt * dt / 2.0, 0.0, 1.0, dt, 0.0, 0.0, 1.0);
        let input = Vector3::new(dt.powi(3) / 6.0, dt * dt / 2.0, dt);
        let output = RowVector3::new(1.0, 0.0, -com_height_m / GRAVITY_M_S2);

        let mut a = Matrix4::zeros();
        a[(0, 0)] = 1.0;
        a.fixed_view_mut::<1, 3>(0, 1).copy_from(&(output * transition));
        a.fixed_view_mut::<3, 3>(1, 1).copy_from(&transition);
        let b = Vector4::new((output * input).x, input.x, input.y, input.z);
        let q = Matrix4::from_diagonal(&Vector4::new(error_weight, 0.0, 0.0, 0.0));
        let p = solve_discrete_riccati(&a, &b, &q, jerk_weight).ok_or(SolvePreviewError::NoSolution)?;

        let scale = 1.0 / (jerk_weight + (b.transpose() * p * b).x);
        let k = feedback_gain(&a, &b, &p, jerk_weight);
        let closed_transposed = (a - b * k).transpose();
        let gain_of = |x: &Vector4<f64>| b.dot(x) * scale;

        let samples = (horizon_s / dt).round().max(1.0) as usize;
        let mut gain_preview = Vec::with_capacity(samples);
        let mut x = -(p.column(0));
        for _ in 0..samples {
            gain_preview.push(gain_of(&x));
            x = closed_transposed * x;
        }
        // Σ_{i≥0} Ãcⁱᵀ x = (I − Ãcᵀ)⁻¹ x; Ãc is stable, so I − Ãcᵀ is regular.
        let tail =
            (Matrix4::identity() - closed_transposed).lu().solve(&x).ok_or(SolvePreviewError::NoSolution)?;
        if let Some(last) = gain_preview.last_mut() {
            *last += gain_of(&tail);
        }
        // By how much p leaves its reference per metre that the divergent component is off; a pendulum
        // diverges where that is less than one.
        let stiffness = -(output * input).x * k[1];
        Ok(Self {
            deviation_max: config.deviation_max_m,
            slope_beyond: (2.0 / stiffness).min(1.0),
            transition,
            input,
            output,
            gain_error: k[0],
            gain_state: k.fixed_view::<1, 3>(0, 1).into_owned(),
            gain_sums: GainSums::of(&gain_preview),
            gain_preview,
        })
    }

    /// Gi.
    pub fn gain_error(&self) -> f64 {
        self.gain_error
    }

    /// Gx for (c, ċ, c̈).
    pub fn gain_state(&self) -> RowVector3<f64> {
        self.gain_state
    }

    /// Gp(1), Gp(2), … Gp(N); the last one includes all that would follow.
    pub fn gain_preview(&self) -> &[f64] {
        &self.gain_preview
    }

    /// Zero moment point of the cart-table, the extended one where there is a load \[m\].
    pub fn zmp(&self, state: &PreviewState) -> Vector2<f64> {
        state.com + state.com_acceleration * self.output.z
    }

    /// One tick further along a reference \[m\], whose tick 0 is now.
    ///
    /// Returns the zero moment point's error now \[m\].
    pub fn advance(&self, state: &mut PreviewState, zmp_ref: &ZmpReference) -> Vector2<f64> {
        let error = self.zmp(state) - zmp_ref.at(0);
        state.error_sum += error;
        let (next_ref, preview) = (zmp_ref.at(1), self.preview(zmp_ref));
        for axis in 0..2 {
            let x = Vector3::new(state.com[axis], state.com_velocity[axis], state.com_acceleration[axis]);
            let jerk = -self.gain_error * state.error_sum[axis] - (self.gain_state * x).x - preview[axis];
            let free = self.transition * x;
            // p(k+1) = C (A x + B u), so a limit of p is one of u.
            let (drift, effect) = ((self.output * free).x - next_ref[axis], (self.output * self.input).x);
            let jerk = (self.limited(drift + effect * jerk) - drift) / effect;
            let next = free + self.input * jerk;
            (state.com[axis], state.com_velocity[axis], state.com_acceleration[axis]) =
                (next.x, next.y, next.z);
        }
        error
    }

    /// Σ_{j=1..N} Gp(j) p_ref(k+j): over the ticks of a line p_ref(k+j) = p₀ + s (j − j₀) it is
    /// (p₀ − s j₀) Σ Gp(j) + s Σ j Gp(j), differences of two sums, however long the horizon is.
    fn preview(&self, zmp_ref: &ZmpReference) -> Vector2<f64> {
        let mut preview = Vector2::zeros();
        for Line { ticks, through: (tick, point), slope } in zmp_ref.lines(1, self.gain_sums.len() as i64) {
            let up_to = |tick: i64| self.gain_sums.get(tick as usize - 1).copied().unwrap_or_default();
            let (before, after) = (up_to(ticks.start), up_to(ticks.end));
            let (sum, moment) = (after.sum - before.sum, after.moment - before.moment);
            preview += point * sum + slope * (moment - tick as f64 * sum);
        }
        preview
    }

    fn limited(&self, deviation: f64) -> f64 {
        let within = deviation.clamp(-self.deviation_max, self.deviation_max);
        within + self.slope_beyond * (deviation - within)
    }
}
