//! From a scene to strokes on a canvas of any kind.

use super::layout::{Layout, PanelLayout, Place};
use super::thin::{finite_parts, thin_path, thin_series};
use crate::scene::{Figure, Mark, Panel, Sample, Stroke};
use crate::style::{FAINT_INK, FONT, FRAME, GRID, INK, TEXT_PX, TICK_PX, TITLE_PX, UNIT};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::element::{Circle, DashedPathElement, PathElement, Polygon, Rectangle, Text};
use plotters::prelude::{Cartesian2d, ChartBuilder, DrawingArea, DrawingAreaErrorKind};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, IntoFont, RGBColor, ShapeStyle, TextStyle, WHITE};
use plotters_backend::DrawingBackend;

type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;
type Canvas<B> = DrawingArea<B, Shift>;
type Plot<B> = DrawingArea<B, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

const DASH_PX: u32 = 9;
const DASH_GAP_PX: u32 = 6;
/// Width of what two points of a line must be apart in to be both drawn.
const RESOLUTION_PX: f64 = 1.5;
const RUG_PX: i32 = 12;
const DOT_PX: i32 = 5;
/// A number on an axis has about this much room.
const X_NUMBER_PX: u32 = 70;
const Y_NUMBER_PX: u32 = 37;

/// Draws a figure.
pub fn figure<B: DrawingBackend>(canvas: &Canvas<B>, figure: &Figure, layout: &Layout) -> Drawn<B> {
    canvas.fill(&WHITE)?;
    let title = text_style(TITLE_PX, &INK, HPos::Left, VPos::Top);
    canvas.draw(&Text::new(figure.title.clone(), layout.title, title))?;
    let subtitle = text_style(TEXT_PX, &FAINT_INK, HPos::Right, VPos::Center);
    canvas.draw(&Text::new(figure.subtitle.clone(), layout.subtitle, subtitle))?;
    legend(canvas, figure, layout.legend)?;
    for (panel, layout) in figure.panels.iter().zip(&layout.panels) {
        draw_panel(canvas, panel, layout, figure.has_equal_scales)?;
    }
    Ok(())
}

fn legend<B: DrawingBackend>(canvas: &Canvas<B>, figure: &Figure, (mut x, y): (i32, i32)) -> Drawn<B> {
    let unit = UNIT as i32;
    let words = text_style(TEXT_PX, &INK, HPos::Left, VPos::Center);
    for entry in &figure.legend {
        let sample = 40 * unit;
        match entry.sample {
            Sample::Line(stroke) => line(canvas, vec![(x, y), (x + sample, y)], stroke)?,
            Sample::Patch(colour) => {
                let corners = [(x, y - 9 * unit), (x + sample, y + 9 * unit)];
                canvas.draw(&Rectangle::new(corners, colour.filled()))?;
            }
        }
        x += sample + 10 * unit;
        canvas.draw(&Text::new(entry.text.clone(), (x, y), words.clone()))?;
        x += canvas.estimate_text_size(&entry.text, &words)?.0 as i32 + 32 * unit;
    }
    Ok(())
}

fn draw_panel<B: DrawingBackend>(
    canvas: &Canvas<B>,
    panel: &Panel,
    layout: &PanelLayout,
    has_equal_scales: bool,
) -> Drawn<B> {
    let Place { left, top, width, height } = layout.title;
    let middle = (top + height / 2) as i32;
    let words = text_style(TEXT_PX, &INK, HPos::Left, VPos::Center);
    canvas.draw(&Text::new(panel.title.clone(), (left as i32, middle), words))?;
    let words = text_style(TICK_PX, &FAINT_INK, HPos::Right, VPos::Center);
    canvas.draw(&Text::new(panel.note.clone(), ((left + width) as i32, middle), words))?;

    let Place { left, top, width, height } = layout.chart;
    let chart_area = canvas.clone().shrink((left, top), (width, height));
    let mut chart = ChartBuilder::on(&chart_area)
        .x_label_area_size(layout.x_axis)
        .y_label_area_size(layout.y_axis)
        .build_cartesian_2d(panel.x.range.clone(), panel.y.range.clone())?;
    let (plot_width, plot_height) = chart.plotting_area().dim_in_pixel();
    let is_x_labelled = layout.x_axis > 0;
    let y_number_px = if has_equal_scales { X_NUMBER_PX } else { Y_NUMBER_PX };
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .max_light_lines(1)
        .bold_line_style(GRID.stroke_width(UNIT))
        .axis_style(FRAME.stroke_width(UNIT))
        .label_style(text_style(TICK_PX, &INK, HPos::Left, VPos::Top))
        .axis_desc_style(text_style(TICK_PX, &INK, HPos::Left, VPos::Top))
        .x_labels((plot_width / (UNIT * X_NUMBER_PX)) as usize)
        .y_labels(((plot_height / (UNIT * y_number_px)) as usize).max(3))
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .x_desc(if is_x_labelled { panel.x.label.as_str() } else { "" })
        .y_desc(panel.y.label.as_str())
        .set_all_tick_mark_size(5 * UNIT)
        .draw()?;
    let plot = chart.plotting_area();
    let frame = [(0, 0), (plot_width, 0), (plot_width, plot_height), (0, plot_height), (0, 0)];
    let frame = frame.map(|(x, y)| (x as i32, y as i32));
    plot.strip_coord_spec().draw(&PathElement::new(frame, FRAME.stroke_width(UNIT)))?;
    for mark in &panel.marks {
        draw_mark(plot, panel, mark)?;
    }
    Ok(())
}

