//! What types can't say: ranges, units that must fit each other, names that must agree.

use crate::robot::RobotConfig;
use crate::scenario::{Grasp, InternalForces, Member, Scenario};
use core::fmt::Display;
use mikoshi_ipc_types::{MAX_FEET, MAX_HANDS, MAX_ROBOTS};
use std::collections::BTreeSet;

/// Ratios of periods count as whole within this.
const RATIO_TOLERANCE: f64 = 1e-9;
/// Rotation matrices are typed by hand: three decimals pass.
const ROTATION_TOLERANCE: f64 = 2e-3;
/// Oldest command that the schedule of a tick can hold.
const MAX_COORDINATION_DELAY_TICKS: u64 = 16;
/// Longest delay of a sensor.
const MAX_SENSOR_DELAY_TICKS: u64 = 1000;
/// Longest run: a day at 1 kHz.
const MAX_TICKS: f64 = 86.4e6;

/// A key and what is wrong with its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Violation {
    pub key: String,
    pub problem: String,
}

#[derive(Default)]
struct Checks(Vec<Violation>);

impl Checks {
    fn require(&mut self, holds: bool, key: impl Display, found: impl Display, expected: impl Display) {
        if !holds {
            let problem = format!("found {found}, expected {expected}");
            self.0.push(Violation { key: key.to_string(), problem });
        }
    }

    fn positive(&mut self, key: impl Display, value: f64) {
        self.require(value.is_finite() && value > 0.0, key, value, "a finite number above 0");
    }

    fn not_negative(&mut self, key: impl Display, value: f64) {
        self.require(value.is_finite() && value >= 0.0, key, value, "a finite number from 0");
    }

    fn finite(&mut self, key: impl Display, value: f64) {
        self.require(value.is_finite(), key, value, "a finite number");
    }

    /// Letters, digits, `_` and `-`: names become parts of file and service names.
    fn name(&mut self, key: impl Display, name: &str) {
        let fits = (1..=64).contains(&name.len())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
        self.require(fits, key, format_args!("{name:?}"), "1 to 64 letters, digits, _ or -");
    }

    fn count(&mut self, key: impl Display, count: usize, most: usize, what: &str) {
        self.require((1..=most).contains(&count), key, count, format_args!("1 to {most} {what}"));
    }

    fn unique<'n>(&mut self, names: impl Iterator<Item = &'n str>, key: impl Fn(usize) -> String) {
        let mut seen = BTreeSet::new();
        for (index, name) in names.enumerate() {
            self.require(seen.insert(name), key(index), format_args!("{name:?} again"), "each name once");
        }
    }
}

/// `a / b` if that is a whole number of at least 1.
fn whole_ratio(a: f64, b: f64) -> Option<f64> {
    let ratio = a / b;
    let whole = ratio.round();
    (ratio.is_finite() && whole >= 1.0 && (ratio - whole).abs() <= RATIO_TOLERANCE * whole).then_some(whole)
}

/// Indices into `config.hands` of the hands with which a member grasps.
pub(crate) fn grasping_hands(member: &Member, config: &RobotConfig) -> Option<Vec<usize>> {
    match &member.hands {
        None => Some((0..config.hands.len()).collect()),
        Some(names) => {
            names.iter().map(|name| config.hands.iter().position(|hand| hand.name == *name)).collect()
        }
    }
}

