//! A measurement as a page.

use super::result::{COST_TITLES, LatencyResult, MACHINE_TITLES, TIME_TITLES, us};
use mikoshi_observation::{PhaseTimes, Span, SpanSummary, WorstTick};
use mikoshi_report::{LatencyReport, LatencyTable, Tail, TickTimeline};

/// Worst ticks that are drawn.
const DRAWN: usize = 4;

/// What the page shows.
pub fn page_of(result: &LatencyResult) -> LatencyReport {
    let (hops, parts): (Vec<_>, Vec<_>) = result.spans.iter().partition(|summary| is_hop(summary.span));
    let tails = |spans: Vec<&SpanSummary>| spans.into_iter().map(tail_of).collect();
    LatencyReport {
        title: result.title(),
        findings: result.findings(),
        hops: tails(hops),
        parts: tails(parts),
        tables: vec![
            table("Times [µs]", &TIME_TITLES, result.time_rows()),
            table(
                "The machine: how late it wakes up who sleeps [µs]",
                &MACHINE_TITLES,
                result.machine_rows(),
            ),
            table("What services ask the system for, per tick", &COST_TITLES, result.cost_rows()),
        ],
        worst: result.worst.iter().take(DRAWN).map(timeline).collect(),
    }
}

fn is_hop(span: Span) -> bool {
    matches!(
        span,
        Span::BridgeToServo | Span::ServoToCoordinator | Span::CoordinatorToServo | Span::ServoToBridge
    )
}

fn tail_of(summary: &SpanSummary) -> Tail {
    let points = summary.tail.iter().map(|&(ns, share)| (ns as f64 * 1e-3, share));
    // The figures' type has no arrow.
    (summary.span.to_string().replace('→', "to"), points.collect())
}

fn table(heading: &str, titles: &[&str], rows: Vec<Vec<String>>) -> LatencyTable {
    let titles = titles.iter().map(|title| (*title).to_owned()).collect();
    LatencyTable { heading: heading.to_owned(), titles, rows }
}

fn timeline(worst: &WorstTick) -> TickTimeline {
    let phase = |phase: &PhaseTimes| {
        let of_robot = phase.robot.map_or_else(String::new, |robot| format!(" {}", robot + 1));
        let at = |ns: i64| ns as f64 * 1e-3;
        (format!("{}{of_robot}", phase.service), at(phase.heard_ns), at(phase.kept_ns), at(phase.said_ns))
    };
    TickTimeline {
        title: format!("tick {}, {} µs", worst.tick, us(worst.took_ns)),
        phases: worst.phases.iter().map(phase).collect(),
    }
}
