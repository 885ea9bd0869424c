//! A run to be looked at: one that goes on, or one that was recorded.

use crate::control::find_run;
use crate::failure::{Failure, as_lines};
use crate::feed::{Heard, Listener, Wish, listen_to};
use crate::observed_run::observed_run;
use crate::output_directory::RUN_LOG;
use crate::print::print_error;
use mikoshi_config::RunSpec;
use mikoshi_coordinator::build_hybrid_law;
use mikoshi_observation::{LogReader, Observation, ObservedRun};
use mikoshi_resolution::read_run;
use std::io;
use std::path::{Path, PathBuf};

/// A run, and its ticks one after the other.
pub struct WatchedRun {
    /// The run.
    pub run: RunSpec,
    /// What observers must know of it.
    pub observed: ObservedRun,
    source: Source,
}

enum Source {
    Log(Box<Log>),
    Feed(Box<Feed>),
}

struct Log {
    path: PathBuf,
    reader: LogReader,
    observation: Observation,
}

struct Feed {
    directory: PathBuf,
    robots: usize,
    wish: Wish,
    listener: Listener,
    /// Who was given up, and may lose ticks, comes again.
    again: Option<Listener>,
}

impl WatchedRun {
    /// The log of this name, or the one in the folder of this name; if there is none, the run of this name that goes
    /// on, or the only one.
    ///
    /// # Errors
    /// There is none, or none that can be read: bad usage.
    pub fn open(name: Option<&str>, wish: Wish) -> Result<Self, Failure> {
        match name.map(Path::new).filter(|path| path.exists()) {
            Some(folder) if folder.is_dir() => Self::recorded(&folder.join(RUN_LOG)),
            Some(log) => Self::recorded(log),
            None => Self::listen(&find_run(name)?, wish),
        }
    }

    fn recorded(path: &Path) -> Result<Self, Failure> {
        let reader = LogReader::open(path).map_err(Failure::usage)?;
        let run = reader.run().clone();
        let observation = Observation::for_team(run.robots.len());
        Self::of(run, Source::Log(Box::new(Log { path: path.to_owned(), reader, observation })))
    }

    /// The run in this directory, which goes on.
    ///
    /// # Errors
    /// Its supervisor is gone: bad usage.
    pub fn listen(directory: &Path, wish: Wish) -> Result<Self, Failure> {
        let run = read_run(directory).map_err(Failure::fault)?;
        let robots = run.robots.len();
        let listener = listen_to(directory, robots, wish)?;
        let directory = directory.to_owned();
        Self::of(run, Source::Feed(Box::new(Feed { directory, robots, wish, listener, again: None })))
    }

    fn of(run: RunSpec, source: Source) -> Result<Self, Failure> {
        let law = build_hybrid_law(&run).map_err(Failure::usage)?;
        let observed = observed_run(&run, law.internal_forces())?;
        Ok(Self { run, observed, source })
    }

    /// Whether it goes on.
    pub fn is_live(&self) -> bool {
        matches!(self.source, Source::Feed(_))
    }

    /// What comes next, or after a moment nothing.
    ///
    /// # Errors
    /// The log can't be read; the supervisor is of another build.
    pub fn hear(&mut self) -> Result<Heard<'_>, Failure> {
        match &mut self.source {
            Source::Feed(feed) => feed.hear().map_err(Failure::fault),
            Source::Log(log) => {
                let Log { path, reader, observation } = &mut **log;
                if reader.read_tick(observation).map_err(Failure::usage)? {
                    return Ok(Heard::Tick(observation));
                }
                if let Some(damage) = reader.damage() {
                    let warning = format!("{}: cut or damaged, shown up to there: {damage}", path.display());
                    print_error(&as_lines("warning", &warning));
                }
                Ok(Heard::End)
            }
        }
    }
}

impl Feed {
    fn hear(&mut self) -> io::Result<Heard<'_>> {
        if let Some(again) = self.again.take() {
            self.listener = again;
        }
        match self.listener.hear()? {
            Heard::Silence if self.wish == Wish::Some => {
                self.again = Listener::connect(&self.directory, self.robots, self.wish).ok();
                Ok(if self.again.is_some() { Heard::Nothing } else { Heard::Silence })
            }
            heard => Ok(heard),
        }
    }
}
