//! Writing to the terminal. A reader that has gone (`mikoshi plan | head`) is no error of ours.

use crate::failure::Failure;
use serde::Serialize;
use std::io::{self, Write};
use std::path::Path;

/// Writes to standard output.
pub fn print_out(text: &str) {
    write_to(io::stdout().lock(), text);
}

/// Writes to standard output what programs read: one JSON value, and the end of a line.
///
/// # Errors
/// It holds what JSON can't: a fault.
pub fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(value).map_err(Failure::fault)?;
    print_out(&(text + "\n"));
    Ok(())
}

/// Writes what was done to standard output, in words: as JSON `{"message"}`.
///
/// # Errors
/// None that can happen to a text.
pub fn print_message(message: &str, as_json: bool) -> Result<(), Failure> {
    if as_json {
        return print_json(&serde_json::json!({ "message": message }));
    }
    print_out(&format!("{message}\n"));
    Ok(())
}

/// Writes the file that was made to standard output: as JSON `{"file"}`.
///
/// # Errors
/// Its name is no text: a fault.
pub fn print_file(file: &Path, as_json: bool) -> Result<(), Failure> {
    if as_json {
        return print_json(&serde_json::json!({ "file": file }));
    }
    print_out(&format!("{}\n", file.display()));
    Ok(())
}

/// Writes to standard error.
pub fn print_error(text: &str) {
    write_to(io::stderr().lock(), text);
}

fn write_to(mut stream: impl Write, text: &str) {
    // Nobody is left to be told if it can't be written.
    let _ = stream.write_all(text.as_bytes()).and_then(|()| stream.flush());
}
