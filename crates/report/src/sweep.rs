//! The figure of a sweep: what its runs came to over what they varied in.

use crate::scene::{Axis, Figure, LegendEntry, Mark, Panel, Stroke, range_of};
use crate::style;
use core::ops::Range;

/// What a sweep's runs varied in and came to. All `values` are in the order of the runs.
#[derive(Clone, Debug)]
pub struct SweepFigure {
    /// What is shown.
    pub title: String,
    /// Of which runs.
    pub subtitle: String,
    /// Panels below each other.
    pub parameters: Vec<SweepParameter>,
    /// Panels beside each other.
    pub quantities: Vec<SweepQuantity>,
    /// Which runs did not succeed.
    pub failed: Vec<bool>,
}

/// What runs varied in.
#[derive(Clone, Debug)]
pub struct SweepParameter {
    /// Its name, and unit.
    pub label: String,
    /// Of every run.
    pub values: Vec<f64>,
}

/// What runs came to.
#[derive(Clone, Debug)]
pub struct SweepQuantity {
    /// Its name, and unit.
    pub label: String,
    /// Of every run; NaN where it has none.
    pub values: Vec<f64>,
    /// Its threshold, where it has one.
    pub limit: Option<f64>,
}

/// Height of each panel's plot.
const PANEL_HEIGHT_PX: u32 = 170;
/// Runs that succeeded, and runs that failed.
const COLOURS: [plotters::style::RGBColor; 2] = [style::PALETTE[0], style::PALETTE[1]];

pub(crate) fn figure(sweep: &SweepFigure) -> Figure {
    let rows = sweep.parameters.iter().flat_map(|parameter| row(sweep, parameter, ""));
    of_panels(&sweep.title, &sweep.subtitle, rows.collect(), &[sweep])
}

/// Several sweeps in one figure: a row for each, over its first parameter; `None` without a sweep.
pub(crate) fn figure_of_many(title: &str, subtitle: &str, sweeps: &[&SweepFigure]) -> Option<Figure> {
    let rows = sweeps.iter().filter_map(|sweep| Some((sweep, sweep.parameters.first()?)));
    let panels: Vec<_> = rows.flat_map(|(sweep, parameter)| row(sweep, parameter, &sweep.title)).collect();
    (!panels.is_empty()).then(|| of_panels(title, subtitle, panels, sweeps))
}

/// Every quantity over one parameter; the first panel has the row's title.
fn row(sweep: &SweepFigure, parameter: &SweepParameter, title: &str) -> Vec<Panel> {
    let quantities = sweep.quantities.iter().enumerate();
    let of_quantity = |(column, quantity): (usize, &SweepQuantity)| {
        let y = y_range(quantity, &sweep.failed);
        let title = if column == 0 { title } else { "" };
        Panel { title: title.to_owned(), ..panel(parameter, quantity, y, &sweep.failed) }
    };
    quantities.map(of_quantity).collect()
}

fn of_panels(title: &str, subtitle: &str, panels: Vec<Panel>, sweeps: &[&SweepFigure]) -> Figure {
    let mut legend = vec![LegendEntry::patch("succeeded", COLOURS[0])];
    if sweeps.iter().any(|sweep| sweep.failed.contains(&true)) {
        legend.push(LegendEntry::patch("failed, with the run's number; at the edge if beyond", COLOURS[1]));
    }
    legend.push(LegendEntry::line("threshold", limit_stroke()));
    Figure {
        title: title.to_owned(),
        subtitle: subtitle.to_owned(),
        caption: "Every run is a dot, or where it failed its number.".to_owned(),
        legend,
        columns: sweeps.first().map_or(1, |sweep| sweep.quantities.len()),
        panels,
        panel_height_px: PANEL_HEIGHT_PX,
        has_equal_scales: false,
    }
}

