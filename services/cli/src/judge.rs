//! Whether a run met its scenario's thresholds.

use mikoshi_config::Scenario;
use mikoshi_config::scenario::{AxisControl, Control, Thresholds};
use mikoshi_cooperation::OBJECT_ROW;
use mikoshi_ipc_types::mode;
use mikoshi_observation::{
    InternalSummary, MemberSummary, ModeSummary, ObjectSummary, RobotSummary, Summary,
};
use mikoshi_report::JudgedLimit;

const GRAVITY_M_S2: f64 = 9.81;
/// How long after its start the hybrid law is judged.
const JUDGED_AFTER_S: f64 = 3.0;

/// Every threshold that was not met, in words. Nothing that was not observed counts as met.
pub fn failures(scenario: &Scenario, summary: &Summary) -> Vec<String> {
    judge(scenario, summary).failures
}

/// Every threshold with what was measured.
pub fn judged_limits(scenario: &Scenario, summary: &Summary) -> Vec<JudgedLimit> {
    judge(scenario, summary).limits
}

fn judge(scenario: &Scenario, summary: &Summary) -> Judge {
    let limits = &scenario.thresholds;
    let mut judge = Judge::default();
    for robot in &summary.fell {
        judge.fail(format!("robot {robot} fell"));
    }
    if summary.unintended_contact_ticks > 0 {
        judge.fail(format!("something touched unintendedly in {} ticks", summary.unintended_contact_ticks));
    }

    if let Some(limit) = limits.internal_start_min_n {
        let largest = largest(&summary.internal, |row| row.start_n);
        let is_met = largest >= limit;
        judge.note("internal forces at the start", largest, format!("at least {limit} N"), "N", is_met);
        if !is_met {
            judge.fail(format!(
                "internal forces start at no more than {largest:.3} N, expected at least {limit} N"
            ));
        }
    }
    let rows = summary.internal.as_slice();
    let external_force_n = external_force_end(scenario, &summary.object);
    for axis in &scenario.hybrid.axes {
        judge_axis(&mut judge, limits, axis, rows, &external_force_n);
    }
    let (when, observed) = ("3 s after the start", is_judged_after_3s(scenario, summary).then_some(rows));
    judge.internal_forces(observed, when, "N", limits.internal_after_3s_n, |row| row.after_3s_n);
    judge.internal_forces(observed, when, "Nm", limits.internal_after_3s_nm, |row| row.after_3s_nm);
    judge.internal_forces(observed, "from 3 s on", "N", limits.internal_peak_n, |row| row.peak_n);
    let errors = "against their references";
    let at_end = "against their references at the end";
    judge.internal_forces(observed, errors, "N", limits.internal_error_peak_n, |row| row.error_peak_n);
    judge.internal_forces(Some(rows), at_end, "N", limits.internal_error_end_n, |row| row.error_end_n);
    judge.internal_forces(Some(rows), at_end, "Nm", limits.internal_error_end_nm, |row| row.error_end_nm);
    judge.internal_forces(Some(rows), "at the end", "N", limits.internal_end_n, |row| row.end_n);
    judge.internal_forces(Some(rows), "at the end", "Nm", limits.internal_end_nm, |row| row.end_nm);

    judge_object(&mut judge, scenario, &summary.object);
    if scenario.job.is_some() {
        judge_job(&mut judge, &summary.modes);
    }
    judge_members(&mut judge, &summary.members);
    for robot in &summary.robots {
        judge_robot(&mut judge, scenario, robot, summary.ticks);
    }
    judge
}

