//! Where a run is shown: a window, a page, a file.

use crate::page::Page;
use core::time::Duration;
use mikoshi::arguments::WatchArguments;
use mikoshi::failure::Failure;
use mikoshi::interrupts::Interrupts;
use mikoshi::output_directory::refuse_to_overwrite;
use mikoshi::print::{print_error, print_json, print_out};
use mikoshi_config::scenario::Scenario;
use re_sdk::log::ChunkBatcherConfig;
use re_sdk::{RecordingStream, RecordingStreamBuilder, RecordingStreamError, SpawnError, SpawnOptions};
use std::collections::BTreeMap;
use std::env;

/// How often it is looked whether somebody interrupts.
pub const LOOK: Duration = Duration::from_millis(50);

/// A place to show a run at.
pub struct Outlet {
    stream: RecordingStream,
    page: Option<Page>,
}

impl Outlet {
    /// The one that is asked for.
    ///
    /// # Errors
    /// There is no window, or the file is there: bad usage. The port is taken, or the file can't be written.
    pub fn open(arguments: &WatchArguments, scenario: &Scenario) -> Result<Self, Failure> {
        let name = format!("{}, seed {}", scenario.name, scenario.seed);
        // What comes within a fifth of a second goes together, to pages too: they would take all day over rows one by one.
        let builder = RecordingStreamBuilder::new("mikoshi")
            .recording_name(name.as_str())
            .batcher_config(ChunkBatcherConfig::DEFAULT);
        if let Some(file) = &arguments.save {
            refuse_to_overwrite(file, arguments.force)?;
            let stream = builder.save(file).map_err(Failure::fault)?;
            return Ok(Self { stream, page: None });
        }
        if arguments.web {
            let page = Page::open(arguments.port, &name)?;
            let stream = page.serve(builder)?;
            // The only word on standard output: whoever has started this process reads it.
            match arguments.json {
                true => print_json(&BTreeMap::from([("page", page.address())]))?,
                false => print_out(&format!("{}\n", page.address())),
            }
            if ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| env::var_os(name).is_some())
                && let Err(error) = webbrowser::open(page.address())
            {
                print_error(&format!("no browser opens it: {error}\n"));
            }
            return Ok(Self { stream, page: Some(page) });
        }
        let stream = builder.spawn_opts(&SpawnOptions { new: true, ..SpawnOptions::default() });
        Ok(Self { stream: stream.map_err(no_window)?, page: None })
    }

    /// What is said there is shown.
    pub fn stream(&self) -> &RecordingStream {
        &self.stream
    }

    /// Sees to it that all has been shown. A page stays until somebody interrupts.
    ///
    /// # Errors
    /// It could not be written.
    pub fn finish(self, interrupts: &Interrupts, is_live: bool) -> Result<(), Failure> {
        self.stream.flush_blocking().map_err(Failure::fault)?;
        if let Some(page) = &self.page {
            if is_live && interrupts.received().is_none() {
                print_error(&format!("the run has ended; {} stays until Ctrl-C\n", page.address()));
            }
            page.stay(interrupts);
        }
        Ok(())
    }
}

fn no_window(error: RecordingStreamError) -> Failure {
    match error {
        RecordingStreamError::SpawnViewer(SpawnError::ExecutableNotFoundInPath { .. }) => Failure::usage(
            "Rerun's window needs the program `rerun`, which is not on the PATH: install it (`pip install \
             rerun-sdk==0.36.3`), or look at a page with --web, for which nothing is missing",
        ),
        error => Failure::fault(error),
    }
}
