//! One picture as a PNG file.

use crate::Size;
use crate::error::PictureError;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

pub fn write(rgb: &[u8], size: Size, out: &Path) -> Result<(), PictureError> {
    let failed = |source| PictureError::WriteFile { path: out.to_owned(), source };
    let file = BufWriter::new(File::create(out).map_err(failed)?);
    let mut encoder = png::Encoder::new(file, size.width, size.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(rgb)?;
        writer.finish()
    });
    written.map_err(|error| failed(io::Error::other(error)))
}
