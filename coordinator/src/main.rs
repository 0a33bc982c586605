//! The `gradfarm` program: parses the command line, runs one subcommand, and ends with its exit code.

use std::process::ExitCode;

use gradfarm::cli;

fn main() -> ExitCode {
    cli::main()
}
