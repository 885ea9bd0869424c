//! One HTML page with all of a report: it needs no other file.

use crate::figures::LeftOut;
use crate::html::{escaped, figure, page, table};
use crate::scene::Figure;
use crate::write::{JudgedLimit, ReportedRun};
use core::fmt::Write as _;
use mikoshi_observation::{InternalSummary, MinuteSummary, ObjectSummary, RobotSummary, Summary};

/// The page. Every figure comes with its number and its SVG.
pub fn html(runs: &[ReportedRun], figures: &[(u32, Figure, String)], left_out: &[LeftOut]) -> String {
    let title = match runs {
        [run] => run.data.title(),
        runs => runs.iter().map(|run| run.label.as_str()).collect::<Vec<_>>().join(" and "),
    };
    let mut html = "<div class=\"runs\">\n".to_owned();
    for run in runs {
        html += &section(run, runs.len() > 1);
    }
    html += "</div>\n";
    for (number, drawn, svg) in figures {
        html += &figure(&format!("figure-{number}"), &format!("Figure {number}."), &drawn.caption, svg);
    }
    if !left_out.is_empty() {
        html += "<h2>Figures left out</h2>\n<ul>\n";
        for LeftOut { number, reason } in left_out {
            // Writing to a string can't fail.
            let _ = writeln!(html, "<li>Figure {number}: {}.</li>", escaped(reason));
        }
        html += "</ul>\n";
    }
    page(&title, &html)
}

fn section(run: &ReportedRun, is_one_of_two: bool) -> String {
    let summary = &run.summary;
    let mut html = "<section>\n".to_owned();
    if is_one_of_two {
        let _ = writeln!(html, "<h2>{}</h2>\n<p>{}</p>", escaped(&run.label), escaped(&run.data.title()));
    }
    html += &verdict(summary);
    if let Some(damage) = &run.damage {
        let end = run.data.end_s();
        let _ = writeln!(
            html,
            "<p class=\"failed\">The log is cut or damaged, so the figures end after {end:.2} s: {}.</p>",
            escaped(damage)
        );
    }
    html += &facts(summary);
    html += "<div class=\"tables\">\n";
    for (title, content) in [
        ("Internal forces", internal_table(&summary.internal)),
        ("Object against its reference", object_table(&summary.object)),
        ("Robots", robots_table(summary)),
        ("Minute by minute", minutes_table(&summary.minutes)),
        ("Thresholds", limits_table(&run.limits)),
    ] {
        let _ = write!(html, "<div>\n<h3>{title}</h3>\n{content}</div>\n");
    }
    html += "</div>\n</section>\n";
    html
}

fn limits_table(limits: &[JudgedLimit]) -> String {
    if limits.is_empty() {
        return "<p>The scenario sets none.</p>\n".to_owned();
    }
    let cells = |limit: &JudgedLimit| {
        let measured = if limit.is_met { limit.measured.clone() } else { format!("{} ✗", limit.measured) };
        vec![limit.what.clone(), measured, limit.limit.clone()]
    };
    table(&["threshold", "measured", "asked for"], limits.iter().map(cells))
}

fn verdict(summary: &Summary) -> String {
    if summary.passed {
        return "<p class=\"passed\">Passed: every threshold is met.</p>\n".to_owned();
    }
    let mut html = "<p class=\"failed\">Not passed:</p>\n<ul class=\"failed\">\n".to_owned();
    for failure in &summary.failures {
        let _ = writeln!(html, "<li>{}</li>", escaped(failure));
    }
    for fault in &summary.faults {
        let of = fault.robot.as_ref().map(|robot| format!(" of {robot}")).unwrap_or_default();
        let what = format!("{}{of} in tick {}: {}", fault.service, fault.tick, fault.code);
        let _ = writeln!(html, "<li>{}</li>", escaped(&what));
    }
    html += "</ul>\n";
    html
}

fn facts(summary: &Summary) -> String {
    let mut rows = vec![
        (
            "simulated",
            format!("{:.2} s, {} ticks of {} s", summary.sim_time_s, summary.ticks, summary.control_period_s),
        ),
        ("took", format!("{:.2} s, {:.1} × real time", summary.wall_time_s, summary.real_time_factor)),
        (
            "forces measured against true, last second",
            format!(
                "within {:.2} N, {:.2} Nm",
                summary.internal_measurement_error_n, summary.internal_measurement_error_nm
            ),
        ),
        ("drift between robots", format!("{:.1} mm", 1e3 * summary.drift_between_robots_m)),
        ("ticks with unintended contact", summary.unintended_contact_ticks.to_string()),
    ];
    if !summary.fell.is_empty() {
        rows.push(("fell", summary.fell.join(", ")));
    }
    if !summary.swaps.is_empty() {
        rows.push(("processes replaced", summary.swaps.len().to_string()));
    }
    rows.push(("log hash", summary.log_hash.clone()));
    let mut html = "<table class=\"facts\">\n".to_owned();
    for (name, value) in rows {
        let _ = writeln!(html, "<tr><th>{}</th><td>{}</td></tr>", escaped(name), escaped(&value));
    }
    html += "</table>\n";
    html
}

