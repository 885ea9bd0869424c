//! What is drawn of a sweep.

use super::result::{Figures, SweepResult};
use mikoshi_config::scenario::Thresholds;
use mikoshi_report::{SweepFigure, SweepParameter, SweepQuantity};

/// Units that end keys, as axes show them.
const UNITS: [(&str, &str); 14] = [
    ("_m_s2", "m/s²"),
    ("_rad_s", "rad/s"),
    ("_n_m", "N/m"),
    ("_nm_rad", "Nm/rad"),
    ("_m_s", "m/s"),
    ("_ticks", "ticks"),
    ("_rad", "rad"),
    ("_deg", "deg"),
    ("_kg", "kg"),
    ("_nm", "Nm"),
    ("_hz", "Hz"),
    ("_m", "m"),
    ("_n", "N"),
    ("_s", "s"),
];

/// Position peak, ZMP margin and peak internal force over every parameter that varies, or over the seed.
pub fn figure(result: &SweepResult, limits: &Thresholds) -> SweepFigure {
    let rows = &result.runs;
    let drawn = result.parameters.iter().map(|key| SweepParameter {
        label: label(key),
        values: rows.iter().map(|row| row.parameters.get(key).copied().unwrap_or(f64::NAN)).collect(),
    });
    let mut parameters: Vec<_> = drawn.collect();
    if parameters.is_empty() {
        let values = rows.iter().map(|row| row.seed as f64).collect();
        parameters.push(SweepParameter { label: "seed".to_owned(), values });
    }
    let quantity = |label: &str, figure: fn(&Figures) -> f64, scale: f64, limit: Option<f64>| SweepQuantity {
        label: label.to_owned(),
        values: rows.iter().map(|row| scale * figure(&row.figures)).collect(),
        limit: limit.map(|limit| scale * limit),
    };
    SweepFigure {
        title: format!("{}, {} runs of {}", result.sweep, rows.len(), result.scenario),
        subtitle: format!("{} succeeded", result.succeeded),
        parameters,
        quantities: vec![
            quantity("position peak [mm]", |f| f.position_peak_m, 1e3, limits.object_position_peak_m),
            quantity("ZMP margin [mm]", |f| f.zmp_margin_min_m, 1e3, limits.zmp_margin_min_m),
            quantity("internal peak [N]", |f| f.internal_peak_n, 1.0, limits.internal_peak_n),
        ],
        failed: rows.iter().map(|row| !row.passed).collect(),
    }
}

/// `sensors.force_noise_n` as `sensors force noise [N]`.
fn label(key: &str) -> String {
    // An array's element has its array's unit.
    let is_index = |last: &str| last.bytes().all(|byte| byte.is_ascii_digit());
    let element = key.rsplit_once('.').filter(|(_, last)| is_index(last));
    let (key, index) = element.map_or((key, String::new()), |(array, last)| (array, format!(" {last}")));
    let unit = UNITS.into_iter().find_map(|(ending, unit)| Some((key.strip_suffix(ending)?, unit)));
    let (name, unit) = unit.map_or((key, String::new()), |(name, unit)| (name, format!(" [{unit}]")));
    name.replace(['.', '_'], " ") + &index + &unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_labels_with_their_units() {
        for (key, expected) in [
            ("sensors.accelerometer_noise_m_s2", "sensors accelerometer noise [m/s²]"),
            ("sensors.gyro_noise_rad_s", "sensors gyro noise [rad/s]"),
            ("sensors.moment_noise_nm", "sensors moment noise [Nm]"),
            ("sensors.force_noise_n", "sensors force noise [N]"),
            ("grasp.offset_m", "grasp offset [m]"),
            ("physics.friction", "physics friction"),
            ("coordination.delay_s", "coordination delay [s]"),
            ("motion.segments.0.velocity_m_s.1", "motion segments 0 velocity 1 [m/s]"),
        ] {
            assert_eq!(label(key), expected);
        }
    }
}
