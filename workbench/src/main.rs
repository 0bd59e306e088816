//! The command line: `truing SUBCOMMAND`. Exit status 0: done, whatever was found; 2: the input is unusable, or the output
//! cannot be written.

#![deny(clippy::print_stdout, clippy::print_stderr)]

use clap::Parser;
use std::process::ExitCode;
use truing::{commands::Cli, errln, screen};

fn main() -> ExitCode {
    let result = Cli::parse().run();
    let printed = screen::finish();
    match (result, printed) {
        (Err(error), _) => errln!("error: {error:#}"),
        (Ok(()), Err(error)) => errln!(
            "error: standard output cannot be written ({error}): free space there, or write to another place"
        ),
        (Ok(()), Ok(())) => return ExitCode::SUCCESS,
    }
    ExitCode::from(2)
}
