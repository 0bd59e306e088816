//! `cargo xtask flash --dry-run` runs this on the image that it has built, with the name of its board.

use boards::{Chip, DEFAULT};
use flash_dry_run::check;
use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(image) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!(
            "error: no image given: type `cargo xtask flash --dry-run`, which builds one and checks it"
        );
        return ExitCode::from(2);
    };
    let Some(chip) = chip(std::env::args().nth(2).as_deref()) else {
        eprintln!("error: there is no board of that name: see docs/boards/README.md");
        return ExitCode::from(2);
    };
    match check(&image, chip) {
        Ok(found) => {
            println!("{found}\nfits {}; nothing was programmed", chip.probe);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// The chip of the board of this name, or of the default one.
fn chip(board: Option<&str>) -> Option<&'static Chip> {
    match board {
        Some(name) => boards::real().find(|board| board.name == name).map(|board| board.chip),
        None => Some(DEFAULT.chip),
    }
}
