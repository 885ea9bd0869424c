//! What a figure shows, in the data's units: no pixel, no file.

use crate::style;
use core::ops::Range;
use plotters::style::RGBColor;

/// A figure.
#[derive(Clone, Debug)]
pub struct Figure {
    /// What is shown; of a figure of the paper, its number too.
    pub title: String,
    /// Of which run, or runs.
    pub subtitle: String,
    /// What is shown, in full sentences.
    pub caption: String,
    pub legend: Vec<LegendEntry>,
    /// Panels beside each other.
    pub columns: usize,
    /// Row by row.
    pub panels: Vec<Panel>,
    /// Height of each panel's plot, in pixels of a PNG; where the scales of both axes are equal it follows
    /// from them.
    pub panel_height_px: u32,
    pub has_equal_scales: bool,
}

/// One pair of axes.
#[derive(Clone, Debug)]
pub struct Panel {
    pub title: String,
    /// A number that readers want, opposite the title.
    pub note: String,
    pub x: Axis,
    pub y: Axis,
    /// In the order in which they are drawn.
    pub marks: Vec<Mark>,
}

#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    pub range: Range<f64>,
}

/// Something drawn. Lines break where a value is not finite.
#[derive(Clone, Debug)]
pub enum Mark {
    /// A quantity over x, which ascends: thinned out to what can be seen, extremes kept.
    Series { points: Vec<(f64, f64)>, stroke: Stroke },
    /// What lies between two quantities over x, which ascends.
    Band { x: Vec<f64>, lower: Vec<f64>, upper: Vec<f64>, colour: RGBColor },
    /// A curve in the plane.
    Path { points: Vec<(f64, f64)>, stroke: Stroke },
    /// A closed outline in the plane.
    Outline { corners: Vec<(f64, f64)>, fill: Option<RGBColor>, stroke: Stroke },
    /// A line over the whole height.
    Vertical { x: f64, stroke: Stroke },
    /// Short strokes on the lower edge: when something happened.
    Rug { xs: Vec<f64>, stroke: Stroke },
    /// A spot.
    Dot { at: (f64, f64), colour: RGBColor },
    /// Words at a place, white on a plate of a colour.
    Label { at: (f64, f64), text: String, colour: RGBColor },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    pub colour: RGBColor,
    pub width_px: f64,
    pub is_dashed: bool,
}

#[derive(Clone, Debug)]
pub struct LegendEntry {
    pub text: String,
    pub sample: Sample,
}

/// What stands before the words of a legend.
#[derive(Clone, Copy, Debug)]
pub enum Sample {
    Line(Stroke),
    Patch(RGBColor),
}

impl Stroke {
    pub fn solid(colour: RGBColor) -> Self {
        Self { colour, width_px: style::LINE_PX, is_dashed: false }
    }

    pub fn thin(colour: RGBColor) -> Self {
        Self { width_px: style::THIN_PX, ..Self::solid(colour) }
    }

    pub fn reference() -> Self {
        Self { width_px: style::REFERENCE_PX, ..Self::solid(style::REFERENCE) }
    }
}

impl LegendEntry {
    pub fn line(text: impl Into<String>, stroke: Stroke) -> Self {
        Self { text: text.into(), sample: Sample::Line(stroke) }
    }

    pub fn patch(text: impl Into<String>, colour: RGBColor) -> Self {
        Self { text: text.into(), sample: Sample::Patch(colour) }
    }
}

impl Panel {
    /// Whether nothing stands over it.
    pub fn is_untitled(&self) -> bool {
        self.title.is_empty() && self.note.is_empty()
    }

    /// The y values of all series and bands.
    pub fn values(&self) -> impl Iterator<Item = f64> {
        let values = |mark: &Mark| -> Vec<f64> {
            match mark {
                Mark::Series { points, .. } => points.iter().map(|point| point.1).collect(),
                Mark::Band { lower, upper, .. } => lower.iter().chain(upper).copied().collect(),
                _ => vec![],
            }
        };
        self.marks.iter().flat_map(values)
    }
}

/// Gives panels one common y range that shows all of their series, at least `least` wide.
pub fn share_y_range<'a>(panels: impl IntoIterator<Item = &'a mut Panel>, least: f64) {
    let mut panels: Vec<_> = panels.into_iter().collect();
    let range = range_of(panels.iter().flat_map(|panel| panel.values()), least);
    for panel in &mut panels {
        panel.y.range = range.clone();
    }
}

/// A range that holds all finite values with some air, at least `least` wide.
pub fn range_of(values: impl IntoIterator<Item = f64>, least: f64) -> Range<f64> {
    let (low, high) = values
        .into_iter()
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return -0.5 * least..0.5 * least;
    }
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low).max(least));
    middle - 1.06 * half..middle + 1.06 * half
}
