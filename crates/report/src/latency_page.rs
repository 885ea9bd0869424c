//! The page of a latency measurement: how the times of a tick's parts are distributed, and what ran when in the
//! worst ticks.

use crate::error::WriteReportError;
use crate::html::{figure, list, page, table};
use crate::scene::{Axis, Figure, LegendEntry, Mark, Panel, Stroke};
use crate::style;
use crate::write::{write_figure, write_file};
use std::path::{Path, PathBuf};

const PANEL_HEIGHT_PX: u32 = 520;
/// Decades of time that the plot of tails shows, in microseconds.
const DECADES: core::ops::Range<f64> = -1.5..5.0;
/// Room for names left of what happened, as a share of the tick.
const NAMES: f64 = 0.25;
/// How rare the rarest share is that it shows.
const RAREST: f64 = -5.0;

/// Name of a part of a tick, and which share of all took longer than so many µs.
pub type Tail = (String, Vec<(f64, f64)>);

/// A measurement, as it is shown.
#[derive(Clone, Debug)]
pub struct LatencyReport {
    /// Of what.
    pub title: String,
    /// How it was taken, and what it found, a sentence each.
    pub findings: Vec<String>,
    /// Times that frames take between services.
    pub hops: Vec<Tail>,
    /// The same of what services do, and of the whole.
    pub parts: Vec<Tail>,
    /// Each with a heading, column titles and rows.
    pub tables: Vec<LatencyTable>,
    /// The worst ticks.
    pub worst: Vec<TickTimeline>,
}

/// A table of the page.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub struct LatencyTable {
    pub heading: String,
    pub titles: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// What ran when in one tick.
#[derive(Clone, Debug)]
pub struct TickTimeline {
    /// Which tick, and what is wrong with it.
    pub title: String,
    /// Name of a phase; from when to when it computed, and when it published \[µs\].
    pub phases: Vec<(String, f64, f64, f64)>,
}

/// Writes `hops`, `parts` and `worst`, each as `.svg` and `.png`, and `index.html` with all of them into the folder
/// `out`, which is there; returns the page's path.
///
/// # Errors
/// A figure that can't be drawn; a file that can't be written.
pub fn write_latency(report: &LatencyReport, out: &Path) -> Result<PathBuf, WriteReportError> {
    let mut html = list(&report.findings);
    html += &drawn(&tails("Frames on their way", &report.title, &report.hops), out, "hops")?;
    html += &drawn(&tails("Services, and the whole", &report.title, &report.parts), out, "parts")?;
    if !report.worst.is_empty() {
        html += &drawn(&timelines(report), out, "worst")?;
    }
    html += "<section>\n";
    for LatencyTable { heading, titles, rows } in &report.tables {
        html += &format!("<h2>{}</h2>\n", crate::html::escaped(heading));
        html += &table(&titles.iter().map(String::as_str).collect::<Vec<_>>(), rows.iter().cloned());
    }
    html += "</section>\n";
    write_file(out, "index.html", page(&report.title, &html).as_bytes())
}

fn drawn(scene: &Figure, out: &Path, name: &str) -> Result<String, WriteReportError> {
    let svg = write_figure(scene, out, name)?;
    Ok(figure(name, &format!("{}.", scene.title), &scene.caption, &svg))
}

/// Names stand beside colours, which repeat: those of the second round are dashed.
fn stroke(index: usize) -> Stroke {
    let is_dashed = index >= style::PALETTE.len();
    Stroke { is_dashed, ..Stroke::solid(style::colour(index)) }
}

fn tails(title: &str, subtitle: &str, tails: &[Tail]) -> Figure {
    let legend = tails.iter().enumerate().map(|(index, (name, _))| LegendEntry::line(name, stroke(index)));
    let mark = |(index, (_, tail)): (usize, &Tail)| {
        let decade = |value: f64, least: f64| value.max(10_f64.powf(least)).log10();
        let points = tail.iter().map(|&(us, share)| (decade(us, DECADES.start), decade(share, RAREST)));
        Mark::Path { points: points.collect(), stroke: stroke(index) }
    };
    Figure {
        title: title.to_owned(),
        subtitle: subtitle.to_owned(),
        caption:
            "Share of all ticks in which it took longer, over the time, both by their decades: a line that \
                  falls steeply is a part that always takes as long."
                .to_owned(),
        legend: legend.collect(),
        columns: 1,
        panels: vec![Panel {
            title: String::new(),
            note: String::new(),
            x: Axis { label: "log10 of the time [µs]".to_owned(), range: DECADES },
            y: Axis { label: "log10 of the share that took longer".to_owned(), range: RAREST..0.0 },
            marks: tails.iter().enumerate().map(mark).collect(),
        }],
        panel_height_px: PANEL_HEIGHT_PX,
        has_equal_scales: false,
    }
}

