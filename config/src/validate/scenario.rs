//! Scenarios: periods that divide each other, teams that agree with their models, gains in range.

use super::checks::{Checks, Violation};
use super::{hosts, membership, operator};
use crate::robot::RobotConfig;
use crate::scenario::{
    Control, Grasp, Ground, InternalForces, Job, LostGrasp, Member, Motion, Policy, PushEvent, Scenario,
};
use mikoshi_ipc_types::{MAX_COORDINATION_DELAY_TICKS, MAX_ROBOTS, Push};
use std::collections::BTreeSet;

/// Ratios of periods count as whole within this.
const RATIO_TOLERANCE: f64 = 1e-9;
/// Longest delay of a sensor.
const MAX_SENSOR_DELAY_TICKS: u64 = 1000;
/// Longest run: a day at 1 kHz.
const MAX_TICKS: f64 = 86.4e6;

/// Nobody watches longer.
const SLOWEST: f64 = 100.0;

/// Highest foot of a step.
const MAX_LIFT_M: f64 = 0.3;

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
        checks.finite(format_args!("object.com_m.{axis}"), scenario.object.com_m[axis]);
    }
    checks.finite("object.yaw_deg", scenario.object.yaw_deg);
    grasp(&mut checks, &scenario.grasp);
    let arms = team(&mut checks, &scenario.robots, configs);
    hybrid(&mut checks, scenario, arms);
    if let Some(of_team) = &scenario.job {
        job(&mut checks, of_team, scenario);
    }
    let coordination = &scenario.coordination;
    checks.positive("coordination.detection_n", coordination.detection_n);
    checks.not_negative("coordination.delay_s", coordination.delay_s);
    if let Some(leader) = &coordination.leader {
        let names: Vec<_> = scenario.robots.iter().map(|member| member.name.as_str()).collect();
        let expected = format!("a robot of the team: {}", names.join(", "));
        let is_known = names.contains(&leader.as_str());
        checks.require(is_known, "coordination.leader", format_args!("{leader:?}"), expected);
    }
    if let Some(of_object) = &scenario.motion {
        motion(&mut checks, of_object, scenario);
    }
    checks.positive("gait.double_support_s", scenario.gait.double_support_s);
    checks.positive("gait.single_support_s", scenario.gait.single_support_s);
    let lift_m = scenario.gait.lift_m;
    checks.require(
        lift_m > 0.0 && lift_m <= MAX_LIFT_M,
        "gait.lift_m",
        lift_m,
        format_args!("more than 0, at most {MAX_LIFT_M} m"),
    );
    safety(&mut checks, scenario);
    membership::membership(&mut checks, scenario);
    load(&mut checks, scenario);
    operator::operator(&mut checks, scenario);
    hosts::hosts(&mut checks, scenario);
    checks.not_negative("physics.friction", scenario.physics.friction);
    world(&mut checks, scenario);
    grasp_failures(&mut checks, scenario, configs);
    pushes(&mut checks, scenario);
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

fn load(checks: &mut Checks, scenario: &Scenario) {
    let load = &scenario.load;
    checks.not_negative("load.hand_moment_nm", load.hand_moment_nm);
    let (shares, robots) = (load.shares.len(), scenario.robots.len());
    let expected = format_args!("none, or one for each of {robots} robots");
    checks.require(
        shares == 0 || shares == robots,
        "load.shares",
        format_args!("{shares} numbers"),
        expected,
    );
    for (robot, share) in load.shares.iter().enumerate() {
        checks.not_negative(format_args!("load.shares.{robot}"), *share);
    }
    let sum: f64 = load.shares.iter().sum();
    checks.require(
        shares == 0 || sum > 0.0,
        "load.shares",
        format_args!("a sum of {sum}"),
        "somebody who bears",
    );
    let mut mass_kg = scenario.object.mass_kg;
    let mut changes: Vec<_> = scenario.world.load_changes.iter().enumerate().collect();
    changes.sort_by(|(_, a), (_, b)| a.at_s.total_cmp(&b.at_s));
    for (index, change) in changes {
        let key = |name: &str| format!("world.load_changes.{index}.{name}");
        checks.not_negative(key("at_s"), change.at_s);
        for axis in 0..3 {
            checks.finite(key(&format!("position_m.{axis}")), change.position_m[axis]);
        }
        mass_kg += change.mass_kg;
        checks.require(
            mass_kg > 0.0,
            key("mass_kg"),
            change.mass_kg,
            "an object that is left with some mass",
        );
    }
}

