//! What a run came to, for people.

use crate::judge::is_judged_after_3s;
use crate::table;
use core::fmt::Write as _;
use mikoshi_config::Scenario;
use mikoshi_observation::{InternalSummary, LoadSummary, ObjectSummary, RobotSummary, Summary};
use std::path::Path;

/// What the paper's fig. 14 shows of its simulation of section 4.3, read off the plots: components start
/// at up to 40 N and 20 Nm, and all converge to zero.
const PAPER: [&str; 7] = ["paper, fig. 14", "≤ 40", "≤ 20", "→ 0", "→ 0", "0", "0"];

/// The whole report.
pub fn report(scenario: &Scenario, summary: &Summary, out: &Path) -> String {
    let mut text = String::new();
    // Writing to a string can't fail.
    let _ = writeln!(
        text,
        "{}, seed {}: {} s simulated in {:.2} s, {:.1} × real time",
        summary.scenario, summary.seed, summary.sim_time_s, summary.wall_time_s, summary.real_time_factor
    );
    text += "\nInternal forces, true and unfiltered\n";
    text += &internal_table(scenario, summary);
    let _ = writeln!(
        text,
        "measured against true, last second: within {:.2} N, {:.2} Nm",
        summary.internal_measurement_error_n, summary.internal_measurement_error_nm
    );
    text += "\nObject against its reference\n";
    text += &object_table(&summary.object);
    if summary.load.mass_kg > 0.0 {
        text += &load_line(&summary.load);
    }
    text += "\nRobots\n";
    text += &robots_table(&summary.robots);
    text.push('\n');
    if summary.timing.tick_p50_s > 0.0 {
        let timing = &summary.timing;
        let _ = writeln!(
            text,
            "a tick takes {:.2} ms, {:.2} ms in 1 of 100",
            1e3 * timing.tick_p50_s,
            1e3 * timing.tick_p99_s
        );
    }
    let _ = writeln!(text, "log hash {}", summary.log_hash);
    let _ = writeln!(text, "results in {}", out.display());
    if summary.passed {
        text += "passed\n";
    } else {
        text += "NOT passed:\n";
        for failure in &summary.failures {
            let _ = writeln!(text, "  {failure}");
        }
    }
    text
}

fn internal_table(scenario: &Scenario, summary: &Summary) -> String {
    let titles = ["internal force", "start N", "Nm", "3 s after N", "Nm", "end N", "Nm", "peak N", "Nm"];
    let is_judged_after_3s = is_judged_after_3s(scenario, summary);
    let cells = |row: &InternalSummary| {
        let figures = [
            (row.start_n, row.start_nm, true),
            (row.after_3s_n, row.after_3s_nm, is_judged_after_3s),
            (row.end_n, row.end_nm, true),
            (row.peak_n, row.peak_nm, true),
        ];
        let numbers = figures.into_iter().flat_map(|(n, nm, is_known)| {
            [n, nm].map(|value| if is_known { format!("{value:.2}") } else { "-".to_owned() })
        });
        core::iter::once(row.name.clone()).chain(numbers).collect()
    };
    // The paper's forces were all brought to zero.
    let is_as_in_paper = scenario.hybrid.start_s.is_some() && scenario.hybrid.axes.is_empty();
    let paper = is_as_in_paper.then(|| PAPER.map(str::to_owned).to_vec());
    table::of_numbers(&titles, summary.internal.iter().map(cells).chain(paper))
}

fn object_table(object: &ObjectSummary) -> String {
    let row = |name: &str, position_m: [f64; 3], attitude_rad: [f64; 3]| {
        let millis = |value: f64| format!("{:.2}", 1e3 * value);
        let numbers = position_m.into_iter().chain(attitude_rad).map(millis);
        core::iter::once(name.to_owned()).chain(numbers).collect()
    };
    table::of_numbers(
        &["error", "x mm", "y", "z", "roll mrad", "pitch", "yaw"],
        [
            row("RMS", object.position_rms_m, object.attitude_rms_rad),
            row("peak", object.position_peak_m, object.attitude_peak_rad),
        ],
    )
}

/// What is carried, as far as the team knows it.
fn load_line(load: &LoadSummary) -> String {
    let [x, y, z] = load.com_m.map(|part| 1e3 * part);
    let [dx, dy, dz] = load.com_std_m.map(|part| 1e3 * part);
    format!(
        "load by the hands: {:.2} ± {:.2} kg since {:.1} s, centre of mass at {x:.0} ± {dx:.0}, {y:.0} ± {dy:.0}, \
         {z:.0} ± {dz:.0} mm\n",
        load.mass_kg, load.mass_std_kg, load.mass_stays_since_s
    )
}

fn robots_table(robots: &[RobotSummary]) -> String {
    let cells = |robot: &RobotSummary| {
        let (drive, share) = most_loaded_drive(robot);
        vec![
            robot.name.clone(),
            format!("{:.1}", 1e3 * robot.foot_slip_max_m),
            format!("{:.1}", 1e3 * robot.zmp_margin_min_m),
            format!("{:.2}", robot.tilt_max_rad.to_degrees()),
            format!("{:.1} ({})", robot.joint_margin_min_rad.to_degrees(), robot.joint_margin_joint),
            format!("{:.0} % ({drive})", 100.0 * share),
            robot.saturated_ticks.to_string(),
        ]
    };
    table::of_numbers(
        &["robot", "slip mm", "ZMP margin mm", "tilt deg", "joint margin deg", "torque", "saturated ticks"],
        robots.iter().map(cells),
    )
}

/// The drive that came nearest to its torque limit, and how near.
fn most_loaded_drive(robot: &RobotSummary) -> (&str, f64) {
    let share = |(name, peak): (&'_ String, &f64)| {
        let limit = robot.torque_limit_nm.get(name).copied().unwrap_or(f64::INFINITY);
        peak / limit
    };
    let drives = robot.torque_peak_nm.iter().map(|drive| (drive.0.as_str(), share(drive)));
    drives.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(("", 0.0))
}
