//! A run as the paper's figures, and a page with them.
//!
//! ```text
//! Observation, tick by tick ──▶ RunData ──┐                  ┌──▶ FIGURE.svg, FIGURE.png
//!                               Summary ──┴─▶ figures: scenes┴──▶ index.html
//! ```
//!
//! A figure is first a *scene*: panels, axes and marks in the data's units, without a pixel. Every figure
//! has a file that makes its scene of one run, or of two laid over each other; one renderer draws all
//! scenes. What figures show is true; what control saw of it is at most a thin line.
//!
//! A sweep of many runs has a figure of its own, their figures over the parameters that they vary in, and
//! another one where its runs are compared with what the paper predicts. A survey of many sweeps has a row of panels for each.
//!
//! This crate knows no log file, no simulator and no control.

#![allow(non_snake_case)]

mod comparison;
mod error;
mod figures;
mod html;
mod latency_page;
mod page;
mod render;
mod run_data;
mod scene;
mod style;
mod survey_page;
mod sweep;
mod sweep_page;
#[cfg(test)]
mod tests;
mod write;

pub use comparison::{ComparedRuns, EdgeTime, FollowerDelay, LateRobot, LateRun, TimeToEdge};
pub use error::WriteReportError;
pub use latency_page::{LatencyReport, LatencyTable, Tail, TickTimeline, write_latency};
pub use run_data::RunData;
pub use survey_page::{SurveyReport, SurveyedSweep, write_survey};
pub use sweep::{SweepFigure, SweepParameter, SweepQuantity};
pub use sweep_page::{SweepFailure, SweepReport, write_sweep};
pub use write::{JudgedLimit, ReportedRun, write_report};