fn safety(checks: &mut Checks, scenario: &Scenario) {
    let safety = &scenario.safety;
    checks.positive("safety.hand_force_max_n", safety.hand_force_max_n);
    checks.positive("safety.hand_moment_max_nm", safety.hand_moment_max_nm);
    checks.finite("safety.zmp_margin_min_m", safety.zmp_margin_min_m);
    checks.positive("safety.tilt_max_rad", safety.tilt_max_rad);
    checks.positive("safety.torque_limit_s", safety.torque_limit_s);
    let stale_limit = safety.stale_limit_ticks;
    checks.require(stale_limit > 0, "safety.stale_limit_ticks", stale_limit, "at least 1");
    checks.positive("safety.slip_m", safety.slip_m);
    checks.positive("safety.slip_rad", safety.slip_rad);
    checks.require(safety.slip_ticks > 0, "safety.slip_ticks", safety.slip_ticks, "at least 1");
    if safety.lost_grasp == LostGrasp::CarryOn {
        let key = "safety.lost_grasp";
        let is_tree = scenario.hybrid.internal_forces == InternalForces::BalancedTree;
        let expected = "stop: internal forces that are no balanced tree are not formed anew";
        checks.require(is_tree, key, "carry-on", expected);
        let is_by_symmetry = scenario.coordination.policy == Policy::Symmetry;
        checks.require(is_by_symmetry, key, "carry-on", "stop: a leader does not share what it carries");
    }
}

fn world(checks: &mut Checks, scenario: &Scenario) {
    let boxes = &scenario.world.boxes;
    checks.unique(boxes.iter().map(|fixed| fixed.name.as_str()), |index| format!("world.boxes.{index}.name"));
    for (index, fixed) in boxes.iter().enumerate() {
        let key = format!("world.boxes.{index}");
        checks.name(format_args!("{key}.name"), &fixed.name);
        checks.finite_numbers(&format!("{key}.position_m"), &fixed.position_m);
        for axis in 0..3 {
            checks.positive(format_args!("{key}.size_m.{axis}"), fixed.size_m[axis]);
        }
        checks.finite(format_args!("{key}.yaw_deg"), fixed.yaw_deg);
        if let Some(friction) = fixed.friction {
            checks.not_negative(format_args!("{key}.friction"), friction);
        }
    }
    if let Some(ground) = &scenario.world.ground {
        let key = "world.ground";
        checks.not_negative(format_args!("{key}.step_m"), ground.step_m);
        let most = Ground::MAX_STEP_M;
        checks.require(
            ground.step_m <= most,
            format_args!("{key}.step_m"),
            ground.step_m,
            format_args!("at most {most} m"),
        );
        checks.not_negative(format_args!("{key}.slope_deg"), ground.slope_deg);
        let most = Ground::MAX_SLOPE_DEG;
        checks.require(
            ground.slope_deg <= most,
            format_args!("{key}.slope_deg"),
            ground.slope_deg,
            format_args!("at most {most}"),
        );
        if let Some(friction) = ground.patch_friction {
            checks.positive(format_args!("{key}.patch_friction"), friction);
        }
        checks.positive(format_args!("{key}.patch_contact_s"), ground.patch_contact_s);
    }
}

fn grasp_failures(checks: &mut Checks, scenario: &Scenario, configs: &[&RobotConfig]) {
    let members = || scenario.robots.iter().zip(configs);
    for (index, failure) in scenario.world.grasp_failures.iter().enumerate() {
        let key = format!("world.grasp_failures.{index}");
        checks.not_negative(format_args!("{key}.at_s"), failure.at_s);
        checks.positive(format_args!("{key}.friction_n"), failure.friction_n);
        let ratio = failure.damping_ratio(scenario.physics.step_s, scenario.object.mass_kg);
        let expected = "less, or a shorter physics step: the object would shake";
        checks.require(
            ratio.is_nan() || ratio < 0.5,
            format_args!("{key}.friction_n"),
            failure.friction_n,
            expected,
        );
        let Some((member, config)) = members().find(|(member, _)| member.name == failure.robot) else {
            let names: Vec<_> = members().map(|(member, _)| member.name.as_str()).collect();
            let expected = format!("a robot of the team: {}", names.join(", "));
            checks.require(false, format_args!("{key}.robot"), format_args!("{:?}", failure.robot), expected);
            continue;
        };
        let grasping = grasping_hands(member, config).unwrap_or_default();
        let names: Vec<_> = grasping.iter().map(|&hand| config.hands[hand].name.as_str()).collect();
        let expected = format!("a hand with which {} grasps: {}", member.name, names.join(", "));
        let is_known = names.contains(&failure.hand.as_str());
        checks.require(is_known, format_args!("{key}.hand"), format_args!("{:?}", failure.hand), expected);
    }
}