fn timelines(report: &LatencyReport) -> Figure {
    let (computes, publishes) = (style::colour(0), style::colour(1));
    Figure {
        title: "The worst ticks".to_owned(),
        subtitle: report.title.clone(),
        caption:
            "From when a service had heard what it waited for until it had kept what came of that, and until \
                  it had published it. What lies between is waiting: for the others, or for a processor."
                .to_owned(),
        legend: vec![LegendEntry::patch("computes", computes), LegendEntry::patch("publishes", publishes)],
        columns: 2,
        panels: report.worst.iter().map(|tick| timeline(tick, computes, publishes)).collect(),
        panel_height_px: PANEL_HEIGHT_PX / 2,
        has_equal_scales: false,
    }
}

fn timeline(
    tick: &TickTimeline,
    computes: plotters::style::RGBColor,
    publishes: plotters::style::RGBColor,
) -> Panel {
    let end = tick.phases.iter().map(|(.., published_us)| *published_us).fold(1.0, f64::max);
    let rows = tick.phases.len() as f64;
    let mut marks = vec![];
    for (index, (name, heard_us, kept_us, published_us)) in tick.phases.iter().enumerate() {
        let (top, bottom) = (rows - index as f64 - 0.2, rows - index as f64 - 0.8);
        let mut bar = |from: f64, to: f64, colour| {
            // What takes no time is still to be seen.
            let to = to.max(from + 2e-3 * end);
            marks.push(Mark::Outline {
                corners: vec![(from, bottom), (to, bottom), (to, top), (from, top)],
                fill: Some(colour),
                stroke: Stroke::thin(colour),
            });
        };
        bar(*heard_us, *kept_us, computes);
        bar(*kept_us, *published_us, publishes);
        let at = (-0.5 * NAMES * end, 0.5 * (top + bottom));
        marks.push(Mark::Label { at, text: name.clone(), colour: style::FAINT_INK });
    }
    Panel {
        title: tick.title.clone(),
        note: String::new(),
        x: Axis { label: "since its sensors [µs]".to_owned(), range: -NAMES * end..1.02 * end },
        y: Axis { label: String::new(), range: 0.0..rows },
        marks,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> LatencyReport {
        let tail =
            |scale: f64| (0..40).map(|k| (scale * 1.1_f64.powi(k), 0.8_f64.powi(k))).collect::<Vec<_>>();
        LatencyReport {
            title: "hold: two robots".to_owned(),
            findings: vec!["measured in 4000 ticks".to_owned()],
            hops: vec![("bridge to servo".to_owned(), tail(1.0)), ("servo to bridge".to_owned(), tail(3.0))],
            parts: vec![("tick".to_owned(), tail(50.0))],
            tables: vec![LatencyTable {
                heading: "Times".to_owned(),
                titles: vec!["part".to_owned(), "p50".to_owned()],
                rows: vec![vec!["<tick>".to_owned(), "50.0".to_owned()]],
            }],
            worst: vec![TickTimeline {
                title: "tick 7".to_owned(),
                phases: vec![("servo A senses".to_owned(), 1.0, 20.0, 22.0)],
            }],
        }
    }

    #[test]
    fn the_page_has_both_figures_and_all_tables() {
        let out = tempfile::tempdir().expect("a folder");
        let path = write_latency(&report(), out.path()).expect("it is written");
        let html = std::fs::read_to_string(path).expect("it is there");
        for text in ["measured in 4000 ticks", "bridge to servo", "tick 7", "servo A senses", "&lt;tick&gt;"]
        {
            assert!(html.contains(text), "no {text:?}");
        }
        for file in ["hops.svg", "hops.png", "parts.svg", "parts.png", "worst.svg", "worst.png"] {
            assert!(out.path().join(file).exists(), "no {file}");
        }
    }

    #[test]
    fn tails_fall_by_decades() {
        let figure = tails("", "", &report().hops);
        let Mark::Path { points, .. } = &figure.panels[0].marks[0] else { panic!("a path") };
        assert_eq!(points[0], (0.0, 0.0));
        assert!(points.windows(2).all(|pair| pair[1].0 > pair[0].0 && pair[1].1 < pair[0].1));
        assert_eq!((figure.panels[0].marks.len(), figure.legend.len()), (2, 2));
    }
}
