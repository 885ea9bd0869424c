//! How near the hybrid law's gain comes to the one at which the loop is unstable.

use crate::prepare::Prepared;
use mikoshi_config::scenario::Grasp;
use mikoshi_cooperation::{HandStiffness, RECOMMENDED_SHARE, VirtualStick, critical_loop_gain};
use mikoshi_spatial::Pose;
use serde::Serialize;

/// Ticks between a reference and its effect in the sensors that no part of the configuration accounts
/// for: the drives and the robots' structure.
const DRIVE_DELAY_TICKS: u64 = 1;
/// What holds a hand behind a weld: mostly the arm's drives.
const WELD_STIFFNESS: HandStiffness = HandStiffness { n_m: 25_000.0, nm_rad: 1_000.0 };

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
    /// The gain of the worst combination of all force axes.
    pub largest: f64,
    /// The gain of each internal force by itself.
    pub rows: Vec<RowGain>,
}

/// The loop gain of one internal force by itself: the share of its error that one tick corrects.
#[derive(Clone, Debug, Serialize)]
pub struct RowGain {
    /// Its name.
    pub name: String,
    /// Of its force axes.
    pub force: f64,
    /// Of its moment axes, without what virtual sticks add.
    pub moment: f64,
}

impl GainReport {
    /// Of this run.
    pub fn of(prepared: &Prepared) -> Self {
        let (run, law) = (&prepared.run, &prepared.law);
        let (scenario, hybrid) = (&run.scenario, &run.scenario.hybrid);
        let stiffness = match scenario.grasp {
            Grasp::Weld { .. } => WELD_STIFFNESS,
            Grasp::Spring { stiffness_n_m, stiffness_nm_rad, .. } => {
                HandStiffness { n_m: stiffness_n_m, nm_rad: stiffness_nm_rad }
            }
        };
        let delay_ticks =
            scenario.coordination_delay_ticks + scenario.sensors.delay_ticks + DRIVE_DELAY_TICKS;
        let palms = run.robots.iter().flat_map(|robot| &robot.hand_in_object);
        let sticks: Vec<_> = palms
            .filter_map(Pose::from_array)
            .map(|palm_in_object| VirtualStick::from_hand_in_object(&palm_in_object))
            .collect();
        let internal_forces = law.internal_forces();
        let rows = internal_forces
            .names()
            .iter()
            .zip(internal_forces.row_stiffness())
            .zip(&law.parameters().gains)
            .skip(1)
            .map(|((name, sum_of_squares), kh)| RowGain {
                name: name.clone(),
                force: hybrid.kz * kh.kh_force_m_n * stiffness.n_m * sum_of_squares,
                moment: hybrid.kz * kh.kh_moment_rad_nm * stiffness.nm_rad * sum_of_squares,
            })
            .collect();
        Self {
            delay_ticks,
            filter_hz: hybrid.filter_hz,
            stiffness_n_m: stiffness.n_m,
            stiffness_nm_rad: stiffness.nm_rad,
            critical: critical_loop_gain(delay_ticks, hybrid.filter_hz, scenario.control_period_s),
            recommended_share: RECOMMENDED_SHARE,
            largest: law.loop_gain(&sticks, stiffness),
            rows,
        }
    }

    /// The largest gain in proportion to the critical one.
    pub fn share(&self) -> f64 {
        self.largest / self.critical
    }

    /// What to say where the gain is higher than recommended.
    pub fn warning(&self) -> Option<String> {
        // Written so that NaN warns.
        let is_within = self.share() <= self.recommended_share;
        (!is_within).then(|| {
            format!(
                "the loop gain {:.3} is {:.0} % of the critical {:.3}, recommended are at most {:.0} %: \
                 lower hybrid.kz, hybrid.kh_m_n or hybrid.kh_rad_nm",
                self.largest,
                100.0 * self.share(),
                self.critical,
                100.0 * self.recommended_share
            )
        })
    }
}
