//! Pictures of a recorded run by the simulator's own renderer, off-screen: no display, no window, and no graphics
//! card where OpenGL is there in software.
//!
//! What is seen is true: the world as it was simulated, put where the truth of each tick says. This crate knows no
//! control; it reads logs and writes files.

mod camera;
mod error;
mod film;
mod png_file;
mod snapshot;
mod stage;

pub use camera::View;
pub use error::PictureError;
pub use snapshot::{Snapshot, course};
pub use stage::{MAX_HEIGHT, MAX_WIDTH};

use camera::Camera;
use film::Film;
use mikoshi_config::RunSpec;
use stage::Stage;
use std::path::Path;

/// How large a picture is, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Size {
    pub width: u32,
    pub height: u32,
}

/// Draws one moment of a run, seen as all of `course` would be, into a PNG file.
///
/// # Errors
/// See [`PictureError`].
pub fn draw(
    run: &RunSpec,
    course: &[Snapshot],
    moment: &Snapshot,
    view: View,
    size: Size,
    out: &Path,
) -> Result<(), PictureError> {
    let camera = Camera::of(run, course, view);
    let mut stage = Stage::new(run, size)?;
    png_file::write(stage.picture(moment, camera.at(moment))?, size, out)
}

/// Draws a whole course as an MP4 film, so many pictures a second.
///
/// # Errors
/// See [`PictureError`].
pub fn film(
    run: &RunSpec,
    course: &[Snapshot],
    view: View,
    size: Size,
    pictures_hz: f64,
    out: &Path,
) -> Result<(), PictureError> {
    let camera = Camera::of(run, course, view);
    let mut stage = Stage::new(run, size)?;
    let mut film = Film::create(out, size, pictures_hz)?;
    for moment in course {
        film.add(stage.picture(moment, camera.at(moment))?)?;
    }
    film.finish()
}
