//! The `mikoshi` command.

fn main() -> std::process::ExitCode {
    mikoshi::main_of_command()
}
