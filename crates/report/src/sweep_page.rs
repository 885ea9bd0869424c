//! The files of a sweep: its figures, and one page with them.

use crate::comparison::ComparedRuns;
use crate::error::WriteReportError;
use crate::html::{escaped, figure, list, page, table};
use crate::sweep::{self, SweepFigure};
use crate::write::{write_figure, write_file};
use core::fmt::Write as _;
use std::path::{Path, PathBuf};

/// What a sweep came to.
#[derive(Clone, Debug)]
pub struct SweepReport {
    /// Its name.
    pub name: String,
    /// What it shows, in a sentence.
    pub description: String,
    /// Whether it passed.
    pub passed: bool,
    /// That in words.
    pub verdict: String,
    /// Every figure's name, median and worst value.
    pub figures: Vec<[String; 3]>,
    /// Runs that did not meet their thresholds.
    pub failures: Vec<SweepFailure>,
    /// All runs over what they vary in.
    pub overview: SweepFigure,
    /// The runs beside a prediction, where they are compared with one.
    pub comparison: Option<ComparedRuns>,
}

/// A run that failed.
#[derive(Clone, Debug)]
pub struct SweepFailure {
    /// Which.
    pub run: String,
    /// Why.
    pub causes: Vec<String>,
}

/// Writes `sweep.svg` and `.png`, where runs are compared `comparison.svg` and `.png` too, and `index.html`
/// with all of it into the folder `out`, which is there; returns the page's path.
///
/// # Errors
/// A figure that can't be drawn; a file that can't be written.
pub fn write_sweep(report: &SweepReport, out: &Path) -> Result<PathBuf, WriteReportError> {
    let class = if report.passed { "passed" } else { "failed" };
    let mut html = format!("<p>{}.</p>\n", escaped(&report.description));
    // Writing to a string can't fail.
    let _ = writeln!(html, "<p class=\"{class}\">{}</p>", escaped(&report.verdict));
    if let Some(comparison) = &report.comparison {
        html += &list(&comparison.findings());
        html += &drawn(&comparison.figure(), out, "comparison")?;
    }
    html += &drawn(&sweep::figure(&report.overview), out, "sweep")?;
    html += "<section>\n";
    html += &table(&["figure", "median", "worst"], report.figures.iter().map(|row| row.to_vec()));
    if !report.failures.is_empty() {
        html += "<h2>Runs that failed their thresholds</h2>\n";
    }
    for SweepFailure { run, causes } in &report.failures {
        let _ = writeln!(html, "<h3>{}</h3>\n{}", escaped(run), list(causes));
    }
    html += "</section>\n";
    write_file(out, "index.html", page(&report.name, &html).as_bytes())
}

/// Draws a figure into files, and for a page.
pub(crate) fn drawn(
    scene: &crate::scene::Figure,
    out: &Path,
    name: &str,
) -> Result<String, WriteReportError> {
    let svg = write_figure(scene, out, name)?;
    Ok(figure(name, &format!("{}.", scene.title), &scene.caption, &svg))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::{EdgeTime, TimeToEdge};
    use std::fs;

    fn report() -> SweepReport {
        let run =
            EdgeTime { velocity_m_s: 0.1, stiffness_n_m: 870.0, predicted_s: 0.93, measured_s: Some(0.95) };
        SweepReport {
            name: "pulls".to_owned(),
            description: "Pulls at <several> velocities".to_owned(),
            passed: true,
            verdict: "Passed: 1 of 4".to_owned(),
            figures: vec![["ZMP margin mm".to_owned(), "3.00".to_owned(), "−1.00".to_owned()]],
            failures: vec![SweepFailure { run: "run 2".to_owned(), causes: vec!["robot B fell".to_owned()] }],
            overview: crate::sweep::tests::sweep(),
            comparison: Some(ComparedRuns::TimeToEdge(TimeToEdge { within: 0.2, runs: vec![run] })),
        }
    }

    #[test]
    fn a_sweep_is_drawn_as_svg_and_as_png_and_its_page_says_what_was_found() {
        let out = tempfile::tempdir().expect("a folder");
        let path = write_sweep(&report(), out.path()).expect("it can be drawn");
        for name in ["sweep", "comparison"] {
            let svg = fs::read_to_string(out.path().join(format!("{name}.svg"))).expect("it was written");
            assert!(svg.contains("<circle"), "{name}");
            let png = fs::read(out.path().join(format!("{name}.png"))).expect("it was written");
            assert!(png.starts_with(b"\x89PNG"), "{name}");
        }
        let html = fs::read_to_string(path).expect("it was written");
        let options = roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
        roxmltree::Document::parse_with_options(&html, options).expect("it is well-formed");
        for text in
            ["&lt;several&gt;", "1 of 1 run agree with eq. 42 within 20 %", "robot B fell", "comparison.png"]
        {
            assert!(html.contains(text), "no {text:?}");
        }
    }

    #[test]
    fn a_sweep_that_is_compared_with_nothing_has_no_second_figure() {
        let out = tempfile::tempdir().expect("a folder");
        write_sweep(&SweepReport { comparison: None, ..report() }, out.path()).expect("it can be drawn");
        assert!(!out.path().join("comparison.svg").exists());
    }
}
