//! `mikoshi render`: a recorded run as a film or a picture.

use mikoshi::arguments::{CameraChoice, RenderArguments};
use mikoshi::failure::{Failure, as_lines};
use mikoshi::output_directory::refuse_to_overwrite;
use mikoshi::print::{print_error, print_file};
use mikoshi_observation::LogReader;
use mikoshi_picture::{PictureError, Size, View, course, draw, film};
use std::fs;

/// A fixed view of one picture must know the way before it; so often a second is enough.
const WAY_HZ: f64 = 5.0;

/// What a file holds, by how its name ends.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Film,
    Picture,
}

/// Draws what was asked for.
///
/// # Errors
/// The log can't be read, the file can't be written, or there is nothing to draw: bad usage. No OpenGL: a fault.
pub fn render(arguments: &RenderArguments) -> Result<(), Failure> {
    let out = arguments.out.as_path();
    let kind = match out.extension().and_then(|extension| extension.to_str()) {
        Some("mp4") => Kind::Film,
        Some("png") => Kind::Picture,
        _ => return Err(Failure::usage(format!("{}: expected a name in .mp4 or .png", out.display()))),
    };
    let view = match arguments.camera {
        CameraChoice::Top => View::Top,
        CameraChoice::Side => View::Side,
        CameraChoice::Follow => View::Follow,
    };
    let mut log = LogReader::open(&arguments.log).map_err(Failure::usage)?;
    refuse_to_overwrite(out, arguments.force)?;
    let size = Size { width: arguments.size.0, height: arguments.size.1 };
    let drawn = match kind {
        Kind::Film => draw_film(arguments, &mut log, view, size),
        Kind::Picture => draw_picture(arguments, &mut log, view, size),
    };
    if let Err(failure) = drawn {
        // Half a file is no use to anybody.
        let _ = fs::remove_file(out);
        return Err(failure);
    }
    if let Some(damage) = log.damage() {
        let warning = format!("{}: cut or damaged, drawn up to there: {damage}", arguments.log.display());
        print_error(&as_lines("warning", &warning));
    }
    print_file(out, arguments.json)
}

fn draw_film(
    arguments: &RenderArguments,
    log: &mut LogReader,
    view: View,
    size: Size,
) -> Result<(), Failure> {
    if arguments.at.is_some() {
        return Err(Failure::usage("--at is of a picture; a film has --from and --to"));
    }
    let to_s = arguments.to.unwrap_or(f64::INFINITY);
    let moments = course(log, arguments.from, to_s, arguments.fps).map_err(Failure::usage)?;
    film(log.run(), &moments, view, size, arguments.fps, &arguments.out).map_err(failure)
}

fn draw_picture(
    arguments: &RenderArguments,
    log: &mut LogReader,
    view: View,
    size: Size,
) -> Result<(), Failure> {
    let period_s = log.run().scenario.control_period_s;
    let at_s = arguments.at.unwrap_or(f64::INFINITY);
    // Every tick, since the one that is asked for is among them.
    let moments = course(log, 0.0, at_s, period_s.recip()).map_err(Failure::usage)?;
    let Some(moment) = moments.last() else { return Err(failure(PictureError::Empty)) };
    if at_s.is_finite() && moment.time_s + period_s < at_s {
        return Err(Failure::usage(format!("--at {at_s}: the log ends at {} s", moment.time_s)));
    }
    let apart = (1.0 / (WAY_HZ * period_s)).ceil() as usize;
    let way: Vec<_> = moments.iter().step_by(apart).chain([moment]).cloned().collect();
    draw(log.run(), &way, moment, view, size, &arguments.out).map_err(failure)
}

fn failure(error: PictureError) -> Failure {
    match error {
        PictureError::Empty | PictureError::WriteFile { .. } => Failure::usage(error),
        _ => Failure::fault(error),
    }
}