fn pushes(checks: &mut Checks, scenario: &Scenario) {
    for (index, push) in scenario.world.pushes.iter().enumerate() {
        let key = |name: &str| format!("world.pushes.{index}.{name}");
        checks.not_negative(key("at_s"), push.at_s);
        let expected = format!("more than 0, at most {} s", PushEvent::MAX_S);
        checks.require(
            push.for_s > 0.0 && push.for_s <= PushEvent::MAX_S,
            key("for_s"),
            push.for_s,
            expected,
        );
        let expected = format!("forces of at most {} N", Push::MAX_FORCE_N);
        let is_weak = push.force_n.iter().all(|force| force.abs() <= Push::MAX_FORCE_N);
        checks.require(is_weak, key("force_n"), format_args!("{:?}", push.force_n), expected);
        checks.finite(key("heading_deg"), push.heading_deg);
        let names: Vec<_> = scenario.robots.iter().map(|member| member.name.as_str()).collect();
        let expected = format!("object, or a robot of the team: {}", names.join(", "));
        let is_known = scenario.push_target(&push.on).is_some();
        checks.require(is_known, key("on"), format_args!("{:?}", push.on), expected);
    }
}

fn times(checks: &mut Checks, scenario: &Scenario) {
    let period = scenario.control_period_s;
    checks.positive("control_period_s", period);
    checks.positive("duration_s", scenario.duration_s);
    let slow = scenario.slow_motion;
    checks.require((1.0..=SLOWEST).contains(&slow), "slow_motion", slow, format_args!("1 to {SLOWEST}"));
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
    checks.positive("hybrid.loop_gain", hybrid.loop_gain);
    checks.positive("hybrid.hand_stiffness_n_m", hybrid.hand_stiffness_n_m);
    checks.positive("hybrid.hand_stiffness_nm_rad", hybrid.hand_stiffness_nm_rad);
    for (key, stiffness) in [
        ("hybrid.grasp_stiffness_n_m", hybrid.grasp_stiffness_n_m),
        ("hybrid.grasp_stiffness_nm_rad", hybrid.grasp_stiffness_nm_rad),
    ] {
        checks.positive(key, stiffness.unwrap_or(1.0));
    }
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
        if let Some(force) = axis.expected_force {
            let key = format!("hybrid.axes.{index}.expected_force");
            checks.finite(&key, force);
            let expected = "none: an axis that is controlled by force has its reference";
            checks.require(axis.control == Control::Position, &key, force, expected);
        }
        let found = format!("row {:?}, axis {:?} again", axis.row, axis.axis).to_lowercase();
        let is_new = seen.insert((&axis.row, axis.axis as u8));
        checks.require(is_new, format_args!("hybrid.axes.{index}"), found, "each axis of a row once");
    }
}

fn job(checks: &mut Checks, job: &Job, scenario: &Scenario) {
    checks.not_negative("job.start_s", job.start_s);
    checks.positive("job.draw_back_m", job.draw_back_m);
    checks.positive("job.approach_s", job.approach_s);
    checks.not_negative("job.grasp_s", job.grasp_s);
    checks.not_negative("job.settle_s", job.settle_s);
    checks.positive("job.lift_m", job.lift_m);
    checks.positive("job.lift_s", job.lift_s);
    checks.positive("job.creep_m", job.creep_m);
    let expected = format!("less than job.lift_m ({} m)", job.lift_m);
    checks.require(job.creep_m < job.lift_m, "job.creep_m", job.creep_m, expected);
    checks.positive("job.creep_m_s", job.creep_m_s);
    checks.not_negative("job.unload_s", job.unload_s);
    checks.positive("job.time_limit_s", job.time_limit_s);
    let carry_s = scenario.motion.as_ref().map_or(0.0, Motion::end_s);
    let (end_s, duration_s) = (job.shortest_s() + carry_s, scenario.duration_s);
    let expected = format!("a job that ends before the run does ({duration_s} s)");
    checks.require(end_s < duration_s, "job", format_args!("one that takes {end_s:.1} s"), expected);
    if let Some(start_s) = scenario.hybrid.start_s {
        checks.require(false, "hybrid.start_s", start_s, "none: a job starts the law when the hands hold");
    }
    let is_by_symmetry = scenario.coordination.policy == Policy::Symmetry;
    checks.require(is_by_symmetry, "coordination.policy", "leader-follower", "symmetry: there is a job");
}

