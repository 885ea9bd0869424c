//! The log of a run, with its views.

use crate::views::Views;
use mikoshi_config::{RunSpec, ScenarioTextError, scenario_text};
use mikoshi_ipc_types::ServiceId;
use mikoshi_observation::{LogWriter, Observation, ObservedRun, WriteLogError};
use mikoshi_robot::MatchRobotError;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// How often a second of the run is looked at, unless somebody wants otherwise.
pub const DEFAULT_VIEW_HZ: f64 = 50.0;

/// Why a run can't be recorded.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum RecordError {
    #[error(transparent)]
    Write(#[from] WriteLogError),
    #[error(transparent)]
    Describe(#[from] ScenarioTextError),
    #[error(transparent)]
    MatchRobot(#[from] MatchRobotError),
}

/// Writes a run's frames, and beside them what tools show of it.
pub struct Recording {
    log: LogWriter,
    views: Option<Views>,
}

impl Recording {
    /// A log at `path`, with the scenario and the robots attached; views come `view_hz` times a second of the
    /// run, or not at all with zero.
    ///
    /// # Errors
    /// The file can't be written; a robot that can't be read.
    pub fn create(
        path: &Path,
        run: &RunSpec,
        observed: &ObservedRun,
        view_hz: f64,
    ) -> Result<Self, RecordError> {
        let mut log = LogWriter::create(path, run)?;
        log.attach("scenario.toml", "application/toml", scenario_text(run)?.as_bytes())?;
        let urdfs: BTreeMap<_, _> =
            run.robots.iter().map(|robot| (&robot.member.model, &robot.urdf)).collect();
        for (model, urdf) in urdfs {
            log.attach(&format!("{model}.urdf"), "application/xml", urdf.as_bytes())?;
        }
        let views = (view_hz > 0.0).then(|| Views::add(&mut log, run, observed, view_hz)).transpose()?;
        Ok(Self { log, views })
    }

    /// Appends a tick.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn write(&mut self, observation: &Observation) -> Result<(), WriteLogError> {
        self.log.write(observation)?;
        let time_ns = self.log.time_ns(observation.tick());
        self.views.as_mut().map_or(Ok(()), |views| views.write(&mut self.log, time_ns, observation))
    }

    /// See [`LogWriter::write_revision`].
    ///
    /// # Errors
    /// The file can't be written.
    pub fn write_revision(
        &mut self,
        tick: u64,
        service: ServiceId,
        run: &RunSpec,
    ) -> Result<(), WriteLogError> {
        self.log.write_revision(tick, service, run)
    }

    /// Attaches the world in the simulator's language, if it is there, writes the index and closes the file.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn finish(mut self, world: &Path) -> Result<(), WriteLogError> {
        if let Ok(world) = fs::read(world) {
            self.log.attach("world.xml", "application/xml", &world)?;
        }
        self.log.finish()
    }
}
