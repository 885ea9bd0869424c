//! How every figure looks: sizes, colours, type.

use ab_glyph::FontRef;
use epaint_default_fonts::UBUNTU_LIGHT;
use plotters::style::{FontStyle, RGBColor, register_font};
use std::sync::OnceLock;

/// Canvas units per pixel of a PNG. Plotting coordinates are integers: a finer canvas makes lines of an SVG
/// smooth, and a PNG is averaged over it.
pub const UNIT: u32 = 3;
/// Width of every figure, in pixels of its PNG.
pub const WIDTH_PX: u32 = 1600;

pub const FONT: &str = "sans-serif";
pub const TITLE_PX: u32 = 30;
pub const TEXT_PX: u32 = 25;
pub const TICK_PX: u32 = 22;

pub const LINE_PX: f64 = 1.7;
pub const THIN_PX: f64 = 1.0;
/// What a line is to be compared with lies below it, and is wider.
pub const REFERENCE_PX: f64 = 6.0;

pub const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
pub const FAINT_INK: RGBColor = RGBColor(0x77, 0x77, 0x77);
pub const FRAME: RGBColor = RGBColor(0xaa, 0xaa, 0xaa);
pub const GRID: RGBColor = RGBColor(0xe4, 0xe4, 0xe4);
pub const REFERENCE: RGBColor = RGBColor(0xc4, 0xc4, 0xc4);
pub const SHADE: RGBColor = RGBColor(0xe9, 0xee, 0xf3);

/// Okabe and Ito's palette, which readers with any colour vision can tell apart; without its yellow, which
/// is too light for lines, and its black, which is ours for text.
pub const PALETTE: [RGBColor; 6] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
];

/// The colour of the `index`-th of several; they repeat after the sixth, so names stand beside them.
pub fn colour(index: usize) -> RGBColor {
    PALETTE[index % PALETTE.len()]
}

/// Between white and `colour`.
pub fn tint(colour: RGBColor, share: f64) -> RGBColor {
    let mix = |channel: u8| (255.0 - share * (255.0 - f64::from(channel))).round() as u8;
    RGBColor(mix(colour.0), mix(colour.1), mix(colour.2))
}

/// Ubuntu Light, which is free (Ubuntu Font Licence 1.0) and compiled in, so that a machine without fonts
/// draws the same. Plotters lays text out by it as well.
pub fn font() -> &'static FontRef<'static> {
    static LOADED: OnceLock<FontRef<'static>> = OnceLock::new();
    LOADED.get_or_init(|| {
        let registered = register_font(FONT, FontStyle::Normal, UBUNTU_LIGHT);
        let font = FontRef::try_from_slice(UBUNTU_LIGHT);
        registered.ok().and(font.ok()).expect("the font that is compiled in is a font")
    })
}