fn judge_object(judge: &mut Judge, scenario: &Scenario, object: &ObjectSummary) {
    let limits = &scenario.thresholds;
    // Along an axis under force control there is no position to keep.
    let is_position = |axis: usize| {
        let mut of_object = scenario.hybrid.axes.iter().filter(|exception| exception.row == OBJECT_ROW);
        !of_object.any(|exception| exception.control == Control::Force && exception.axis as usize == axis)
    };
    let worst_of = |values: [f64; 3], first: usize| {
        let held = values.into_iter().enumerate().filter(|(axis, _)| is_position(first + axis));
        // NaN is the largest.
        held.map(|(_, value)| value).max_by(f64::total_cmp).unwrap_or(0.0)
    };
    for (what, values, first, limit, unit) in [
        ("object position error", object.position_peak_m, 0, limits.object_position_peak_m, "m"),
        ("object position error, RMS", object.position_rms_m, 0, limits.object_position_rms_m, "m"),
        ("object attitude error", object.attitude_peak_rad, 3, limits.object_attitude_peak_rad, "rad"),
        ("object attitude error, RMS", object.attitude_rms_rad, 3, limits.object_attitude_rms_rad, "rad"),
    ] {
        if let Some(limit) = limit {
            judge.at_most(what, worst_of(values, first), limit, unit);
        }
    }
    let norm = |values: [f64; 3]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
    if let Some(limit) = limits.object_travel_min_m {
        judge.at_least("way of the object", norm(object.travel_m), limit, "m");
    }
    if let Some(limit) = limits.object_travel_min_rad {
        judge.at_least("turn of the object", norm(object.travel_rad), limit, "rad");
    }
    judge_rest(judge, limits, object);
}

/// Where the object comes to rest in the end; where nobody knows where it should, that is not met.
fn judge_rest(judge: &mut Judge, limits: &Thresholds, object: &ObjectSummary) {
    let norm = |values: Option<[f64; 3]>| values.map_or(f64::NAN, |[x, y, z]| x.hypot(y).hypot(z));
    for (what, value, limit, unit) in [
        (
            "distance of the object from its goal",
            norm(object.goal_error_m),
            limits.object_goal_error_max_m,
            "m",
        ),
        (
            "angle of the object from its goal",
            norm(object.goal_error_rad),
            limits.object_goal_error_max_rad,
            "rad",
        ),
        ("speed of the object at the end", object.speed_end_m_s, limits.object_speed_end_max_m_s, "m/s"),
    ] {
        if let Some(limit) = limit {
            judge.at_most(what, value, limit, unit);
        }
    }
}

/// One axis that departs from the default, if what it is to bear is known.
fn judge_axis(
    judge: &mut Judge,
    limits: &Thresholds,
    axis: &AxisControl,
    rows: &[InternalSummary],
    external_force_n: &[f64; 3],
) {
    let reference = match axis.control {
        Control::Force => Some(axis.reference),
        Control::Position => axis.expected_force,
    };
    let component = axis.axis as usize;
    let (limit, unit) = match component {
        0..3 => (limits.axis_reference_error_end_n, "N"),
        _ => (limits.axis_reference_error_end_nm, "Nm"),
    };
    let (Some(reference), Some(limit)) = (reference, limit) else { return };
    let end = match rows.iter().find(|row| row.name == axis.row) {
        Some(row) => row.end_mean[component],
        // The external moment has no figure: NaN fails.
        None => external_force_n.get(component).copied().unwrap_or(f64::NAN),
    };
    let is_met = (end - reference).abs() <= limit;
    let what = format!("{} of {}", format!("{:?}", axis.axis).to_lowercase(), axis.row);
    let expected = format!("{reference} {unit} within {limit} {unit}");
    judge.note(format_args!("{what} at the end"), end, &expected, unit, is_met);
    if !is_met {
        judge.fail(format!("{what}: {} at the end, expected {expected}", quantity(end, unit)));
    }
}

/// What all hands together apply to the resting object: they hold its weight, and press it against what
/// supports it.
fn external_force_end(scenario: &Scenario, object: &ObjectSummary) -> [f64; 3] {
    let [x, y, z] = object.support_force_end_n;
    [0.0 - x, 0.0 - y, scenario.object.mass_kg * GRAVITY_M_S2 - z]
}

/// Whether the run was long enough to be judged [`JUDGED_AFTER_S`] after its hybrid law started.
pub fn is_judged_after_3s(scenario: &Scenario, summary: &Summary) -> bool {
    let start_s = if scenario.is_controlled() { hybrid_start_s(&summary.modes) } else { Some(0.0) };
    start_s.is_some_and(|start_s| start_s + JUDGED_AFTER_S < summary.sim_time_s)
}

fn hybrid_start_s(modes: &[ModeSummary]) -> Option<f64> {
    let is_hybrid = |name: &str| [mode::LIFT, mode::CARRY, mode::LOWER].map(mode::name).contains(&name);
    modes.iter().find(|entry| is_hybrid(&entry.mode)).map(|entry| entry.start_s)
}