fn draw_mark<B: DrawingBackend>(plot: &Plot<B>, panel: &Panel, mark: &Mark) -> Drawn<B> {
    let (width, _) = plot.dim_in_pixel();
    // What a pixel is worth along x.
    let span = panel.x.range.end - panel.x.range.start;
    let resolution = RESOLUTION_PX * span * f64::from(UNIT) / f64::from(width);
    let (low, high) = (panel.y.range.start, panel.y.range.end);
    match mark {
        Mark::Series { points, stroke } => {
            for part in finite_parts(points) {
                line(plot, thin_series(part, resolution), *stroke)?;
            }
        }
        Mark::Path { points, stroke } => {
            for part in finite_parts(points) {
                line(plot, thin_path(part, resolution), *stroke)?;
            }
        }
        Mark::Band { x, lower, upper, colour } => {
            let edge = |values: &[f64]| -> Vec<_> { x.iter().copied().zip(values.iter().copied()).collect() };
            let (lower, upper) = (edge(lower), edge(upper));
            for (lower, upper) in finite_parts(&lower).zip(finite_parts(&upper)) {
                let mut corners = thin_series(lower, resolution);
                corners.extend(thin_series(upper, resolution).into_iter().rev());
                plot.draw(&Polygon::new(corners, colour.filled()))?;
            }
        }
        Mark::Outline { corners, fill, stroke } => {
            if let Some(fill) = fill {
                plot.draw(&Polygon::new(corners.clone(), fill.filled()))?;
            }
            let closed = corners.iter().chain(corners.first()).copied().collect();
            line(plot, closed, *stroke)?;
        }
        Mark::Vertical { x, stroke } => line(plot, vec![(*x, low), (*x, high)], *stroke)?,
        Mark::Rug { xs, stroke } => {
            let canvas = plot.strip_coord_spec();
            let (_, bottom) = canvas.dim_in_pixel();
            let base = plot.get_base_pixel();
            for x in xs {
                let (x, _) = plot.map_coordinate(&(*x, low));
                let ends = [bottom as i32, bottom as i32 - RUG_PX * UNIT as i32];
                line(&canvas, ends.map(|y| (x - base.0, y)).to_vec(), *stroke)?;
            }
        }
        Mark::Label { at, text, colour } => {
            let canvas = plot.strip_coord_spec();
            let (base, (x, y)) = (plot.get_base_pixel(), plot.map_coordinate(at));
            let (x, y) = (x - base.0, y - base.1);
            let words = text_style(TICK_PX, &WHITE, HPos::Center, VPos::Center);
            let width = canvas.estimate_text_size(text, &words)?.0;
            let unit = UNIT as i32;
            let (half_width, half_height) = (width as i32 / 2 + 6 * unit, 14 * unit);
            let corners = [(x - half_width, y - half_height), (x + half_width, y + half_height)];
            canvas.draw(&Rectangle::new(corners, colour.filled()))?;
            canvas.draw(&Text::new(text.clone(), (x, y), words))?;
        }
        Mark::Dot { at, colour } => {
            plot.draw(&Circle::new(*at, DOT_PX * UNIT as i32, colour.filled()))?;
        }
    }
    Ok(())
}

fn line<B: DrawingBackend, C: plotters::coord::CoordTranslate>(
    area: &DrawingArea<B, C>,
    points: Vec<C::From>,
    stroke: Stroke,
) -> Drawn<B>
where
    C::From: Clone,
    for<'a> &'a C::From: core::borrow::Borrow<C::From>,
{
    let width = (stroke.width_px * f64::from(UNIT)).round() as u32;
    let style: ShapeStyle = stroke.colour.stroke_width(width);
    if stroke.is_dashed {
        let dashes = DashedPathElement::new(points, DASH_PX * UNIT, DASH_GAP_PX * UNIT, style);
        area.draw(&dashes)
    } else {
        area.draw(&PathElement::new(points, style))
    }
}

fn text_style<'a>(px: u32, colour: &'a RGBColor, h_pos: HPos, v_pos: VPos) -> TextStyle<'a> {
    let style: TextStyle<'a> = (FONT, UNIT * px).into_font().into();
    style.color(colour).pos(Pos::new(h_pos, v_pos))
}

/// A number on an axis, without needless zeros and with a true minus.
fn number(value: &f64) -> String {
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    match text {
        "-0" => "0".to_owned(),
        _ => text.replace('-', "−"),
    }
}
