//! Robots: counts, shapes and rotations.

use super::checks::{Checks, Violation};
use crate::robot::RobotConfig;
use mikoshi_ipc_types::{MAX_FEET, MAX_HANDS};

/// Rotation matrices are typed by hand: three decimals pass.
const ROTATION_TOLERANCE: f64 = 2e-3;

/// Everything wrong with a robot's configuration in the file `stem`.toml.
pub(crate) fn robot(config: &RobotConfig, stem: &str) -> Vec<Violation> {
    let mut checks = Checks::default();
    checks.require(
        config.name == stem,
        "name",
        format_args!("{:?}", config.name),
        format_args!("{stem:?}, as the file is called"),
    );
    checks.count("hands", config.hands.len(), MAX_HANDS, "hands");
    checks.unique(config.hands.iter().map(|hand| hand.name.as_str()), |index| format!("hands.{index}.name"));
    for (index, hand) in config.hands.iter().enumerate() {
        checks.name(format_args!("hands.{index}.name"), &hand.name);
        for axis in 0..3 {
            checks.finite(format_args!("hands.{index}.carry_position_m.{axis}"), hand.carry_position_m[axis]);
        }
        checks.require(
            is_rotation(&hand.carry_rotation),
            format_args!("hands.{index}.carry_rotation"),
            format_args!("{:?}", hand.carry_rotation),
            "a rotation: orthonormal rows, right-handed",
        );
    }
    checks.require(config.feet.len() == MAX_FEET, "feet", config.feet.len(), format_args!("{MAX_FEET} feet"));
    checks.unique(config.feet.iter().map(|foot| foot.name.as_str()), |index| format!("feet.{index}.name"));
    for (index, foot) in config.feet.iter().enumerate() {
        checks.name(format_args!("feet.{index}.name"), &foot.name);
        let [x_min, x_max, y_min, y_max] = foot.sole_m;
        let fits = foot.sole_m.iter().all(|edge| edge.is_finite()) && x_min < x_max && y_min < y_max;
        let expected = "[x_min, x_max, y_min, y_max] with x_min < x_max and y_min < y_max";
        checks.require(
            fits,
            format_args!("feet.{index}.sole_m"),
            format_args!("{:?}", foot.sole_m),
            expected,
        );
    }
    checks.require(!config.drives.is_empty(), "drives", "none", "a drive for every joint");
    for (index, drive) in config.drives.iter().enumerate() {
        let stars = drive.joints.matches('*').count();
        let expected = "a joint's name with at most one *";
        let fits = !drive.joints.is_empty() && stars <= 1;
        checks.require(
            fits,
            format_args!("drives.{index}.joints"),
            format_args!("{:?}", drive.joints),
            expected,
        );
        checks.positive(format_args!("drives.{index}.kp_nm_rad"), drive.kp_nm_rad);
        checks.not_negative(format_args!("drives.{index}.kv_nms_rad"), drive.kv_nms_rad);
        checks.not_negative(format_args!("drives.{index}.armature_kg_m2"), drive.armature_kg_m2);
    }
    for (joint, angle) in &config.carry_posture_deg {
        let fits = angle.abs() <= 360.0;
        checks.require(fits, format_args!("carry_posture_deg.{joint}"), angle, "degrees from -360 to 360");
    }
    checks.positive("com_height_m", config.com_height_m);
    checks.positive("foot_spacing_m", config.foot_spacing_m);
    checks.0
}

fn is_rotation(rows: &[[f64; 3]; 3]) -> bool {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let [x, y, z] = *rows;
    let cross = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    let near = |value: f64, wanted: f64| (value - wanted).abs() <= ROTATION_TOLERANCE;
    near(dot(x, x), 1.0)
        && near(dot(y, y), 1.0)
        && near(dot(z, z), 1.0)
        && near(dot(x, y), 0.0)
        && near(dot(cross, z), 1.0)
}
