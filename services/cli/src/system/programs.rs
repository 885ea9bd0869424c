//! Programs and the simulator's library, from where they were built to where they are installed.

use super::files::LIBRARIES;
use crate::binaries::{AWAKE, EMPTY, IN_PROCESS};
use crate::failure::Failure;
use object::Endianness;
use object::elf::{DT_RUNPATH, FileHeader64};
use object::read::elf::{Dyn as _, FileHeader as _, SectionHeader as _};
use std::env;
use std::path::PathBuf;

/// All programs.
pub static PROGRAMS: [&str; 7] =
    ["mikoshi", IN_PROCESS, "mikoshi-bridge", "mikoshi-coordinator", "mikoshi-servo", EMPTY, AWAKE];
/// Those that are installed where they have been built: each is a workspace of its own.
pub static PROGRAMS_BUILT_APART: [&str; 1] = ["mikoshi-link"];
/// The simulator's library, by the name that programs ask for.
pub const LIBRARY: &str = "libmujoco.so.3.17.0";
/// The first place where programs look for it: [`LIBRARIES`] beside them.
const INSTALLED: &str = "$ORIGIN/../lib/mikoshi";

/// Where the simulator's library is now: beside installed programs, or where it was when they were built.
///
/// # Errors
/// Nowhere.
pub fn find_library() -> Result<PathBuf, Failure> {
    let here = env::current_exe().map_err(Failure::fault)?;
    let beside = here.parent().and_then(|folder| folder.parent()).map(|prefix| prefix.join(LIBRARIES));
    let built = option_env!("MUJOCO_DYNAMIC_LINK_DIR").map(PathBuf::from);
    let places: Vec<_> = beside.into_iter().chain(built).map(|folder| folder.join(LIBRARY)).collect();
    let found = places.iter().find(|path| path.is_file()).cloned();
    found.ok_or_else(|| {
        let places: Vec<_> = places.iter().map(|path| path.display().to_string()).collect();
        Failure::fault(format!("{LIBRARY} is not at {}: run `make setup`", places.join(" or ")))
    })
}

/// An installed program looks for its libraries where they are installed, and nowhere where it was built: there,
/// somebody else might put another.
///
/// # Errors
/// It is no program that this was built as.
pub fn forget_build_folder(program: &mut [u8]) -> Result<(), Failure> {
    let Some(place) = runpath(program).map_err(Failure::fault)? else { return Ok(()) };
    let length = program[place..].iter().position(|byte| *byte == 0).unwrap_or(0);
    let runpath = &mut program[place..place + length];
    if !runpath.starts_with(INSTALLED.as_bytes()) {
        let found = String::from_utf8_lossy(runpath).into_owned();
        return Err(Failure::fault(format!(
            "a program looks for libraries in {found}, not first in {INSTALLED}"
        )));
    }
    runpath[INSTALLED.len()..].fill(0);
    Ok(())
}

/// Where in a program the folders are written in which it looks for libraries.
fn runpath(program: &[u8]) -> object::Result<Option<usize>> {
    let header = FileHeader64::<Endianness>::parse(program)?;
    let endian = header.endian()?;
    let sections = header.sections(endian, program)?;
    let Some((dynamic, strings)) = sections.dynamic(endian, program)? else { return Ok(None) };
    let strings = sections.section(strings)?.sh_offset(endian);
    let entry = dynamic.iter().find(|entry| entry.d_tag(endian) == DT_RUNPATH);
    Ok(entry.map(|entry| (strings + entry.d_val(endian)) as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_forgets_where_it_was_built_and_nothing_else() {
        // This test's own program was linked as the others are.
        let before = std::fs::read(env::current_exe().expect("a program")).expect("it is readable");
        let mut after = before.clone();
        forget_build_folder(&mut after).expect("it is a program");
        let place = runpath(&after).expect("a program").expect("it has a runpath");
        let text = after[place..].split(|byte| *byte == 0).next().expect("a text");
        assert_eq!(String::from_utf8_lossy(text), INSTALLED);
        let changed = before.iter().zip(&after).filter(|(a, b)| a != b).count();
        assert!(changed > 0 && changed < 500 && before.len() == after.len(), "{changed}");
        forget_build_folder(&mut after).expect("twice does it once");
    }

    #[test]
    fn what_is_no_program_is_refused() {
        assert!(forget_build_folder(&mut b"#!/bin/sh\n".to_vec()).is_err());
    }
}