fn motion(checks: &mut Checks, motion: &Motion, scenario: &Scenario) {
    checks.not_negative("motion.start_s", motion.start_s);
    if let Some(start_s) = scenario.hybrid.start_s {
        let expected = format!("a time from hybrid.start_s ({start_s} s) on");
        checks.require(motion.start_s >= start_s, "motion.start_s", motion.start_s, expected);
    } else if scenario.job.is_none() {
        let expected = "none, or a time: without the hybrid law nothing moves the object";
        checks.require(false, "hybrid.start_s", "motion without it", expected);
    }
    checks.positive("motion.acceleration_m_s2", motion.acceleration_m_s2);
    checks.positive("motion.angular_acceleration_rad_s2", motion.angular_acceleration_rad_s2);
    for (index, segment) in motion.segments.iter().enumerate() {
        let key = format!("motion.segments.{index}");
        checks.positive(format_args!("{key}.duration_s"), segment.duration_s);
        speeds(checks, &format!("{key}.velocity_m_s"), segment.velocity_m_s);
        speeds(checks, &format!("{key}.angular_velocity_rad_s"), segment.angular_velocity_rad_s);
    }
    if let Some(random) = &motion.random {
        checks.positive("motion.random.duration_s", random.duration_s);
        checks.positive("motion.random.change_s", random.change_s);
        let count = whole_ratio(random.duration_s, random.change_s);
        let expected = format!("a whole number of motion.random.change_s ({} s)", random.change_s);
        checks.require(count.is_some(), "motion.random.duration_s", random.duration_s, expected);
        for (key, travel) in [("travel_m", random.travel_m), ("travel_rad", random.travel_rad)] {
            let (limit, key) = (FASTEST * random.duration_s, format!("motion.random.{key}"));
            let is_slow = travel.iter().all(|travel| travel.abs() <= limit);
            let expected = format!("at most {limit} in motion.random.duration_s");
            checks.require(is_slow, key, format_args!("{travel:?}"), expected);
        }
        speeds(checks, "motion.random.deviation_m_s", random.deviation_m_s);
        speeds(checks, "motion.random.deviation_rad_s", random.deviation_rad_s);
    }
    let (end_s, duration_s) = (motion.end_s(), scenario.duration_s);
    let expected = format!("a motion that ends before the run does ({duration_s} s)");
    checks.require(end_s <= duration_s, "motion", format_args!("one that ends at {end_s} s"), expected);
}

/// No object that robots carry moves faster, in metres or radians per second.
const FASTEST: f64 = 10.0;

fn speeds(checks: &mut Checks, key: &str, speeds: [f64; 3]) {
    let is_slow = speeds.iter().all(|speed| speed.abs() <= FASTEST);
    checks.require(is_slow, key, format_args!("{speeds:?}"), format!("numbers of at most {FASTEST}"));
}

fn thresholds(checks: &mut Checks, scenario: &Scenario) {
    let limits = &scenario.thresholds;
    for (key, limit) in [
        ("internal_start_min_n", limits.internal_start_min_n),
        ("internal_after_3s_n", limits.internal_after_3s_n),
        ("internal_after_3s_nm", limits.internal_after_3s_nm),
        ("internal_end_n", limits.internal_end_n),
        ("internal_end_nm", limits.internal_end_nm),
        ("axis_reference_error_end_n", limits.axis_reference_error_end_n),
        ("axis_reference_error_end_nm", limits.axis_reference_error_end_nm),
        ("internal_peak_n", limits.internal_peak_n),
        ("object_position_rms_m", limits.object_position_rms_m),
        ("object_position_peak_m", limits.object_position_peak_m),
        ("object_attitude_rms_rad", limits.object_attitude_rms_rad),
        ("object_attitude_peak_rad", limits.object_attitude_peak_rad),
        ("object_travel_min_m", limits.object_travel_min_m),
        ("object_travel_min_rad", limits.object_travel_min_rad),
        ("object_goal_error_max_m", limits.object_goal_error_max_m),
        ("object_goal_error_max_rad", limits.object_goal_error_max_rad),
        ("object_speed_end_max_m_s", limits.object_speed_end_max_m_s),
        ("foot_slip_max_m", limits.foot_slip_max_m),
        ("joint_margin_min_rad", limits.joint_margin_min_rad),
        ("saturated_share_max", limits.saturated_share_max),
        ("zmp_margin_min_m", limits.zmp_margin_min_m),
    ] {
        if let Some(limit) = limit {
            checks.not_negative(format_args!("thresholds.{key}"), limit);
        }
    }
}
