//! `mikoshi drive`: somebody moves the object, by keys or by a script.
//!
//! What is wanted is said again and again, [`EVERY`] so often, by the same loop that reads the keys: if this process is
//! killed, frozen, or hangs on its terminal, the team hears nothing new, and the object comes to rest.

mod keys;
mod screen;
mod script;
mod view;
mod wish;

use crate::arguments::DriveArguments;
use crate::control::find_run;
use crate::failure::{Failure, Status};
use crate::interrupts::Interrupts;
use crate::print::print_message;
use crate::terminal::{Terminal, Typed};
use crate::wall_clock::{Stopwatch, pause};
use core::time::Duration;
use mikoshi_resolution::read_run;
use mikoshi_runtime::{Board, Driver, TakeWheelError};
use script::Script;
use std::io::Read as _;
use view::{Ended as ViewEnded, View, Watcher};
use wish::{Order, Wish};

/// How often what is wanted is said: more often than the twenty times a second that silence is measured by, for runs
/// in lockstep, whose time may go by faster.
const EVERY: Duration = Duration::from_millis(10);
/// How often the screen is drawn.
const DRAW: Duration = Duration::from_millis(100);

/// Drives a run until it ends, or somebody has driven enough.
///
/// # Errors
/// There is no such run, nobody may drive it or somebody does already, a script that is wrong, no terminal: bad usage.
pub fn drive(arguments: &DriveArguments) -> Result<Status, Failure> {
    let interrupts = Interrupts::listen().map_err(Failure::fault)?;
    let script = arguments.script.as_deref().map(read_script).transpose()?;
    let directory = find_run(arguments.run.as_deref())?;
    let run = read_run(&directory).map_err(Failure::fault)?;
    let Some(limits) = run.scenario.operator.drive.clone() else {
        let name = &run.scenario.name;
        return Err(Failure::usage(format!("nobody may drive {name}: its scenario has no [operator.drive]")));
    };
    let watcher = Watcher::start(&directory, &run)?;
    let board = Board::open(&directory).map_err(Failure::fault)?;
    let driver = Driver::take_wheel(board, arguments.take_over).map_err(|error| match error {
        TakeWheelError::Taken(process) => {
            let told = format!("process {} drives already: --take-over takes its place", process.pid);
            Failure::usage(told)
        }
        TakeWheelError::Io(error) => Failure::fault(error),
    })?;
    let mut seat = Seat { driver, wish: Wish::new(limits), watcher, interrupts };
    let ended = match script {
        Some(script) => seat.follow(script),
        None => seat.by_keys(),
    };
    // Whatever ended it: the object is to rest.
    seat.wish.obey(&Order::Halt);
    seat.say();
    let ended = ended?;
    print_message(ended.text(), arguments.json)?;
    Ok(match ended {
        Ended::Enough | Ended::Run => Status::Met,
        Ended::Supervisor | Ended::Displaced => Status::NotMet,
        Ended::Signal(signal) => Status::Signal(signal),
    })
}

fn read_script(path: &std::path::Path) -> Result<Script, Failure> {
    let text = match path.as_os_str() == "-" {
        true => {
            let mut text = String::new();
            std::io::stdin().read_to_string(&mut text).map(|_| text)
        }
        false => std::fs::read_to_string(path),
    };
    let text = text.map_err(|error| Failure::usage(error).context(path.display()))?;
    Script::parse(&text).map_err(|error| Failure::usage(error).context(path.display()))
}

/// Why nobody drives any more.
enum Ended {
    Enough,
    Run,
    Supervisor,
    Displaced,
    Signal(u8),
}

impl Ended {
    fn text(&self) -> &'static str {
        match self {
            Self::Enough | Self::Signal(_) => "nobody drives any more: the object comes to rest",
            Self::Run => "the run has ended",
            Self::Supervisor => "the run's supervisor is gone: `mikoshi adopt` looks after it",
            Self::Displaced => "another process drives",
        }
    }
}

struct Seat {
    driver: Driver,
    wish: Wish,
    watcher: Watcher,
    interrupts: Interrupts,
}

impl Seat {
    /// Says what is wanted; false if another process drives.
    fn say(&mut self) -> bool {
        self.driver.say(self.wish.twist(), self.wish.squeeze_n())
    }

    fn obey(&mut self, order: &Order) {
        self.wish.obey(order);
        if let Order::Say(command) = order {
            self.driver.board().say(*command);
        }
    }

    /// What is seen now, or why this ends.
    fn look(&mut self) -> Result<View, Ended> {
        if let Some(signal) = self.interrupts.received() {
            return Err(Ended::Signal(signal));
        }
        if !self.say() {
            return Err(Ended::Displaced);
        }
        self.watcher.look().map_err(|ended| match ended {
            ViewEnded::Run => Ended::Run,
            ViewEnded::Supervisor => Ended::Supervisor,
        })
    }

    fn follow(&mut self, script: Script) -> Result<Ended, Failure> {
        let mut orders = script.into_iter().peekable();
        let mut start_s = None;
        loop {
            let view = match self.look() {
                Ok(view) => view,
                Err(ended) => return Ok(ended),
            };
            if let Some(time_s) = view.time_s {
                let gone_s = time_s - *start_s.get_or_insert(time_s);
                while let Some((_, order)) = orders.next_if(|(at_s, _)| *at_s <= gone_s) {
                    match order {
                        Order::End => return Ok(Ended::Enough),
                        order => self.obey(&order),
                    }
                }
                if orders.peek().is_none() {
                    return Ok(Ended::Enough);
                }
            }
            pause(EVERY);
        }
    }

    fn by_keys(&mut self) -> Result<Ended, Failure> {
        let mut terminal = Terminal::open("`mikoshi drive --script FILE` drives without one")?;
        let mut since_drawn = None::<Stopwatch>;
        loop {
            let mut is_due = since_drawn.is_none_or(|since| since.elapsed() >= DRAW);
            while let Some(typed) = terminal.typed()? {
                is_due = true;
                match typed {
                    Typed::Quit => return Ok(Ended::Enough),
                    Typed::Key(key) => {
                        if let Some(order) = keys::order_of(key) {
                            self.obey(&order);
                        }
                    }
                    Typed::Released(_) | Typed::Resized => {}
                }
            }
            let view = match self.look() {
                Ok(view) => view,
                Err(ended) => return Ok(ended),
            };
            if view.stop.is_some() {
                self.wish.obey(&Order::Halt);
            }
            if is_due {
                terminal.draw(|frame| screen::draw(frame, &view, &self.wish))?;
                since_drawn = Some(Stopwatch::start());
            }
            pause(EVERY);
        }
    }
}
