//! The command line: `truing SUBCOMMAND`.
//!
//! | exit status | meaning |
//! |---|---|
//! | 0 | done, whatever was found |
//! | 1 | the servo did not do what it was asked for: a refused commissioning, a fault, an event that did not come |
//! | 2 | the input is unusable, or the output cannot be written |
//! | 130 | interrupted by Ctrl-C, a termination or a hang-up; the servo was stopped, what was recorded is written |

#![deny(clippy::print_stdout, clippy::print_stderr)]

use std::process::ExitCode;
use truing::cli::Cli;
use truing::console::{interrupt, screen};
use truing::text::input_error::NotDone;
use truing_report::errln;

fn main() -> ExitCode {
    let cli = Cli::read();
    if let Err(error) = interrupt::watch() {
        errln!("warning: Ctrl-C will not stop the servo ({error})");
    }
    let result = cli.run();
    let printed = screen::finish();
    let status = match result {
        // Nobody reads any more, and so the session was ended.
        Err(_) if interrupt::asked() && !interrupt::signalled() => 0,
        Ok(()) if interrupt::signalled() => interrupt::STATUS,
        Ok(()) => 0,
        Err(error) if interrupt::signalled() => {
            errln!("{error:#}");
            interrupt::STATUS
        }
        Err(error) => {
            errln!("error: {error:#}");
            if error.is::<NotDone>() { 1 } else { 2 }
        }
    };
    match printed {
        Err(error) if status == 0 => {
            errln!(
                "error: standard output cannot be written ({error}): free space there, or write to another place"
            );
            ExitCode::from(2)
        }
        _ => ExitCode::from(status),
    }
}