/// A job is done when the hands that let go have drawn back, and the team stands again.
fn judge_job(judge: &mut Judge, modes: &[ModeSummary]) {
    let names: Vec<&str> = modes.iter().map(|entry| entry.mode.as_str()).collect();
    match names.as_slice() {
        [.., before, last] if *before == mode::name(mode::RELEASE) && *last == mode::name(mode::HOLD) => {}
        [.., during, last] if *last == mode::name(mode::SAFE_STOP) => {
            let stop_s = modes.last().map_or(0.0, |entry| entry.start_s);
            judge.fail(format!("the job failed: the team stopped after {stop_s:.2} s, in {during}"));
        }
        [.., last] => judge.fail(format!("the job is not done: the run ends in {last}")),
        [] => judge.fail("the job is not done: no tick was observed".to_owned()),
    }
}

/// Who was asked to leave or to join has done so.
fn judge_members(judge: &mut Judge, members: &[MemberSummary]) {
    for (index, member) in members.iter().enumerate() {
        let MemberSummary { robot, stage, .. } = member;
        if let Some(fault) = &member.fault {
            judge.fail(format!("{robot}, {stage}, did not go on as it was asked to: {fault}"));
        }
        let is_last = members.iter().skip(index + 1).all(|later| later.robot != *robot);
        let is_settled = ["member", "away"].contains(&stage.as_str());
        if is_last && !is_settled {
            judge.fail(format!("{robot} is still {stage} in the end"));
        }
    }
}

fn judge_robot(judge: &mut Judge, scenario: &Scenario, robot: &RobotSummary, ticks: u64) {
    let limits = &scenario.thresholds;
    let name = &robot.name;
    if let Some(limit) = limits.foot_slip_max_m {
        judge.at_most(format_args!("slip of the feet of {name}"), robot.foot_slip_max_m, limit, "m");
    }
    if let Some(limit) = limits.joint_margin_min_rad {
        let what = format!("distance of {name}'s {} from its limit", robot.joint_margin_joint);
        judge.at_least(what, robot.joint_margin_min_rad, limit, "rad");
    }
    if let Some(limit) = limits.zmp_margin_min_m {
        judge.at_least(format_args!("ZMP margin of {name}"), robot.zmp_margin_min_m, limit, "m");
    }
    if let Some(limit) = limits.saturated_ticks_max {
        let ticks = robot.saturated_ticks;
        let what = format!("ticks with saturated drives of {name}");
        judge.note(what, ticks as f64, format!("at most {limit}"), "", ticks <= limit);
        if ticks > limit {
            judge.fail(format!("drives of {name} saturated: {ticks} ticks, expected at most {limit}"));
        }
    }
    if let Some(limit) = limits.saturated_share_max {
        let share = robot.saturated_ticks as f64 / ticks.max(1) as f64;
        judge.at_most(format_args!("share of ticks with saturated drives of {name}"), share, limit, "");
    }
}

fn largest(rows: &[InternalSummary], figure: impl Fn(&InternalSummary) -> f64) -> f64 {
    rows.iter().map(figure).fold(0.0, f64::max)
}

#[derive(Default)]
struct Judge {
    failures: Vec<String>,
    limits: Vec<JudgedLimit>,
}

impl Judge {
    fn fail(&mut self, what: String) {
        self.failures.push(what);
    }

    fn note(
        &mut self,
        what: impl core::fmt::Display,
        measured: f64,
        limit: impl core::fmt::Display,
        unit: &str,
        is_met: bool,
    ) {
        let measured = if measured == 0.0 { format!("0 {unit}") } else { quantity(measured, unit) };
        let measured = measured.trim_end().to_owned();
        let limit = limit.to_string().trim_end().to_owned();
        self.limits.push(JudgedLimit { what: what.to_string(), measured, limit, is_met });
    }

    /// One failure for all rows: the largest, and how many there are. Rows that were not observed fail.
    fn internal_forces(
        &mut self,
        observed: Option<&[InternalSummary]>,
        when: &str,
        unit: &str,
        limit: Option<f64>,
        figure: impl Fn(&InternalSummary) -> f64,
    ) {
        let Some(limit) = limit else { return };
        let expected = format!("at most {limit} {unit}");
        let Some(rows) = observed else {
            self.note(format_args!("internal forces {when}"), f64::NAN, expected, unit, false);
            return self.fail(format!(
                "internal forces {when}: the run ends before, expected at most {limit} {unit}"
            ));
        };
        // NaN fails, and is the largest.
        let worst = rows.iter().map(&figure).max_by(f64::total_cmp).unwrap_or(0.0);
        self.note(format_args!("internal forces {when}"), worst, expected, unit, worst <= limit);
        let failed = || rows.iter().filter(|row| figure(row).is_nan() || figure(row) > limit);
        if let Some(largest) = failed().max_by(|a, b| figure(a).total_cmp(&figure(b))) {
            self.fail(format!(
                "{} of {} internal forces {when}: up to {} ({}), expected at most {limit} {unit}",
                failed().count(),
                rows.len(),
                quantity(figure(largest), unit),
                largest.name
            ));
        }
    }

