//! `cargo xtask flash --dry-run` runs this on the image that it has built.

use flash_dry_run::{CHIP, check};
use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(image) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!(
            "error: no image given: type `cargo xtask flash --dry-run`, which builds one and checks it"
        );
        return ExitCode::from(2);
    };
    match check(&image) {
        Ok(found) => {
            println!("{found}\nfits {CHIP}; nothing was programmed");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
