//! Draws scenes: as SVG and as PNG, from one canvas.

mod bitmap;
mod draw;
mod layout;
mod text;
mod thin;

use crate::scene::Figure;
use crate::style::{self, UNIT};
use bitmap::Bitmap;
use layout::Layout;
use plotters::prelude::{IntoDrawingArea, SVGBackend};

/// An SVG of the figure.
pub fn svg(figure: &Figure) -> Result<String, String> {
    style::font();
    let layout = Layout::of(figure);
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, layout.size).into_drawing_area();
        draw::figure(&area, figure, &layout).map_err(|error| error.to_string())?;
        area.present().map_err(|error| error.to_string())?;
    }
    // As large as the PNG, on the finer canvas; and corners as the PNG has them.
    let (width, height) = (layout.size.0 / UNIT, layout.size.1 / UNIT);
    let canvas = format!(r#"<svg width="{}" height="{}""#, layout.size.0, layout.size.1);
    let page = format!(r#"<svg width="{width}" height="{height}" stroke-linejoin="round""#);
    Ok(text.replacen(&canvas, &page, 1))
}

/// A PNG of the figure.
pub fn png(figure: &Figure) -> Result<Vec<u8>, String> {
    style::font();
    let layout = Layout::of(figure);
    let mut pixels = vec![0; 3 * layout.size.0 as usize * layout.size.1 as usize];
    {
        let area = Bitmap::new(&mut pixels, layout.size).into_drawing_area();
        draw::figure(&area, figure, &layout).map_err(|error| error.to_string())?;
        area.present().map_err(|error| error.to_string())?;
    }
    bitmap::encode(&pixels, layout.size).map_err(|error| error.to_string())
}