    fn at_most(&mut self, what: impl core::fmt::Display, value: f64, limit: f64, unit: &str) {
        self.note(&what, value, format_args!("at most {limit} {unit}"), unit, value <= limit);
        if value.is_nan() || value > limit {
            self.fail(format!("{what}: {}, expected at most {limit} {unit}", quantity(value, unit)));
        }
    }

    fn at_least(&mut self, what: impl core::fmt::Display, value: f64, limit: f64, unit: &str) {
        self.note(&what, value, format_args!("at least {limit} {unit}"), unit, value >= limit);
        if value.is_nan() || value < limit {
            self.fail(format!("{what}: {}, expected at least {limit} {unit}", quantity(value, unit)));
        }
    }
}

/// Four significant digits, so that a value near its limit doesn't read like it.
fn quantity(value: f64, unit: &str) -> String {
    let digits = if value == 0.0 || !value.is_finite() { 0.0 } else { value.abs().log10().floor() };
    let decimals = (3.0 - digits).clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_near_its_limit_does_not_read_like_it() {
        assert_eq!(quantity(0.50004, "N"), "0.5000 N");
        assert_eq!(quantity(0.5004, "N"), "0.5004 N");
        assert_eq!(quantity(0.0030049, "m"), "0.003005 m");
        assert_eq!(quantity(43.21, "N"), "43.21 N");
        assert_eq!(quantity(f64::NAN, "N"), "NaN N");
    }

    #[test]
    fn axes_are_judged_by_what_they_are_to_bear() {
        use mikoshi_config::scenario::Axis;
        let limits = Thresholds { axis_reference_error_end_n: Some(0.5), ..Thresholds::default() };
        let end_mean = [19.6, 4.4, 0.0, 7.0, 0.0, 0.0];
        let rows = [InternalSummary { name: "L|R".into(), end_mean, ..InternalSummary::default() }];
        let external = [39.8, 0.0, 29.4];
        let failures = |row: &str, axis, control, reference, expected_force| {
            let axis = AxisControl { row: row.into(), axis, control, reference, expected_force };
            let mut judge = Judge::default();
            judge_axis(&mut judge, &limits, &axis, &rows, &external);
            judge.failures
        };
        assert_eq!(failures("L|R", Axis::X, Control::Force, 20.0, None), [""; 0]);
        assert_eq!(
            failures("L|R", Axis::X, Control::Force, -19.6, None),
            ["x of L|R: 19.60 N at the end, expected -19.6 N within 0.5 N"]
        );
        // A position says nothing of a force, unless somebody knows what it takes.
        assert_eq!(failures("L|R", Axis::Y, Control::Position, 0.01, None), [""; 0]);
        assert_eq!(
            failures("L|R", Axis::Y, Control::Position, 0.01, Some(5.0)),
            ["y of L|R: 4.400 N at the end, expected 5 N within 0.5 N"]
        );
        // Moments have a limit of their own, and nothing that was not observed counts as met.
        assert_eq!(failures("L|R", Axis::Roll, Control::Force, 0.0, None), [""; 0]);
        assert_eq!(failures("object", Axis::X, Control::Force, 40.0, None), [""; 0]);
        assert_eq!(failures("object", Axis::X, Control::Force, 0.0, None).len(), 1);
        let limits = Thresholds { axis_reference_error_end_nm: Some(0.5), ..Thresholds::default() };
        let yaw = AxisControl {
            row: "object".into(),
            axis: Axis::Yaw,
            control: Control::Force,
            reference: 0.0,
            expected_force: None,
        };
        let mut judge = Judge::default();
        judge_axis(&mut judge, &limits, &yaw, &rows, &external);
        assert_eq!(judge.failures.len(), 1);
    }

    #[test]
    fn every_limit_that_is_set_is_told_with_what_was_measured() {
        let limits = |limits: &[JudgedLimit]| -> Vec<String> {
            let told = |limit: &JudgedLimit| {
                format!("{}: {}, {} ({})", limit.what, limit.measured, limit.limit, limit.is_met)
            };
            limits.iter().map(told).collect()
        };
        let mut judge = Judge::default();
        judge.at_most("share", 0.02, 0.001, "");
        judge.at_most("error", 0.003, 0.008, "m");
        judge.at_least("ZMP margin of A", 0.0412, 0.025, "m");
        judge.at_most("way", f64::NAN, 1.0, "m");
        let row = InternalSummary { name: "L|R".into(), peak_n: 16.7, ..InternalSummary::default() };
        judge.internal_forces(Some(&[row]), "from 3 s on", "N", Some(20.0), |row| row.peak_n);
        judge.internal_forces(None, "at the end", "N", Some(0.3), |row| row.end_n);
        judge.internal_forces(None, "at the end", "Nm", None, |row| row.end_nm);
        assert_eq!(
            limits(&judge.limits),
            [
                "share: 0.02000, at most 0.001 (false)",
                "error: 0.003000 m, at most 0.008 m (true)",
                "ZMP margin of A: 0.04120 m, at least 0.025 m (true)",
                "way: NaN m, at most 1 m (false)",
                "internal forces from 3 s on: 16.70 N, at most 20 N (true)",
                "internal forces at the end: NaN N, at most 0.3 N (false)",
            ]
        );
        assert_eq!(judge.failures.len(), 3, "a limit is not met where there is a failure, and nowhere else");
    }

    #[test]
    fn a_job_is_done_when_hands_have_let_go_and_the_team_stands() {
        let failures = |names: &[&str]| {
            let entry = |(index, name): (usize, &&str)| ModeSummary {
                mode: (*name).to_owned(),
                start_s: index as f64,
            };
            let modes: Vec<ModeSummary> = names.iter().enumerate().map(entry).collect();
            let mut judge = Judge::default();
            judge_job(&mut judge, &modes);
            judge.failures
        };
        let whole = ["hold", "approach", "grasp", "lift", "carry", "lower", "release", "hold"];
        assert_eq!(failures(&whole), [""; 0]);
        assert_eq!(failures(&whole[..5]), ["the job is not done: the run ends in carry"]);
        assert_eq!(failures(&whole[..1]), ["the job is not done: the run ends in hold"]);
        assert_eq!(
            failures(&["hold", "approach", "grasp", "safe stop"]),
            ["the job failed: the team stopped after 3.00 s, in grasp"]
        );
        assert_eq!(failures(&[]).len(), 1);
    }

    #[test]
    fn an_object_whose_goal_nobody_knows_has_not_reached_it() {
        let limits = Thresholds { object_goal_error_max_m: Some(0.005), ..Thresholds::default() };
        let failures = |goal_error_m| {
            let mut judge = Judge::default();
            judge_rest(&mut judge, &limits, &ObjectSummary { goal_error_m, ..ObjectSummary::default() });
            judge.failures
        };
        assert_eq!(failures(Some([0.003, -0.003, 0.002])), [""; 0]);
        assert_eq!(
            failures(Some([0.004, -0.003, 0.002])),
            ["distance of the object from its goal: 0.005385 m, expected at most 0.005 m"]
        );
        assert_eq!(failures(None).len(), 1);
    }

    #[test]
    fn what_is_not_a_number_fails() {
        let mut judge = Judge::default();
        judge.at_most("a", f64::NAN, 1.0, "m");
        judge.at_least("b", f64::NAN, 1.0, "m");
        let rows = [("r1", 0.4), ("r2", f64::NAN), ("r3", 0.6)].map(|(name, end_n)| InternalSummary {
            name: name.into(),
            end_n,
            ..InternalSummary::default()
        });
        judge.internal_forces(Some(&rows), "at the end", "N", Some(0.5), |row| row.end_n);
        judge.internal_forces(None, "at the end", "N", Some(0.5), |row| row.end_n);
        assert_eq!(
            judge.failures,
            [
                "a: NaN m, expected at most 1 m",
                "b: NaN m, expected at least 1 m",
                "2 of 3 internal forces at the end: up to NaN N (r2), expected at most 0.5 N",
                "internal forces at the end: the run ends before, expected at most 0.5 N"
            ]
        );
    }
}
