//! `mikoshi-awake`: keeps cores awake until it is killed, and leaves them to whoever else wants them.

use clap::Parser;
use mikoshi_runtime::keep_awake;
use std::process::ExitCode;

/// Keep cores awake: on each spins a thread that runs only while nobody else wants to.
#[derive(Debug, Parser)]
struct Arguments {
    /// A core, by its number; as often as there are cores
    #[arg(long = "core", value_name = "N", required = true)]
    cores: Vec<usize>,
}

fn main() -> ExitCode {
    let Arguments { cores } = Arguments::parse();
    let threads: Vec<_> = cores
        .into_iter()
        .map(|core| {
            std::thread::spawn(move || {
                let Err(error) = keep_awake(core);
                eprintln!("warning: core {core} may sleep: {error}");
            })
        })
        .collect();
    for thread in threads {
        let _ = thread.join();
    }
    // Nobody is left.
    ExitCode::from(3)
}
