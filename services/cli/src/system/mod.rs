//! Services that the system starts: what its units call, and how all of it gets onto a machine and off again.
//!
//! systemd starts processes and starts them anew; here is what it can't know: a run for them to take part in, whether
//! the team goes, how it stops, and which services its scenario wants.

mod enlisted;
mod escape;
mod files;
mod install;
mod programs;
mod run;
mod safe_stop;

use crate::arguments::{InstallArguments, ServiceCommand, UninstallArguments};
use crate::failure::Failure;

/// The name of the run that the services take part in.
pub const RUN: &str = "team";

/// What a unit calls.
///
/// # Errors
/// As each says.
pub fn service(command: &ServiceCommand) -> Result<(), Failure> {
    match command {
        ServiceCommand::Prepare(arguments) => run::prepare(arguments),
        ServiceCommand::Clear => run::clear(),
        ServiceCommand::Await => run::wait_until_it_goes(),
        ServiceCommand::Stop => safe_stop::stop(),
        ServiceCommand::Generate { folder } => enlisted::generate(folder),
    }
}

/// `mikoshi install`.
///
/// # Errors
/// A file can't be written.
pub fn install(arguments: &InstallArguments) -> Result<(), Failure> {
    install::install(arguments)
}

/// `mikoshi uninstall`.
///
/// # Errors
/// A file can't be removed.
pub fn uninstall(arguments: &UninstallArguments) -> Result<(), Failure> {
    install::uninstall(arguments)
}
