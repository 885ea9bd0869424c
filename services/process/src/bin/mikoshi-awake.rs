//! `mikoshi-awake`: keeps cores awake until it is killed, wakes those of a run who sleep there, and leaves them to whoever
//! else wants them.

use clap::Parser;
use mikoshi_runtime::{Board, run_when_idle};
use std::path::PathBuf;
use std::process::ExitCode;
use std::thread;

/// Keep cores awake: on each spins a thread that runs only while nobody else wants to.
#[derive(Debug, Parser)]
struct Arguments {
    /// A core, by its number; as often as there are cores
    #[arg(long = "core", value_name = "N", required = true)]
    cores: Vec<usize>,
    /// The run's directory, in which is its board
    #[arg(long, value_name = "DIR")]
    run: PathBuf,
}

fn main() -> ExitCode {
    let Arguments { cores, run } = Arguments::parse();
    let board = match Board::open(&run) {
        Ok(board) => board,
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(3);
        }
    };
    thread::scope(|scope| {
        for core in cores {
            let board = &board;
            scope.spawn(move || {
                if let Err(error) = run_when_idle(core) {
                    eprintln!("warning: core {core} may sleep: {error}");
                    return;
                }
                board.keep_watch(core)
            });
        }
    });
    // Nobody is left.
    ExitCode::from(3)
}
