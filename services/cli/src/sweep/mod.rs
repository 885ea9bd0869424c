//! The parts of a sweep: its runs as processes, their folders, and what they come to together; and surveys of sweeps.

pub(crate) mod comparison;
pub(crate) mod figure;
pub(crate) mod jobs;
pub(crate) mod page;
pub(crate) mod planned;
pub(crate) mod result;
pub(crate) mod run_folder;
pub(crate) mod survey;
pub(crate) mod text;
