//! Which key means what.

use super::wish::Order;
use mikoshi_ipc_types::operator;
use ratatui::crossterm::event::KeyCode;

/// What stands at the bottom of the screen.
pub const HELP: [&str; 6] = [
    "w s  ↑ ↓  ahead, back      a d  left, right       ← →  turn",
    "PgUp PgDn up, down         i k  lean ahead, back  u o  lean left, right",
    "1 … 9 0   speed            [ ]  press less, more  space  halt",
    "e  EMERGENCY STOP          r  resume              q  quit (the object rests)",
    "g  grasp   l  lift   b  bring down   f  let go: when the job waits for it",
    "A key against the way halts; a second one goes back.",
];

/// What a key asks for, if anything.
pub fn order_of(key: KeyCode) -> Option<Order> {
    Some(match key {
        KeyCode::Char('w') | KeyCode::Up => Order::Nudge(0, 1),
        KeyCode::Char('s') | KeyCode::Down => Order::Nudge(0, -1),
        KeyCode::Char('a') => Order::Nudge(1, 1),
        KeyCode::Char('d') => Order::Nudge(1, -1),
        KeyCode::PageUp => Order::Nudge(2, 1),
        KeyCode::PageDown => Order::Nudge(2, -1),
        KeyCode::Char('u') => Order::Nudge(3, -1),
        KeyCode::Char('o') => Order::Nudge(3, 1),
        KeyCode::Char('i') => Order::Nudge(4, 1),
        KeyCode::Char('k') => Order::Nudge(4, -1),
        KeyCode::Left => Order::Nudge(5, 1),
        KeyCode::Right => Order::Nudge(5, -1),
        KeyCode::Char('0') => Order::Tenths(10),
        KeyCode::Char(digit @ '1'..='9') => Order::Tenths(digit as u8 - b'0'),
        KeyCode::Char('[') => Order::SqueezeBy(-1),
        KeyCode::Char(']') => Order::SqueezeBy(1),
        KeyCode::Char(' ') => Order::Halt,
        KeyCode::Char('e') => Order::Say(operator::STOP),
        KeyCode::Char('r') => Order::Say(operator::RESUME),
        KeyCode::Char('g') => Order::Say(operator::GRASP),
        KeyCode::Char('l') => Order::Say(operator::LIFT),
        KeyCode::Char('b') => Order::Say(operator::LOWER),
        KeyCode::Char('f') => Order::Say(operator::RELEASE),
        _ => return None,
    })
}
