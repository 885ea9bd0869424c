//! `mikoshi record`: the frames of a run that goes on, in a file of their own.

use crate::arguments::RecordArguments;
use crate::control::find_run;
use crate::failure::{Failure, Status, as_lines};
use crate::feed::{Heard, Listener, Wish};
use crate::interrupts::Interrupts;
use crate::observed_run::observed_run;
use crate::output_directory::refuse_to_overwrite;
use crate::print::{print_error, print_out};
use mikoshi_coordinator::build_hybrid_law;
use mikoshi_recording::Recording;
use mikoshi_resolution::{read_run, world_file};
use std::io::ErrorKind;
use std::path::Path;

/// Records from the next tick on, until the run ends or somebody interrupts.
///
/// # Errors
/// There is no such run, or no supervisor who sees it: bad usage. The file can't be written.
pub fn record(arguments: &RecordArguments) -> Result<Status, Failure> {
    let interrupts = Interrupts::listen().map_err(Failure::fault)?;
    let directory = find_run(arguments.run.as_deref())?;
    let run = read_run(&directory).map_err(Failure::fault)?;
    let out = arguments.out.as_path();
    refuse_to_overwrite(out, arguments.force)?;
    let connected = Listener::connect(&directory, run.robots.len(), Wish::All);
    let mut listener = connected.map_err(|error| match error.kind() {
        ErrorKind::ConnectionRefused | ErrorKind::NotFound => {
            Failure::usage("the run's supervisor is gone: `mikoshi adopt` looks after it")
        }
        _ => Failure::fault(error),
    })?;
    let world = world_file(&directory);
    let observed = observed_run(&run, build_hybrid_law(&run).map_err(Failure::fault)?.internal_forces())?;
    let mut log = Recording::create(out, &run, &observed, arguments.views.view_hz).map_err(Failure::fault)?;
    let (mut ticks, mut lost) = (None, 0);
    let ended = loop {
        match listener.hear().map_err(Failure::fault)? {
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
    if !arguments.quiet {
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
