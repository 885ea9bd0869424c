//! A canvas of pixels, and the PNG that it becomes.

use super::text;
use crate::style::UNIT;
use plotters::backend::BitMapBackend;
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
};

/// Bytes of a pixel: red, green, blue.
const CHANNELS: usize = 3;

/// Plotters' bitmap, but for text and thick paths: it fills a path's outline as one polygon, which has holes
/// where the path comes near itself, as noisy lines do. Here every stretch of a path is drawn for itself,
/// with round joints.
pub struct Bitmap<'a>(BitMapBackend<'a>);

impl<'a> Bitmap<'a> {
    /// On `pixels`, of which there are as many as `size` says.
    pub fn new(pixels: &'a mut [u8], size: (u32, u32)) -> Self {
        Self(BitMapBackend::with_buffer(pixels, size))
    }
}

type Drawn = Result<(), DrawingErrorKind<<Bitmap<'static> as DrawingBackend>::ErrorType>>;

impl<'a> DrawingBackend for Bitmap<'a> {
    type ErrorType = <BitMapBackend<'a> as DrawingBackend>::ErrorType;

    fn get_size(&self) -> (u32, u32) {
        self.0.get_size()
    }

    fn ensure_prepared(&mut self) -> Drawn {
        self.0.ensure_prepared()
    }

    fn present(&mut self) -> Drawn {
        self.0.present()
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Drawn {
        self.0.draw_pixel(point, color)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.0.draw_line(from, to, style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        bottom_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        self.0.draw_rect(upper_left, bottom_right, style, fill)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let mut last = None;
        for point in path {
            if let Some(last) = last.replace(point) {
                self.0.draw_line(last, point, style)?;
                if style.stroke_width() > 2 {
                    self.0.draw_circle(last, style.stroke_width() / 2, style, true)?;
                }
            }
        }
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, pos: BackendCoord) -> Drawn {
        let color = style.color();
        text::draw(text, style, pos, |point, coverage| {
            let alpha = color.alpha * coverage;
            self.0.draw_pixel(point, BackendColor { alpha, ..color })
        })
    }
}

/// A PNG, one pixel of which is the mean of [`UNIT`] × [`UNIT`] of these.
pub fn encode(pixels: &[u8], (width, height): (u32, u32)) -> Result<Vec<u8>, png::EncodingError> {
    let unit = UNIT as usize;
    let row_bytes = CHANNELS * width as usize;
    let (columns, rows) = (width / UNIT, height / UNIT);
    let mut means = Vec::with_capacity(CHANNELS * columns as usize * rows as usize);
    let mut sums = vec![0_u16; CHANNELS * columns as usize];
    for rows in pixels.chunks_exact(unit * row_bytes) {
        sums.fill(0);
        for row in rows.chunks_exact(row_bytes) {
            for (sums, block) in sums.chunks_exact_mut(CHANNELS).zip(row.chunks_exact(unit * CHANNELS)) {
                for pixel in block.chunks_exact(CHANNELS) {
                    sums.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += u16::from(*value));
                }
            }
        }
        means.extend(sums.iter().map(|sum| (sum / (UNIT * UNIT) as u16) as u8));
    }
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, columns, rows);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&means)?;
    writer.finish()?;
    Ok(file)
}
