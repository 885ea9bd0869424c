//! `mikoshi stop` and `mikoshi resume`: the operator's words.

use crate::arguments::OperatorArguments;
use crate::control::{Request, ask, find_run};
use crate::failure::Failure;
use crate::print::print_message;
use mikoshi_ipc_types::operator;
use mikoshi_runtime::Board;

/// Stops the team of a run: the object comes to rest, feet finish their step, hands go on to hold.
///
/// # Errors
/// There is no such run.
pub fn stop(arguments: &OperatorArguments) -> Result<(), Failure> {
    say(arguments, &Request::Stop, operator::STOP, "stop")
}

/// Lets it go on.
///
/// # Errors
/// There is no such run.
pub fn resume(arguments: &OperatorArguments) -> Result<(), Failure> {
    say(arguments, &Request::Resume, operator::RESUME, "go on")
}

fn say(arguments: &OperatorArguments, request: &Request, word: u64, verb: &str) -> Result<(), Failure> {
    let run = find_run(arguments.run.as_deref())?;
    let board = Board::open(&run).map_err(Failure::fault)?;
    let message = match board.is_supervised() {
        true => ask(&run, request)?,
        // A team that nobody looks after hears its operator all the same.
        false => {
            board.say(word);
            format!("the team is told to {verb}; its supervisor is gone: `mikoshi adopt` looks after it")
        }
    };
    print_message(&message, arguments.json)
}
