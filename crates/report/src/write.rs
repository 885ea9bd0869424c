//! The files of a report.

use crate::error::WriteReportError;
use crate::figures::{self, Runs};
use crate::page;
use crate::render;
use crate::run_data::RunData;
use crate::scene::Figure;
use mikoshi_observation::Summary;
use std::fs;
use std::path::{Path, PathBuf};

/// A run to be reported.
#[derive(Clone, Debug)]
pub struct ReportedRun {
    /// What it is called where two runs are compared.
    pub label: String,
    /// What it came to.
    pub summary: Summary,
    /// Its course.
    pub data: RunData,
    /// What it was judged by.
    pub limits: Vec<JudgedLimit>,
    /// Why the course ends before the run does, if its log is cut.
    pub damage: Option<String>,
}

/// A threshold of a run's scenario, and what was measured. In words, with units.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JudgedLimit {
    /// What was judged.
    pub what: String,
    /// What it came to.
    pub measured: String,
    /// What was asked for.
    pub limit: String,
    /// Whether it is met.
    pub is_met: bool,
}

/// Writes every figure that one run, or two laid over each other, have data for, and a page with them;
/// returns the page's path. The folder is made if it is not there.
///
/// # Errors
/// A figure that can't be drawn; a file that can't be written.
pub fn write_report(runs: &[ReportedRun], out: &Path) -> Result<PathBuf, WriteReportError> {
    let (figures, left_out) = figures::all(&Runs(runs));
    fs::create_dir_all(out).map_err(|source| WriteReportError::Io { path: out.to_owned(), source })?;
    let mut drawn = Vec::with_capacity(figures.len());
    for (number, figure) in figures {
        let svg = write_figure(&figure, out, &format!("figure-{number}"))?;
        drawn.push((number, figure, svg));
    }
    write_file(out, "index.html", page::html(runs, &drawn, &left_out).as_bytes())
}

/// Writes `NAME.svg` and `NAME.png` into the folder `out`, which is there; returns the SVG.
pub(crate) fn write_figure(figure: &Figure, out: &Path, name: &str) -> Result<String, WriteReportError> {
    let draw_error = |problem| WriteReportError::Draw { figure: name.to_owned(), problem };
    let svg = render::svg(figure).map_err(draw_error)?;
    write_file(out, &format!("{name}.svg"), svg.as_bytes())?;
    write_file(out, &format!("{name}.png"), &render::png(figure).map_err(draw_error)?)?;
    Ok(svg)
}

/// Writes a file into the folder `out`, which is there; returns its path.
pub(crate) fn write_file(out: &Path, name: &str, bytes: &[u8]) -> Result<PathBuf, WriteReportError> {
    let path = out.join(name);
    match fs::write(&path, bytes) {
        Ok(()) => Ok(path),
        Err(source) => Err(WriteReportError::Io { path, source }),
    }
}