/// Everything wrong with a scenario whose robots, in order, are `configs`.
pub(crate) fn scenario(scenario: &Scenario, configs: &[&RobotConfig]) -> Vec<Violation> {
    let mut checks = Checks::default();
    checks.name("name", &scenario.name);
    times(&mut checks, scenario);
    checks.positive("object.mass_kg", scenario.object.mass_kg);
    for axis in 0..3 {
        checks.positive(format_args!("object.size_m.{axis}"), scenario.object.size_m[axis]);
        checks.finite(format_args!("object.position_m.{axis}"), scenario.object.position_m[axis]);
    }
    checks.finite("object.yaw_deg", scenario.object.yaw_deg);
    grasp(&mut checks, &scenario.grasp);
    let arms = team(&mut checks, &scenario.robots, configs);
    hybrid(&mut checks, scenario, arms);
    checks.not_negative("physics.friction", scenario.physics.friction);
    let sensors = &scenario.sensors;
    checks.not_negative("sensors.force_noise_n", sensors.force_noise_n);
    checks.not_negative("sensors.moment_noise_nm", sensors.moment_noise_nm);
    checks.not_negative("sensors.encoder_noise_rad", sensors.encoder_noise_rad);
    checks.not_negative("sensors.gyro_noise_rad_s", sensors.gyro_noise_rad_s);
    checks.not_negative("sensors.accelerometer_noise_m_s2", sensors.accelerometer_noise_m_s2);
    thresholds(&mut checks, scenario);
    if let Some(priority) = scenario.placement.fifo_priority {
        checks.require(
            (1..=99).contains(&priority),
            "placement.fifo_priority",
            priority,
            "a priority from 1 to 99",
        );
    }
    checks.0
}

fn times(checks: &mut Checks, scenario: &Scenario) {
    let period = scenario.control_period_s;
    checks.positive("control_period_s", period);
    checks.positive("duration_s", scenario.duration_s);
    if period > 0.0 && scenario.duration_s > 0.0 {
        let ticks = whole_ratio(scenario.duration_s, period);
        let expected =
            format_args!("a whole number of control periods ({period} s), at most {MAX_TICKS:e}").to_string();
        checks.require(ticks.is_some_and(|n| n <= MAX_TICKS), "duration_s", scenario.duration_s, expected);
    }
    let step = scenario.physics.step_s;
    checks.positive("physics.step_s", step);
    if period > 0.0 && step > 0.0 {
        let expected = format!("a whole fraction of control_period_s ({period} s)");
        checks.require(whole_ratio(period, step).is_some(), "physics.step_s", step, expected);
    }
    for (key, ticks, most) in [
        ("coordination_delay_ticks", scenario.coordination_delay_ticks, MAX_COORDINATION_DELAY_TICKS),
        ("sensors.delay_ticks", scenario.sensors.delay_ticks, MAX_SENSOR_DELAY_TICKS),
    ] {
        checks.require(ticks <= most, key, ticks, format_args!("at most {most} ticks"));
    }
}

fn grasp(checks: &mut Checks, grasp: &Grasp) {
    match grasp {
        Grasp::Weld { offset_m } => checks.not_negative("grasp.offset_m", *offset_m),
        Grasp::Spring { offset_m, stiffness_n_m, damping_ns_m, stiffness_nm_rad, damping_nms_rad } => {
            checks.not_negative("grasp.offset_m", *offset_m);
            checks.positive("grasp.stiffness_n_m", *stiffness_n_m);
            checks.not_negative("grasp.damping_ns_m", *damping_ns_m);
            checks.positive("grasp.stiffness_nm_rad", *stiffness_nm_rad);
            checks.not_negative("grasp.damping_nms_rad", *damping_nms_rad);
        }
    }
}

