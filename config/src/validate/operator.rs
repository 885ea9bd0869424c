//! The operator's part: bounds within which the object comes to rest in time.

use super::checks::Checks;
use crate::scenario::{DriveLimits, OperatorEvent, OperatorWord, Policy, Scenario};

/// Whoever drives speaks twenty times a second: two messages in a row may be late.
const SHORTEST_SILENCE_S: f64 = 0.15;
/// No object that is driven moves faster, in metres or radians per second.
const FASTEST: f64 = 0.5;
/// No object is driven to gain or lose speed faster, per second squared.
const STEEPEST: f64 = 5.0;
/// No object that hands carry is pressed harder.
const MAX_SQUEEZE_N: f64 = 200.0;

pub(super) fn operator(checks: &mut Checks, scenario: &Scenario) {
    if let Some(limits) = &scenario.operator.drive {
        drive(checks, limits, scenario);
    }
    for (index, event) in scenario.operator.script.iter().enumerate() {
        script(checks, &format!("operator.script.{index}"), event, scenario);
    }
}

fn drive(checks: &mut Checks, limits: &DriveLimits, scenario: &Scenario) {
    let key = |name: &str| format!("operator.drive.{name}");
    checks.positive(key("timeout_s"), limits.timeout_s);
    for (name, most, value) in [
        ("velocity_max_m_s", FASTEST, limits.velocity_max_m_s),
        ("vertical_max_m_s", FASTEST, limits.vertical_max_m_s),
        ("yaw_rate_max_rad_s", FASTEST, limits.yaw_rate_max_rad_s),
        ("tilt_rate_max_rad_s", FASTEST, limits.tilt_rate_max_rad_s),
        ("acceleration_m_s2", STEEPEST, limits.acceleration_m_s2),
        ("angular_acceleration_rad_s2", STEEPEST, limits.angular_acceleration_rad_s2),
        ("braking_m_s2", STEEPEST, limits.braking_m_s2),
        ("angular_braking_rad_s2", STEEPEST, limits.angular_braking_rad_s2),
        ("height_m", FASTEST, limits.height_m),
        ("tilt_rad", FASTEST, limits.tilt_rad),
    ] {
        let expected = format_args!("more than 0, at most {most}").to_string();
        checks.require(value > 0.0 && value <= most, key(name), value, expected);
    }
    let silence_s = limits.silence_s();
    let expected =
        format!("at least {SHORTEST_SILENCE_S} s more than braking takes ({:.2} s)", limits.braking_s());
    let is_long_enough = silence_s.is_finite() && silence_s >= SHORTEST_SILENCE_S;
    checks.require(is_long_enough, key("timeout_s"), limits.timeout_s, expected);
    if let Some(range_m) = limits.range_m {
        checks.positive(key("range_m"), range_m);
    }
    if let Some(squeeze) = &limits.squeeze {
        let is_safe = squeeze.max_n > 0.0 && squeeze.max_n <= MAX_SQUEEZE_N;
        let expected = format!("more than 0, at most {MAX_SQUEEZE_N} N");
        checks.require(is_safe, key("squeeze.max_n"), squeeze.max_n, expected);
        checks.positive(key("squeeze.rate_n_s"), squeeze.rate_n_s);
        let is_translation = (squeeze.axis as usize) < 3;
        checks.require(is_translation, key("squeeze.axis"), "a rotation", "x, y or z");
    }
    checks.require(scenario.motion.is_none(), "motion", "one", "none: whoever drives moves the object");
    let expected = "a time, or a job: without the hybrid law nothing moves the object";
    checks.require(scenario.is_controlled(), "hybrid.start_s", "none", expected);
    let is_by_symmetry = scenario.coordination.policy == Policy::Symmetry;
    checks.require(is_by_symmetry, "coordination.policy", "leader-follower", "symmetry: somebody drives");
}

fn script(checks: &mut Checks, key: &str, event: &OperatorEvent, scenario: &Scenario) {
    checks.not_negative(format_args!("{key}.at_s"), event.at_s);
    let numbers = event.velocity_m_s.iter().chain(&event.angular_velocity_rad_s).chain([&event.squeeze_n]);
    let (is_finite, is_zero) =
        numbers.fold((true, true), |(finite, zero), n| (finite && n.is_finite(), zero && *n == 0.0));
    checks.require(is_finite, key, "a number that is not finite", "finite numbers");
    let is_drive = event.says == OperatorWord::Drive;
    checks.require(is_drive || is_zero, key, "velocities or a squeeze", "none, or `says = \"drive\"`");
    let needs_drive = !matches!(event.says, OperatorWord::Stop | OperatorWord::Resume);
    let expected = "stop or resume: there is no [operator.drive]";
    let found = format!("{:?}", event.says).to_lowercase();
    checks.require(!needs_drive || scenario.is_driven(), format_args!("{key}.says"), found, expected);
}