fn panel(parameter: &SweepParameter, quantity: &SweepQuantity, y: Range<f64>, failed: &[bool]) -> Panel {
    let x = range(&parameter.values);
    let mut marks = Vec::with_capacity(failed.len() + 1);
    if let Some(limit) = quantity.limit {
        marks.push(Mark::Path { points: vec![(x.start, limit), (x.end, limit)], stroke: limit_stroke() });
    }
    let points =
        || parameter.values.iter().copied().zip(quantity.values.iter().copied()).zip(failed).enumerate();
    for (_, (at, _)) in points().filter(|(_, (at, failed))| !**failed && at.1.is_finite()) {
        marks.push(Mark::Dot { at, colour: COLOURS[0] });
    }
    // Above the others: they are what is looked for.
    for (run, ((x, value), _)) in points().filter(|(_, (_, failed))| **failed) {
        // What has no figure has fallen out of every range.
        let value = if value.is_nan() { y.end } else { value.clamp(y.start, y.end) };
        marks.push(Mark::Label { at: (x, value), text: run.to_string(), colour: COLOURS[1] });
    }
    Panel {
        title: String::new(),
        note: String::new(),
        x: Axis { label: parameter.label.clone(), range: x },
        y: Axis { label: quantity.label.clone(), range: y },
        marks,
    }
}

/// By the runs that succeeded and the threshold: one that fell would leave the others no room.
fn y_range(quantity: &SweepQuantity, failed: &[bool]) -> Range<f64> {
    let succeeded =
        quantity.values.iter().zip(failed).filter(|(_, failed)| !**failed).map(|(value, _)| *value);
    range(&succeeded.chain(quantity.limit).chain([0.0]).collect::<Vec<_>>())
}

/// Of any width, since the values may be of any size; where all are the same, there is some room about them.
fn range(values: &[f64]) -> Range<f64> {
    let largest = values.iter().copied().filter(|value| value.is_finite()).map(f64::abs).fold(0.0, f64::max);
    let range = range_of(values.iter().copied(), 0.0);
    match range.start < range.end {
        true => range,
        false => range_of(values.iter().copied(), if largest > 0.0 { 0.2 * largest } else { 1.0 }),
    }
}

fn limit_stroke() -> Stroke {
    Stroke { is_dashed: true, ..Stroke::thin(style::INK) }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn sweep() -> SweepFigure {
        SweepFigure {
            title: "robust".to_owned(),
            subtitle: "4 runs".to_owned(),
            parameters: vec![
                SweepParameter { label: "mass [kg]".to_owned(), values: vec![1.0, 2.0, 3.0, 4.0] },
                SweepParameter { label: "friction".to_owned(), values: vec![0.4, 0.4, 0.4, 0.4] },
            ],
            quantities: vec![
                SweepQuantity {
                    label: "peak [mm]".to_owned(),
                    values: vec![3.0, 4.0, 900.0, 5.0],
                    limit: Some(8.0),
                },
                SweepQuantity {
                    label: "margin [mm]".to_owned(),
                    values: vec![40.0, 39.0, f64::NAN, 41.0],
                    limit: None,
                },
            ],
            failed: vec![false, false, true, false],
        }
    }

    #[test]
    fn every_parameter_has_a_panel_for_every_quantity_and_every_run_a_mark_within_it() {
        let figure = figure(&sweep());
        assert_eq!((figure.panels.len(), figure.columns), (4, 2));
        for panel in &figure.panels {
            let (mut dots, mut labels) = (0, Vec::new());
            for mark in &panel.marks {
                let at = match mark {
                    Mark::Dot { at, .. } => {
                        dots += 1;
                        at
                    }
                    Mark::Label { at, text, .. } => {
                        labels.push(text.as_str());
                        at
                    }
                    _ => continue,
                };
                assert!(panel.x.range.start <= at.0 && at.0 <= panel.x.range.end, "{at:?}");
                assert!(panel.y.range.start <= at.1 && at.1 <= panel.y.range.end, "{at:?}");
            }
            assert_eq!((dots, labels), (3, vec!["2"]));
        }
    }

    #[test]
    fn a_run_that_failed_leaves_the_others_room() {
        let figure = figure(&sweep());
        assert!(figure.panels[0].y.range.end < 20.0, "{:?}", figure.panels[0].y.range);
    }
}
