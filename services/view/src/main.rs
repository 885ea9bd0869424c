//! `mikoshi-view`, which `mikoshi view` becomes: a run in Rerun, live or recorded.

#![allow(non_snake_case)]

mod layout;
mod outlet;
mod page;
mod show;
mod stage;

use std::process::ExitCode;

fn main() -> ExitCode {
    mikoshi::main_of_viewer(show::show)
}
