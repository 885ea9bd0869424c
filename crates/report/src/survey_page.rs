//! The files of a survey: one figure with a row for each of its sweeps, and one page with it.

use crate::error::WriteReportError;
use crate::html::{escaped, list, page, table};
use crate::sweep::{self, SweepFigure};
use crate::sweep_page::{SweepFailure, drawn};
use crate::write::write_file;
use core::fmt::Write as _;
use std::path::{Path, PathBuf};

/// What a survey came to.
#[derive(Clone, Debug)]
pub struct SurveyReport {
    /// Its name.
    pub name: String,
    /// What it shows, in a sentence.
    pub description: String,
    /// Whether it passed.
    pub passed: bool,
    /// That in words.
    pub verdict: String,
    /// Titles of the columns that tell of each sweep.
    pub columns: Vec<String>,
    /// Its sweeps, each of which has a page of its own in a folder of its name.
    pub sweeps: Vec<SurveyedSweep>,
}

/// One sweep of a survey.
#[derive(Clone, Debug)]
pub struct SurveyedSweep {
    /// Its name.
    pub name: String,
    /// What is told of it, by [`SurveyReport::columns`].
    pub cells: Vec<String>,
    /// Its runs; the first parameter is drawn.
    pub overview: SweepFigure,
    /// Runs that did not meet their thresholds.
    pub failures: Vec<SweepFailure>,
}

/// Writes `survey.svg` and `.png`, and `index.html` with all of it into the folder `out`, which is there; returns the
/// page's path.
///
/// # Errors
/// A figure that can't be drawn; a file that can't be written.
pub fn write_survey(report: &SurveyReport, out: &Path) -> Result<PathBuf, WriteReportError> {
    let class = if report.passed { "passed" } else { "failed" };
    let mut html = format!("<p>{}.</p>\n", escaped(&report.description));
    // Writing to a string can't fail.
    let _ = writeln!(html, "<p class=\"{class}\">{}</p>", escaped(&report.verdict));
    let rows: Vec<_> = report.sweeps.iter().map(|sweep| &sweep.overview).collect();
    if let Some(scene) = sweep::figure_of_many(&report.name, &report.verdict, &rows) {
        html += &drawn(&scene, out, "survey")?;
    }
    html += "<section>\n";
    let titles: Vec<_> = report.columns.iter().map(String::as_str).collect();
    html += &table(&titles, report.sweeps.iter().map(|sweep| sweep.cells.clone()));
    for sweep in &report.sweeps {
        let name = escaped(&sweep.name);
        let _ = writeln!(html, "<h2><a href=\"{name}/index.html\">{name}</a></h2>");
        if sweep.failures.is_empty() {
            html += "<p>All runs succeeded.</p>\n";
        }
        for SweepFailure { run, causes } in &sweep.failures {
            let _ = writeln!(html, "<h3>{}</h3>\n{}", escaped(run), list(causes));
        }
    }
    html += "</section>\n";
    write_file(out, "index.html", page(&report.name, &html).as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn report() -> SurveyReport {
        let sweep = |name: &str, failures: Vec<SweepFailure>| SurveyedSweep {
            name: name.to_owned(),
            cells: vec![name.to_owned(), "3 of 4".to_owned()],
            overview: sweep::tests::sweep(),
            failures,
        };
        let fell = SweepFailure { run: "run 2".to_owned(), causes: vec!["robot <B> fell".to_owned()] };
        SurveyReport {
            name: "many".to_owned(),
            description: "Several sweeps".to_owned(),
            passed: false,
            verdict: "NOT passed: 6 of 8".to_owned(),
            columns: vec!["sweep".to_owned(), "succeeded".to_owned()],
            sweeps: vec![sweep("heavy", vec![fell]), sweep("fast", vec![])],
        }
    }

    #[test]
    fn a_survey_is_drawn_with_a_row_for_each_sweep_and_its_page_leads_to_theirs() {
        let out = tempfile::tempdir().expect("a folder");
        let path = write_survey(&report(), out.path()).expect("it can be drawn");
        let png = fs::read(out.path().join("survey.png")).expect("it was written");
        assert!(png.starts_with(b"\x89PNG"));
        let html = fs::read_to_string(path).expect("it was written");
        let options = roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
        roxmltree::Document::parse_with_options(&html, options).expect("it is well-formed");
        for text in ["heavy/index.html", "fast/index.html", "robot &lt;B&gt; fell", "All runs succeeded"] {
            assert!(html.contains(text), "no {text:?}");
        }
    }
}
