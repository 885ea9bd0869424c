//! Gains and limits of the law.

use crate::{InternalForces, Selection};

/// k_h of one row (eq. 34).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowGains {
    /// On its force axes \[m/N\].
    pub kh_force_m_n: f64,
    /// On its moment axes \[rad/Nm\].
    pub kh_moment_rad_nm: f64,
}

impl RowGains {
    /// The gains of all rows, from those of a pair of arms.
    ///
    /// The more arms a row has, the stiffer it is: by Σ c², for a pair ½. The force gain is divided by
    /// that, so that all rows converge alike; between two groups of N/2 arms it is scaled by 2/N. The
    /// moment gain is not: a hand's own rotational compliance, which doesn't add up over the arms as
    /// their stiffness does, governs it, and scaled it leaves moments behind.
    pub fn scaled(internal_forces: &InternalForces, kh_force_m_n: f64, kh_moment_rad_nm: f64) -> Vec<Self> {
        let of_row =
            |stiffness: &f64| Self { kh_force_m_n: kh_force_m_n * 0.5 / stiffness, kh_moment_rad_nm };
        internal_forces.row_stiffness().iter().map(of_row).collect()
    }
}

/// Parameters of a [`HybridLaw`](crate::HybridLaw).
#[derive(Clone, Debug, PartialEq)]
pub struct HybridParameters {
    /// Period of a tick \[s\].
    pub period_s: f64,
    /// k_z (eq. 39): the share of the deviation that one tick removes, in (0, 1].
    pub kz: f64,
    /// k_h (eq. 34) of each row, n of them.
    pub gains: Vec<RowGains>,
    /// S (eq. 35).
    pub selection: Selection,
    /// Corner frequency of the filter of h \[Hz\]; infinite for none.
    pub filter_hz: f64,
    /// How far a hand's reference may lead what its robot made of it \[m\].
    pub lead_limit_m: f64,
    /// The same for its attitude \[rad\].
    pub lead_limit_rad: f64,
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
        for (name, found) in [("gains", self.gains.len()), ("selections", self.selection.rows().len())] {
            if found != rows {
                return Err(BuildHybridLawError::RowCount { name, rows, found });
            }
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
        for gains in &self.gains {
            for (name, kh) in
                [("kh_force_m_n", gains.kh_force_m_n), ("kh_moment_rad_nm", gains.kh_moment_rad_nm)]
            {
                in_range(name, kh, "finite and not negative", kh.is_finite() && kh >= 0.0)?;
            }
        }
        Ok(())
    }
}
