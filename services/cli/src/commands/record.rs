//! `mikoshi record`: the frames of a run that goes on, in a file of their own.

use crate::arguments::RecordArguments;
use crate::aside::step_aside;
use crate::control::find_run;
use crate::failure::{Failure, Status, as_lines};
use crate::feed::{Heard, Wish};
use crate::interrupts::Interrupts;
use crate::output_directory::refuse_to_overwrite;
use crate::print::{print_error, print_json, print_out};
use crate::watched_run::WatchedRun;
use mikoshi_config::scenario::Clock;
use mikoshi_recording::Recording;
use mikoshi_resolution::world_file;
use serde::Serialize;
use std::path::Path;

/// Records from the next tick on, until the run ends or somebody interrupts.
///
/// # Errors
/// There is no such run, or no supervisor who sees it: bad usage. The file can't be written.
pub fn record(arguments: &RecordArguments) -> Result<Status, Failure> {
    let interrupts = Interrupts::listen().map_err(Failure::fault)?;
    let directory = find_run(arguments.run.as_deref())?;
    let out = arguments.out.as_path();
    refuse_to_overwrite(out, arguments.force)?;
    let mut watched = WatchedRun::listen(&directory, Wish::All)?;
    let scenario = &watched.run.scenario;
    // In lockstep the run waits for it.
    if scenario.clock == Clock::Wall {
        step_aside(&scenario.placement);
    }
    let world = world_file(&directory);
    let mut log = Recording::create(out, &watched.run, &watched.observed, arguments.views.view_hz)
        .map_err(Failure::fault)?;
    let (mut ticks, mut lost) = (None, 0);
    let ended = loop {
        match watched.hear()? {
            Heard::Tick(observation) => {
                log.write(observation).map_err(Failure::fault)?;
                let (first, _) = ticks.unwrap_or((observation.tick(), 0));
                ticks = Some((first, observation.tick()));
            }
            Heard::Revision { tick, service, run } => {
                log.write_revision(tick, service, &run).map_err(Failure::fault)?;
            }
            Heard::Lost(more) => lost += more,
            Heard::End => break Ended::Run,
            Heard::Silence => break Ended::Supervisor,
            Heard::Nothing => {}
        }
        if interrupts.received().is_some() {
            break Ended::Interrupted;
        }
    };
    log.finish(&world).map_err(Failure::fault)?;
    if arguments.json {
        print_json(&Recorded {
            first_tick: ticks.map(|(first, _)| first),
            last_tick: ticks.map(|(_, last)| last),
            ticks_lost: lost,
            out,
        })?;
    } else if !arguments.quiet {
        print_out(&tell(ticks, lost, out));
    }
    match ended {
        // An interrupt is how a recording of a long run ends.
        Ended::Run | Ended::Interrupted => Ok(Status::Met),
        Ended::Supervisor => {
            let at = ticks.map_or_else(String::new, |(_, last)| format!(" after tick {last}"));
            print_error(&as_lines("warning", &format!("nobody speaks any more{at}: the log ends there")));
            Ok(Status::NotMet)
        }
    }
}

/// What `mikoshi record --json` prints.
#[derive(Debug, Serialize)]
struct Recorded<'a> {
    first_tick: Option<u64>,
    last_tick: Option<u64>,
    ticks_lost: u64,
    out: &'a Path,
}

enum Ended {
    Run,
    Supervisor,
    Interrupted,
}

fn tell(ticks: Option<(u64, u64)>, lost: u64, out: &Path) -> String {
    let out = out.display();
    match (ticks, lost) {
        (None, _) => format!("no tick was seen; {out} holds the run's description\n"),
        (Some((first, last)), 0) => format!("ticks {first} to {last} in {out}\n"),
        (Some((first, last)), lost) => {
            format!("ticks {first} to {last} in {out}, without {lost} lost ones\n")
        }
    }
}
