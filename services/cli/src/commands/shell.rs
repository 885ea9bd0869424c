//! `mikoshi completions` and `mikoshi man`: what the command line is, for shells and for readers.

use crate::arguments::{Arguments, CompletionsArguments, ManArguments};
use crate::failure::{Failure, Status};
use crate::print::print_out;
use clap::CommandFactory;
use clap_complete::Shell;

const NAME: &str = "mikoshi";

/// Prints what a shell needs to complete words.
pub fn completions(arguments: &CompletionsArguments) -> Status {
    print_out(&String::from_utf8_lossy(&completion_script(arguments.shell)));
    Status::Met
}

/// What this shell needs to complete words.
pub fn completion_script(shell: Shell) -> Vec<u8> {
    let mut script = vec![];
    clap_complete::generate(shell, &mut Arguments::command(), NAME, &mut script);
    script
}

/// Writes the manual pages.
///
/// # Errors
/// The folder can't be made or written: bad usage.
pub fn man(arguments: &ManArguments) -> Result<(), Failure> {
    let folder = &arguments.folder;
    let written =
        std::fs::create_dir_all(folder).and_then(|()| clap_mangen::generate_to(Arguments::command(), folder));
    written.map_err(|error| Failure::usage(error).context(folder.display()))
}
