//! The command line: `truing SUBCOMMAND`. Exit status 0: done, whatever was found; 2: the input is unusable.

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match truing::commands::Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
