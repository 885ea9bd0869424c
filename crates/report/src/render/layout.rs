//! Where things are on a canvas, in canvas units.

use crate::scene::{Figure, Panel};
use crate::style::{TEXT_PX, TITLE_PX, UNIT, WIDTH_PX};

const MARGIN_PX: u32 = 24;
const GAP_PX: u32 = 28;
/// Room for the numbers and the label of a y axis.
const Y_AXIS_PX: u32 = 96;
/// Room for the numbers and the label of an x axis.
const X_AXIS_PX: u32 = 62;

/// A rectangle: left, top, width, height.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub left: u32,
    pub top: u32,
    pub width: u32,
    pub height: u32,
}

/// Where a figure's parts are.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Of the whole canvas.
    pub size: (u32, u32),
    /// Top left corner of the title.
    pub title: (i32, i32),
    /// Right end of the subtitle's middle line.
    pub subtitle: (i32, i32),
    /// Left end of the legend's middle line.
    pub legend: (i32, i32),
    /// Of each panel: its title's top left corner, its plot with axes, and whether the x axis is labelled.
    pub panels: Vec<PanelLayout>,
}

/// Where a panel's parts are.
#[derive(Clone, Copy, Debug)]
pub struct PanelLayout {
    /// Title line, as wide as the plot.
    pub title: Place,
    /// Plot with the numbers of its axes.
    pub chart: Place,
    /// Room for the numbers and label of the x axis below the plot; 0 where the panel below has them.
    pub x_axis: u32,
    /// Room for the numbers and label of the y axis left of the plot.
    pub y_axis: u32,
}

impl Layout {
    pub fn of(figure: &Figure) -> Self {
        let columns = figure.columns.max(1);
        let rows = figure.panels.len().div_ceil(columns);
        let width = (WIDTH_PX - 2 * MARGIN_PX - (columns as u32 - 1) * GAP_PX) / columns as u32;
        let plot_width = width - Y_AXIS_PX;
        let plot_height = match figure.panels.first().filter(|_| figure.has_equal_scales) {
            Some(panel) => equal_height(panel, plot_width),
            None => figure.panel_height_px,
        };
        let title_height = if figure.panels.iter().all(Panel::is_untitled) { 8 } else { TEXT_PX + 10 };
        let legend_top = MARGIN_PX + TITLE_PX + 12;
        let mut top = legend_top + if figure.legend.is_empty() { 0 } else { TEXT_PX + 14 } + 4;
        let mut panels = Vec::with_capacity(figure.panels.len());
        for row in 0..rows {
            // Panels over one common x axis have its numbers below the last of them only.
            let is_last = |column: usize| {
                let below = figure.panels.get((row + 1) * columns + column);
                below.is_none_or(|below| {
                    let this = &figure.panels[row * columns + column];
                    this.x.range != below.x.range || this.x.label != below.x.label
                })
            };
            let used = columns.min(figure.panels.len() - row * columns);
            let x_axis = if (0..used).any(is_last) { X_AXIS_PX } else { 0 };
            for column in 0..used {
                let left = MARGIN_PX + column as u32 * (width + GAP_PX);
                let plot_left = left + Y_AXIS_PX;
                let height = plot_height + x_axis;
                panels.push(PanelLayout {
                    title: Place { left: plot_left, top, width: plot_width, height: title_height }.scaled(),
                    chart: Place { left, top: top + title_height, width, height }.scaled(),
                    x_axis: UNIT * x_axis,
                    y_axis: UNIT * Y_AXIS_PX,
                });
            }
            top += title_height + plot_height + x_axis + 16;
        }
        let at = |px: u32| (UNIT * px) as i32;
        Self {
            size: (UNIT * WIDTH_PX, UNIT * (top + MARGIN_PX - 16)),
            title: (at(MARGIN_PX), at(MARGIN_PX)),
            subtitle: (at(WIDTH_PX - MARGIN_PX), at(MARGIN_PX + TITLE_PX / 2)),
            legend: (at(MARGIN_PX), at(legend_top + TEXT_PX / 2)),
            panels,
        }
    }
}

impl Place {
    fn scaled(self) -> Self {
        let Self { left, top, width, height } = self;
        Self { left: UNIT * left, top: UNIT * top, width: UNIT * width, height: UNIT * height }
    }
}

/// The height of a plot in which a metre is as long upwards as it is sideways.
fn equal_height(panel: &Panel, plot_width: u32) -> u32 {
    let span = |range: &core::ops::Range<f64>| range.end - range.start;
    (f64::from(plot_width) * span(&panel.y.range) / span(&panel.x.range)).round() as u32
}
