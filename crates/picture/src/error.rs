//! Why there is no picture.

use mikoshi_physics::BuildWorldError;
use std::io;
use std::path::PathBuf;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum PictureError {
    #[error(transparent)]
    BuildWorld(#[from] BuildWorldError),
    #[error("the simulator: {0}")]
    Simulator(String),
    #[error(
        "no OpenGL without a display: {0}. Mesa's software renderer does \
         (on Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri)"
    )]
    OpenRenderer(String),
    #[error("the renderer: {0}")]
    Render(String),
    #[error("the encoder: {0}")]
    Encode(String),
    #[error("{}: {source}", path.display())]
    WriteFile { path: PathBuf, source: io::Error },
    #[error("there is no moment to draw")]
    Empty,
}
