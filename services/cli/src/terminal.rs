//! The terminal as a screen of its own, which is given back as it was, however this ends.

use crate::failure::Failure;
use core::time::Duration;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::{DefaultTerminal, Frame};
use std::io::{self, IsTerminal};

/// The screen, from its making to its end; a panic gives the terminal back, too, and is told after that.
pub struct Terminal(DefaultTerminal);

/// What somebody did at the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Typed {
    /// A key went down, or repeats.
    Key(KeyCode),
    /// A key was let go; few terminals tell.
    Released(KeyCode),
    /// `q`, escape or Ctrl-C.
    Quit,
    /// The screen has another size.
    Resized,
}

impl Terminal {
    /// Takes the terminal; `instead` is what to do where there is none.
    ///
    /// # Errors
    /// Standard input or output is no terminal: bad usage.
    pub fn open(instead: &str) -> Result<Self, Failure> {
        if !io::stdin().is_terminal() || !io::stdout().is_terminal() {
            return Err(Failure::usage(format!("this needs a terminal: {instead}")));
        }
        ratatui::try_init().map(Self).map_err(Failure::fault)
    }

    /// Draws the whole screen, as large as it is now.
    ///
    /// # Errors
    /// The terminal is gone.
    pub fn draw(&mut self, render: impl FnOnce(&mut Frame<'_>)) -> Result<(), Failure> {
        self.0.draw(render).map(|_| ()).map_err(Failure::fault)
    }

    /// What was typed, if something was; it never waits.
    ///
    /// # Errors
    /// The terminal is gone.
    pub fn typed(&mut self) -> Result<Option<Typed>, Failure> {
        while event::poll(Duration::ZERO).map_err(Failure::fault)? {
            let typed = match event::read().map_err(Failure::fault)? {
                Event::Key(key) => Some(of_key(&key)),
                Event::Resize(..) => Some(Typed::Resized),
                _ => None,
            };
            if typed.is_some() {
                return Ok(typed);
            }
        }
        Ok(None)
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

fn of_key(key: &KeyEvent) -> Typed {
    let is_control_c = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
    match key.code {
        code if key.kind == KeyEventKind::Release => Typed::Released(code),
        KeyCode::Char('q') | KeyCode::Esc => Typed::Quit,
        _ if is_control_c => Typed::Quit,
        code => Typed::Key(code),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_keys_mean_that_somebody_wants_to_leave() {
        let key = |code, modifiers| of_key(&KeyEvent::new(code, modifiers));
        assert_eq!(key(KeyCode::Char('q'), KeyModifiers::NONE), Typed::Quit);
        assert_eq!(key(KeyCode::Esc, KeyModifiers::NONE), Typed::Quit);
        assert_eq!(key(KeyCode::Char('c'), KeyModifiers::CONTROL), Typed::Quit);
        assert_eq!(key(KeyCode::Char('c'), KeyModifiers::NONE), Typed::Key(KeyCode::Char('c')));
    }
}
