//! The team is stopped and seen to stand, before anybody takes its services away.

use super::run::path;
use crate::control::{Request, ask};
use crate::failure::{Failure, as_lines};
use crate::feed::{Heard, Listener, Wish};
use crate::print::{print_error, print_out};
use crate::wall_clock::{Stopwatch, pause};
use core::time::Duration;
use mikoshi_humanoid::gait::StepClock;
use mikoshi_ipc_types::{TeamState, mode, operator};
use mikoshi_resolution::read_run;
use mikoshi_runtime::{Board, Role, State};

/// How long a team may take: a step, and the object's way to rest.
const PATIENCE: Duration = Duration::from_secs(8);
/// The object rests when its reference moves slower \[m/s, rad/s\].
const AT_REST: f64 = 1e-3;

/// Tells the team to stop, and waits until it stands.
///
/// # Errors
/// There is no such run. A team that does not come to rest in time is no error: it must be taken away all the same.
pub fn stop() -> Result<(), Failure> {
    let run = path();
    let board = Board::open(&run).map_err(Failure::fault)?;
    let is_over = |(role, state): (Role, State)| !matches!(role, Role::Service(_)) || state.has_ended();
    if board.states().all(is_over) {
        return Ok(());
    }
    let robots = read_run(&run).map_err(Failure::fault)?.robots.len();
    let since_asked = Stopwatch::start();
    let listener = Listener::connect(&run, robots, Wish::Some);
    // Whoever does not record answers nobody, either.
    if !board.is_supervised() || ask(&run, &Request::Stop).is_err() {
        board.say(operator::STOP);
    }
    let Ok(mut listener) = listener else {
        print_error(&as_lines(
            "warning",
            "nobody sees whether the team stands: it gets the time that it may take",
        ));
        pause(PATIENCE);
        return Ok(());
    };
    while since_asked.elapsed() < PATIENCE {
        match listener.hear() {
            Ok(Heard::Tick(observation)) if rests(&observation.team_state.payload) => {
                print_out(&format!("the team stands in tick {}\n", observation.tick()));
                return Ok(());
            }
            Ok(Heard::End | Heard::Silence) | Err(_) => break,
            Ok(_) => {}
        }
    }
    print_error(&as_lines("warning", "the team was not seen to come to rest"));
    Ok(())
}

/// Whether a team has stopped, stands, and holds the object still.
fn rests(team: &TeamState) -> bool {
    team.team_mode == mode::SAFE_STOP
        && StepClock::from_words(team.step_clock) == Some(StepClock::Standing)
        && team.object_twist_ref.iter().all(|speed| speed.abs() < AT_REST)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable as _;

    #[test]
    fn a_team_rests_when_it_has_stopped_and_neither_feet_nor_object_move() {
        let stopped = TeamState { team_mode: mode::SAFE_STOP, ..TeamState::zeroed() };
        assert!(rests(&stopped));
        assert!(!rests(&TeamState { team_mode: mode::CARRY, ..stopped }));
        assert!(!rests(&TeamState { step_clock: [2, 0, 7, 0], ..stopped }));
        let mut moving = stopped;
        moving.object_twist_ref[1] = 0.01;
        assert!(!rests(&moving));
    }
}
