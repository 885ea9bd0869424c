//! The files of a report.

use crate::error::WriteReportError;
use crate::figures::{self, Runs};
use crate::page;
use crate::render;
use crate::run_data::RunData;
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
    /// Why the course ends before the run does, if its log is cut.
    pub damage: Option<String>,
}

/// Writes every figure that one run, or two laid over each other, have data for, and a page with them;
/// returns the page's path. The folder is made if it is not there.
///
/// # Errors
/// A figure that can't be drawn; a file that can't be written.
pub fn write_report(runs: &[ReportedRun], out: &Path) -> Result<PathBuf, WriteReportError> {
    let (figures, left_out) = figures::all(&Runs(runs));
    let io_error = |path: &Path, source| WriteReportError::Io { path: path.to_owned(), source };
    fs::create_dir_all(out).map_err(|source| io_error(out, source))?;
    let write = |name: &str, bytes: &[u8]| {
        let path = out.join(name);
        fs::write(&path, bytes).map_err(|source| io_error(&path, source)).map(|()| path)
    };
    let mut drawn = Vec::with_capacity(figures.len());
    for (number, figure) in figures {
        let name = format!("figure-{number}");
        let draw_error = |problem| WriteReportError::Draw { figure: name.clone(), problem };
        let svg = render::svg(&figure).map_err(draw_error)?;
        write(&format!("{name}.svg"), svg.as_bytes())?;
        write(&format!("{name}.png"), &render::png(&figure).map_err(draw_error)?)?;
        drawn.push((number, figure, svg));
    }
    write("index.html", page::html(runs, &drawn, &left_out).as_bytes())
}
