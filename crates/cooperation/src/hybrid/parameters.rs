//! Gains and limits of the law.

use crate::{InternalForces, Selection};

/// How stiffly one hand, its arm and its robot hold their place against the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandStiffness {
    /// \[N/m\]
    pub n_m: f64,
    /// \[Nm/rad\]
    pub nm_rad: f64,
}

/// k_h (eq. 34): how far a hand gives way to its share of the force error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceGains {
    /// To a force \[m/N\].
    pub m_n: f64,
    /// To a moment about the hand's own origin \[rad/Nm\].
    pub rad_nm: f64,
}

impl ForceGains {
    /// The gains with which every internal force and moment loses the share g of its error in a tick:
    /// k_h = g / (k_z k).
    pub fn of_loop_gain(loop_gain: f64, kz: f64, stiffness: HandStiffness) -> Self {
        Self { m_n: loop_gain / (kz * stiffness.n_m), rad_nm: loop_gain / (kz * stiffness.nm_rad) }
    }

    /// The largest share of an internal force error that one tick corrects, over all combinations of forces
    /// and moments: `k_z max(k_h k)`. Compare with [`critical_loop_gain`](crate::critical_loop_gain).
    ///
    /// The object is free, so it takes the place where the hands' wrenches balance. The share is then a
    /// quotient of two quadratic forms of the hands' wrenches, with k_z k_h above and 1/k below, and lies
    /// between the smallest and the largest k_z k_h k, whatever the grasp and the team. (With some internal
    /// axes under position control that holds for equal k_h k only, as [`ForceGains::of_loop_gain`] makes
    /// them.)
    pub fn loop_gain(&self, kz: f64, stiffness: HandStiffness) -> f64 {
        kz * f64::max(self.m_n * stiffness.n_m, self.rad_nm * stiffness.nm_rad)
    }
}

/// Parameters of a [`HybridLaw`](crate::HybridLaw).
#[derive(Clone, Debug, PartialEq)]
pub struct HybridParameters {
    /// Period of a tick \[s\].
    pub period_s: f64,
    /// k_z (eq. 39): the share of the deviation that one tick removes, in (0, 1].
    pub kz: f64,
    /// k_h (eq. 34) of every hand.
    pub kh: ForceGains,
    /// S (eq. 35).
    pub selection: Selection,
    /// Corner frequency of the filter of h \[Hz\]; infinite for none.
    pub filter_hz: f64,
    /// How far a hand's reference may lead what its robot made of it \[m\].
    pub lead_limit_m: f64,
    /// The same for its attitude \[rad\].
    pub lead_limit_rad: f64,
    /// How fast force control of an external axis may move the object \[m/s\].
    pub approach_limit_m_s: f64,
    /// The same about an axis \[rad/s\].
    pub approach_limit_rad_s: f64,
}

/// Why parameters make no law.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum BuildHybridLawError {
    #[error("{name} must be {expected}; it is {value}")]
    OutOfRange { name: &'static str, expected: &'static str, value: f64 },
    #[error("{name} are for {found} rows; the internal forces have {rows}")]
    RowCount { name: &'static str, rows: usize, found: usize },
}

impl HybridParameters {
    /// For these internal forces.
    pub(super) fn check(&self, internal_forces: &InternalForces) -> Result<(), BuildHybridLawError> {
        let rows = internal_forces.arms();
        let found = self.selection.rows().len();
        if found != rows {
            return Err(BuildHybridLawError::RowCount { name: "selections", rows, found });
        }
        let in_range = |name, value: f64, expected, is_valid: bool| {
            if is_valid { Ok(()) } else { Err(BuildHybridLawError::OutOfRange { name, expected, value }) }
        };
        let is_positive = |value: f64| value.is_finite() && value > 0.0;
        in_range("period_s", self.period_s, "positive", is_positive(self.period_s))?;
        in_range("kz", self.kz, "above 0 and at most 1", self.kz > 0.0 && self.kz <= 1.0)?;
        in_range("filter_hz", self.filter_hz, "positive or infinite", self.filter_hz > 0.0)?;
        in_range("lead_limit_m", self.lead_limit_m, "positive", is_positive(self.lead_limit_m))?;
        in_range("lead_limit_rad", self.lead_limit_rad, "positive", is_positive(self.lead_limit_rad))?;
        for (name, limit) in [
            ("approach_limit_m_s", self.approach_limit_m_s),
            ("approach_limit_rad_s", self.approach_limit_rad_s),
        ] {
            in_range(name, limit, "positive", is_positive(limit))?;
        }
        for (name, kh) in [("kh.m_n", self.kh.m_n), ("kh.rad_nm", self.kh.rad_nm)] {
            in_range(name, kh, "finite and not negative", kh.is_finite() && kh >= 0.0)?;
        }
        Ok(())
    }
}
