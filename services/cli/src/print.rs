//! Writing to the terminal. A reader that has gone (`mikoshi plan | head`) is no error of ours.

use std::io::{self, Write};

/// Writes to standard output.
pub fn print_out(text: &str) {
    write_to(io::stdout().lock(), text);
}

/// Writes to standard error.
pub fn print_error(text: &str) {
    write_to(io::stderr().lock(), text);
}

fn write_to(mut stream: impl Write, text: &str) {
    // Nobody is left to be told if it can't be written.
    let _ = stream.write_all(text.as_bytes()).and_then(|()| stream.flush());
}