fn internal_table(rows: &[InternalSummary]) -> String {
    let titles = ["force", "start N", "Nm", "after 3 s N", "Nm", "end N", "Nm", "peak N", "Nm"];
    table(
        &titles,
        rows.iter().map(|row| {
            let numbers = [
                row.start_n,
                row.start_nm,
                row.after_3s_n,
                row.after_3s_nm,
                row.end_n,
                row.end_nm,
                row.peak_n,
                row.peak_nm,
            ];
            core::iter::once(row.name.clone()).chain(numbers.map(|number| format!("{number:.2}"))).collect()
        }),
    )
}

fn object_table(object: &ObjectSummary) -> String {
    let milli = |values: [f64; 3]| values.map(|value| format!("{:.2}", 1e3 * value));
    let row = |name: &str, position_m, attitude_rad| -> Vec<String> {
        core::iter::once(name.to_owned()).chain(milli(position_m)).chain(milli(attitude_rad)).collect()
    };
    let mut html = table(
        &["error", "x mm", "y", "z", "roll mrad", "pitch", "yaw"],
        [
            row("RMS", object.position_rms_m, object.attitude_rms_rad),
            row("peak", object.position_peak_m, object.attitude_peak_rad),
        ],
    );
    let [x, y, z] = object.travel_m.map(|value| format!("{value:.3}"));
    let [roll, pitch, yaw] = object.travel_rad.map(|value| format!("{value:.3}"));
    let _ = writeln!(
        html,
        "<p>It travelled by ({x}, {y}, {z}) m and turned by ({roll}, {pitch}, {yaw}) rad.</p>"
    );
    html
}

fn minutes_table(minutes: &[MinuteSummary]) -> String {
    let titles = [
        "from s",
        "object RMS mm",
        "peak",
        "internal mean N",
        "peak",
        "ZMP margin mm",
        "odometries apart mm",
        "mrad",
        "as the team sees it mm",
        "mrad",
    ];
    let milli = |value: f64| format!("{:.2}", 1e3 * value);
    let cells = |minute: &MinuteSummary| {
        vec![
            format!("{:.0}", minute.start_s),
            milli(minute.object_rms_m),
            milli(minute.object_peak_m),
            format!("{:.2}", minute.internal_mean_n),
            format!("{:.2}", minute.internal_peak_n),
            milli(minute.zmp_margin_min_m),
            milli(minute.odometry_apart_m),
            milli(minute.odometry_apart_rad),
            milli(minute.frames_apart_m),
            milli(minute.frames_apart_rad),
        ]
    };
    table(&titles, minutes.iter().map(cells))
}

fn robots_table(summary: &Summary) -> String {
    let titles = [
        "robot",
        "ZMP mm",
        "slip mm",
        "tilt °",
        "steps",
        "walked m",
        "drift mm",
        "joint °",
        "torque",
        "saturated",
    ];
    let cells = |robot: &RobotSummary| {
        let share = |(joint, peak): (&String, &f64)| {
            robot.torque_limit_nm.get(joint).map_or(0.0, |limit| 100.0 * peak / limit)
        };
        let torque = robot.torque_peak_nm.iter().map(share).fold(0.0, f64::max);
        vec![
            robot.name.clone(),
            format!("{:.1}", 1e3 * robot.zmp_margin_min_m),
            format!("{:.1}", 1e3 * robot.foot_slip_max_m),
            format!("{:.2}", robot.tilt_max_rad.to_degrees()),
            robot.steps.to_string(),
            format!("{:.2}", robot.walked_m),
            format!("{:.1}", 1e3 * robot.drift_m),
            format!("{:.1}", robot.joint_margin_min_rad.to_degrees()),
            format!("{torque:.0} %"),
            robot.saturated_ticks.to_string(),
        ]
    };
    let mut html = table(&titles, summary.robots.iter().map(cells));
    html += "<p>ZMP and joint: smallest margins; torque: largest share of a limit; saturated: ticks.</p>\n";
    html
}