/// The number of arms, if every robot's hands are known.
fn team(checks: &mut Checks, members: &[Member], configs: &[&RobotConfig]) -> Option<usize> {
    checks.count("robots", members.len(), MAX_ROBOTS, "robots");
    checks.unique(members.iter().map(|member| member.name.as_str()), |index| format!("robots.{index}.name"));
    let mut arms = Some(0);
    for (index, (member, config)) in members.iter().zip(configs).enumerate() {
        checks.name(format_args!("robots.{index}.name"), &member.name);
        checks.finite(format_args!("robots.{index}.x_m"), member.x_m);
        checks.finite(format_args!("robots.{index}.y_m"), member.y_m);
        checks.finite(format_args!("robots.{index}.yaw_deg"), member.yaw_deg);
        if let Some(hands) = &member.hands {
            checks.count(format_args!("robots.{index}.hands"), hands.len(), config.hands.len(), "hands");
            checks.unique(hands.iter().map(String::as_str), |hand| format!("robots.{index}.hands.{hand}"));
            let known: Vec<_> = config.hands.iter().map(|hand| hand.name.as_str()).collect();
            for (place, hand) in hands.iter().enumerate() {
                let expected = format!("a hand of {}: {}", config.name, known.join(", "));
                let key = format!("robots.{index}.hands.{place}");
                checks.require(known.contains(&hand.as_str()), key, format_args!("{hand:?}"), expected);
            }
        }
        arms = arms.zip(grasping_hands(member, config)).map(|(sum, hands)| sum + hands.len());
    }
    if let Some(arms) = arms {
        checks.require(arms >= 2, "robots", format_args!("{arms} arms"), "at least 2 arms in the team");
    }
    arms
}

fn hybrid(checks: &mut Checks, scenario: &Scenario, arms: Option<usize>) {
    let hybrid = &scenario.hybrid;
    if let Some(start) = hybrid.start_s {
        checks.not_negative("hybrid.start_s", start);
        let expected = format!("a time before the end ({} s); leave it out for never", scenario.duration_s);
        checks.require(start < scenario.duration_s, "hybrid.start_s", start, expected);
    }
    checks.require(hybrid.kz > 0.0 && hybrid.kz <= 1.0, "hybrid.kz", hybrid.kz, "a number above 0, up to 1");
    checks.positive("hybrid.kh_m_n", hybrid.kh_m_n);
    checks.positive("hybrid.kh_rad_nm", hybrid.kh_rad_nm);
    checks.positive("hybrid.filter_hz", hybrid.filter_hz);
    if let (InternalForces::Matrix(rows), Some(arms)) = (&hybrid.internal_forces, arms) {
        let key = "hybrid.internal_forces.matrix";
        let expected = format!("{} rows: one less than the team's {arms} arms", arms.saturating_sub(1));
        checks.require(rows.len() + 1 == arms, key, format_args!("{} rows", rows.len()), expected);
        for (index, row) in rows.iter().enumerate() {
            let expected = format!("one for each of the team's {arms} arms");
            checks.require(
                row.len() == arms,
                format_args!("{key}.{index}"),
                format_args!("{} numbers", row.len()),
                expected,
            );
            for (column, value) in row.iter().enumerate() {
                checks.finite(format_args!("{key}.{index}.{column}"), *value);
            }
        }
    }
    let mut seen = BTreeSet::new();
    for (index, axis) in hybrid.axes.iter().enumerate() {
        checks.finite(format_args!("hybrid.axes.{index}.reference"), axis.reference);
        let found = format!("row {:?}, axis {:?} again", axis.row, axis.axis).to_lowercase();
        let is_new = seen.insert((&axis.row, axis.axis as u8));
        checks.require(is_new, format_args!("hybrid.axes.{index}"), found, "each axis of a row once");
    }
}

fn thresholds(checks: &mut Checks, scenario: &Scenario) {
    let limits = &scenario.thresholds;
    for (key, limit) in [
        ("internal_start_min_n", limits.internal_start_min_n),
        ("internal_after_3s_n", limits.internal_after_3s_n),
        ("internal_after_3s_nm", limits.internal_after_3s_nm),
        ("internal_end_n", limits.internal_end_n),
        ("internal_end_nm", limits.internal_end_nm),
        ("object_position_peak_m", limits.object_position_peak_m),
        ("object_attitude_peak_rad", limits.object_attitude_peak_rad),
        ("foot_slip_max_m", limits.foot_slip_max_m),
        ("joint_margin_min_rad", limits.joint_margin_min_rad),
        ("zmp_margin_min_m", limits.zmp_margin_min_m),
    ] {
        if let Some(limit) = limit {
            checks.not_negative(format_args!("thresholds.{key}"), limit);
        }
    }
}

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
