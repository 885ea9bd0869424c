//! `mikoshi top`: a run as it goes on, in a table.

mod cpu;
mod screen;
mod sheet;
mod snapshot;
mod watch;
mod window;

use crate::arguments::TopArguments;
use crate::control::find_run;
use crate::failure::{Failure, Status, as_lines};
use crate::feed::{Heard, Listener};
use crate::interrupts::Interrupts;
use crate::print::{print_error, print_json, print_out};
use crate::terminal::{Terminal, Typed};
use crate::wall_clock::Stopwatch;
use core::time::Duration;
use mikoshi_resolution::read_run;
use ratatui::crossterm::event::KeyCode;
use sheet::{sheet, to_text};
use watch::Watch;

/// How often the screen is drawn: numbers that change faster can't be read.
const DRAW: Duration = Duration::from_millis(250);
/// How often it is looked whether somebody has typed: faster than anybody feels.
const LOOK: Duration = Duration::from_millis(20);
/// How long is watched for one table.
const ONCE: Duration = Duration::from_millis(1100);

/// Watches a run until it ends or somebody has seen enough.
///
/// # Errors
/// There is no such run, or no terminal: bad usage. The terminal is lost: a fault.
pub fn top(arguments: &TopArguments) -> Result<Status, Failure> {
    let interrupts = Interrupts::listen().map_err(Failure::fault)?;
    let directory = find_run(arguments.run.as_deref())?;
    let run = read_run(&directory).map_err(Failure::fault)?;
    let mut watch = Watch::begin(&directory, run)?;
    let mut listener = watch.listen()?;
    let ended = match arguments.once {
        true => watch_until(&mut listener, &mut watch, &interrupts, ONCE)?,
        false => live(&mut listener, &mut watch, &interrupts)?,
    };
    let snapshot = watch.snapshot();
    if arguments.json {
        print_json(&snapshot)?;
    } else if arguments.once || !matches!(ended, Some(Ended::Quit)) {
        print_out(&to_text(&sheet(&snapshot)));
    }
    match ended {
        None | Some(Ended::Quit) => Ok(Status::Met),
        Some(Ended::Signal(signal)) => Ok(Status::Signal(signal)),
        Some(Ended::Run) if arguments.json => Ok(Status::Met),
        Some(Ended::Run) => {
            print_out("the run has ended\n");
            Ok(Status::Met)
        }
        Some(Ended::Supervisor) => {
            let warning = "nobody speaks any more: `mikoshi adopt` looks after the run if it goes on";
            print_error(&as_lines("warning", warning));
            Ok(Status::NotMet)
        }
    }
}

/// Why nothing more is to be seen.
enum Ended {
    Quit,
    Run,
    Supervisor,
    Signal(u8),
}

/// Hears the next that is said, if it comes within a moment.
fn hear(listener: &mut Listener, watch: &mut Watch) -> Result<Option<Ended>, Failure> {
    match listener.hear().map_err(Failure::fault)? {
        Heard::Tick(observation) => watch.take(observation),
        Heard::Revision { tick, service, .. } => watch.revise(tick, service),
        // What was lost is seen by the ticks.
        Heard::Lost(_) | Heard::Nothing => {}
        Heard::End => return Ok(Some(Ended::Run)),
        // Who was too slow for too long is sent away, and may come again.
        Heard::Silence => match watch.listen() {
            Ok(again) => *listener = again,
            Err(_) => return Ok(Some(Ended::Supervisor)),
        },
    }
    Ok(None)
}

fn watch_until(
    listener: &mut Listener,
    watch: &mut Watch,
    interrupts: &Interrupts,
    limit: Duration,
) -> Result<Option<Ended>, Failure> {
    // A process is seen twice: shares of a core are told from one look to the next.
    watch.snapshot();
    while watch.time() < limit {
        let ended = hear(listener, watch)?;
        let ended = ended.or(interrupts.received().map(Ended::Signal));
        if ended.is_some() {
            return Ok(ended);
        }
    }
    Ok(None)
}

fn live(
    listener: &mut Listener,
    watch: &mut Watch,
    interrupts: &Interrupts,
) -> Result<Option<Ended>, Failure> {
    let mut terminal = Terminal::open("`mikoshi top --once` prints one table")?;
    let (mut since_drawn, mut since_looked) = (None::<Stopwatch>, Stopwatch::start());
    let (mut from, mut last) = (0_usize, 0);
    loop {
        if let Some(ended) = hear(listener, watch)?.or(interrupts.received().map(Ended::Signal)) {
            return Ok(Some(ended));
        }
        let mut is_due = since_drawn.is_none_or(|since| since.elapsed() >= DRAW);
        if since_looked.elapsed() >= LOOK {
            since_looked.lap();
            while let Some(typed) = terminal.typed()? {
                is_due = true;
                match typed {
                    Typed::Quit => return Ok(Some(Ended::Quit)),
                    Typed::Key(KeyCode::Down) => from = (from + 1).min(last),
                    Typed::Key(KeyCode::Up) => from = from.min(last).saturating_sub(1),
                    Typed::Key(KeyCode::Home) => from = 0,
                    Typed::Key(KeyCode::End) => from = last,
                    Typed::Key(_) | Typed::Released(_) | Typed::Resized => {}
                }
            }
        }
        if is_due {
            let sheet = sheet(&watch.snapshot());
            terminal.draw(|frame| last = screen::draw(frame, &sheet, from))?;
            since_drawn = Some(Stopwatch::start());
        }
    }
}
