//! How near the hybrid law's gain comes to the one at which the loop is unstable.

use crate::prepare::Prepared;
use mikoshi_cooperation::{HandStiffness, RECOMMENDED_SHARE, critical_loop_gain};
use serde::Serialize;

/// Ticks between a reference and its effect in the sensors that no part of the configuration accounts
/// for: the drives and the robots' structure.
const DRIVE_DELAY_TICKS: u64 = 1;

/// The loop gains of a run.
#[derive(Clone, Debug, Serialize)]
pub struct GainReport {
    /// Delay of the loop beyond the tick that it takes anyway.
    pub delay_ticks: u64,
    /// Corner frequency of the wrench filter.
    pub filter_hz: f64,
    /// Stiffness of one hand against the object.
    pub stiffness_n_m: f64,
    /// The same about an axis.
    pub stiffness_nm_rad: f64,
    /// The gain at which the loop is unstable by the model.
    pub critical: f64,
    /// The share of it to stay within.
    pub recommended_share: f64,
    /// The share of an internal force error that one tick corrects, at most.
    pub gain: f64,
    /// kh of a hand (eq. 34), for forces.
    pub kh_m_n: f64,
    /// The same for moments.
    pub kh_rad_nm: f64,
}

impl GainReport {
    /// Of this run.
    pub fn of(prepared: &Prepared) -> Self {
        let (scenario, law) = (&prepared.run.scenario, &prepared.law);
        let hybrid = &scenario.hybrid;
        let stiffness =
            HandStiffness { n_m: hybrid.hand_stiffness_n_m, nm_rad: hybrid.hand_stiffness_nm_rad };
        let delay_ticks =
            scenario.coordination_delay_ticks + scenario.sensors.delay_ticks + DRIVE_DELAY_TICKS;
        let kh = law.parameters().kh;
        Self {
            delay_ticks,
            filter_hz: hybrid.filter_hz,
            stiffness_n_m: stiffness.n_m,
            stiffness_nm_rad: stiffness.nm_rad,
            critical: critical_loop_gain(delay_ticks, hybrid.filter_hz, scenario.control_period_s),
            recommended_share: RECOMMENDED_SHARE,
            gain: kh.loop_gain(hybrid.kz, stiffness),
            kh_m_n: kh.m_n,
            kh_rad_nm: kh.rad_nm,
        }
    }

    /// The gain in proportion to the critical one.
    pub fn share(&self) -> f64 {
        self.gain / self.critical
    }

    /// What to say where the gain is higher than recommended.
    pub fn warning(&self) -> Option<String> {
        // Written so that NaN warns.
        let is_within = self.share() <= self.recommended_share;
        (!is_within).then(|| {
            format!(
                "the loop gain {:.3} is {:.0} % of the critical {:.3}, recommended are at most {:.0} %: \
                 lower hybrid.loop_gain",
                self.gain,
                100.0 * self.share(),
                self.critical,
                100.0 * self.recommended_share
            )
        })
    }
}
