//! Words on a bitmap, where an SVG has them. (Plotters leaves out the bearings of glyphs, which tears words
//! apart.)

use crate::style;
use ab_glyph::{Font, PxScale, ScaleFont, point};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{BackendCoord, BackendTextStyle};

/// Plotters' sizes are those of lines; the font of its SVGs is as much smaller.
const LINE_OF_EM: f32 = 1.24;
/// Height of a small letter.
const EX_OF_EM: f32 = 0.52;

/// Calls `draw` with every pixel that a line of text touches, and how much of it is covered.
pub fn draw<S: BackendTextStyle, E>(
    text: &str,
    style: &S,
    position: BackendCoord,
    mut draw: impl FnMut(BackendCoord, f64) -> Result<(), E>,
) -> Result<(), E> {
    let font = style::font();
    let em = style.size() as f32 / LINE_OF_EM;
    let scale = em * font.height_unscaled() / font.units_per_em().unwrap_or(1.0);
    let font = font.as_scaled(PxScale::from(scale));
    let mut glyphs = Vec::with_capacity(text.len());
    let (mut x, mut last) = (0.0, None);
    for letter in text.chars() {
        let id = font.glyph_id(letter);
        x += last.replace(id).map_or(0.0, |last| font.kern(last, id));
        glyphs.push(id.with_scale_and_position(scale, point(x, 0.0)));
        x += font.h_advance(id);
    }
    let anchor = style.anchor();
    let left = match anchor.h_pos {
        HPos::Left => 0.0,
        HPos::Right => -x,
        HPos::Center => -0.5 * x,
    };
    // As plotters' SVG shifts the baseline.
    let baseline = match anchor.v_pos {
        VPos::Top => 0.76 * em,
        VPos::Center => 0.5 * EX_OF_EM * em,
        VPos::Bottom => -0.5 * EX_OF_EM * em,
    };
    for outline in glyphs.into_iter().filter_map(|glyph| font.outline_glyph(glyph)) {
        let corner = outline.px_bounds().min;
        let (left, top) = ((corner.x + left).round() as i32, (corner.y + baseline).round() as i32);
        let mut result = Ok(());
        outline.draw(|x, y, coverage| {
            let (x, y) = style.transform().transform(left + x as i32, top + y as i32);
            if result.is_ok() && coverage > 0.0 {
                result = draw((position.0 + x, position.1 + y), f64::from(coverage.min(1.0)));
            }
        });
        result?;
    }
    Ok(())
}
