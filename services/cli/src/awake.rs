//! Cores of a run's services that are kept from falling asleep.

use crate::binaries::{self, AWAKE};
use crate::children::end_with_this_thread;
use crate::failure::Failure;
use crate::prepare::Prepared;
use mikoshi_config::scenario::{Clock, KeepAwake};
use mikoshi_runtime::cores_to_keep_awake;
use rustix::process::Signal;
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A process that keeps them awake until this is dropped.
pub struct Awake(Child);

impl Awake {
    /// Of this run, in this directory; none where they may sleep.
    ///
    /// # Errors
    /// The program is missing or can't be started.
    pub fn keep(prepared: &Prepared, run: &Path) -> Result<Option<Self>, Failure> {
        let scenario = &prepared.run.scenario;
        let is_wished = match scenario.placement.keep_awake {
            KeepAwake::Never => false,
            KeepAwake::Lockstep => scenario.clock == Clock::Lockstep,
            KeepAwake::Always => true,
        };
        let schedule = &prepared.schedule;
        let pinned = schedule.phases().iter().filter_map(|phase| phase.core);
        let cores = cores_to_keep_awake(pinned, schedule.services().len());
        if !is_wished || cores.is_empty() {
            return Ok(None);
        }
        let program = binaries::find(AWAKE)?;
        let mut command = Command::new(&program);
        command.arg("--run").arg(run);
        command.args(cores.iter().flat_map(|core| ["--core".to_owned(), core.to_string()]));
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let child = end_with_this_thread(&mut command, Signal::KILL).spawn();
        let child = child.map_err(|error| Failure::fault(error).context(program.display()))?;
        Ok(Some(Self(child)))
    }
}

impl Drop for Awake {
    fn drop(&mut self) {
        // It fails if it has ended. Nobody waits for it: where others have enough to do it ends late.
        let _ = self.0.kill();
    }
}
